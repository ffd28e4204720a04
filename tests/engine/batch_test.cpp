// A batch is many simulations: the same motion as one by one, the same bits in any company, and no instance pays for another's failure.
#include "engine/batch.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::batch_test {
namespace {

using SharedModel = std::shared_ptr<const Model>;

SharedModel shared(Model model) { return std::make_shared<const Model>(std::move(model)); }
Model own_model(const char* file, Base base) { return load_urdf(std::string(LINDEN_MODELS_DIR) + "/" + file, base); }

template <class Batch>
void start(Batch& batch, std::int64_t i, std::uint64_t seed, double spread) {
  const InitialState state = random_state(batch.model(), seed, spread);
  batch.reset(i, state.positions, state.velocities);
}

template <class Batch>
void start_all(Batch& batch, double spread) {
  for (std::int64_t i = 0; i < batch.size(); ++i) start(batch, i, static_cast<std::uint64_t>(i) + 1, spread);
}

/// Everything an instance is, as bytes.
template <class Batch>
std::string bytes_of(const Batch& batch, std::int64_t i) {
  const Eigen::VectorXd q = batch.positions().instance(i).template cast<double>();
  const Eigen::VectorXd p = batch.momenta().instance(i).template cast<double>();
  std::string bytes(static_cast<std::size_t>(q.size() + p.size()) * sizeof(double), '\0');
  std::memcpy(bytes.data(), q.data(), static_cast<std::size_t>(q.size()) * sizeof(double));
  std::memcpy(bytes.data() + static_cast<std::size_t>(q.size()) * sizeof(double), p.data(), static_cast<std::size_t>(p.size()) * sizeof(double));
  return bytes;
}

template <class Batch>
double difference(const Batch& batch, std::int64_t i, Simulation& simulation) {
  double worst = 0;
  for (Index row = 0; row < batch.positions().rows(); ++row) {
    worst = std::max(worst, std::abs(static_cast<double>(batch.positions()(i, row)) - simulation.positions()[static_cast<std::size_t>(row)]));
  }
  return worst;
}

TEST_CASE("every instance moves as a simulation of its own, with any set of instructions") {
  // fast ones among slow ones, so that lanes of a block need different numbers of corrections
  const SharedModel models[] = {shared(chain(10)), shared(random_tree({.bodies = 14, .seed = 3})),
                                shared(own_model("humanoid.urdf", Base::floating)), shared(own_model("hand.urdf", Base::fixed))};
  for (const SharedModel& model : models) {
    for (const Instructions instructions : all_instructions()) {
      const Options options{.tolerance = 1e-13};
      Batch batch(model, 19, options, {}, {.instructions = instructions});
      const auto spread = [](std::int64_t i) { return i % 5 == 0 ? 2.0 : 0.3; };
      for (std::int64_t i = 0; i < batch.size(); ++i) start(batch, i, static_cast<std::uint64_t>(i) + 1, spread(i));
      batch.step(60);
      double worst = 0;
      for (std::int64_t i = 0; i < batch.size(); ++i) {
        Simulation simulation(model, options);
        const InitialState state = random_state(*model, static_cast<std::uint64_t>(i) + 1, spread(i));
        simulation.set_positions(state.positions);
        simulation.set_velocities(state.velocities);
        for (int k = 0; k < 60; ++k) REQUIRE(simulation.step().ok());
        worst = std::max(worst, difference(batch, i, simulation));
        CHECK(batch.record(i).steps == 60);
      }
      INFO(model->names.model << ", " << name(instructions) << ": largest difference " << worst);
      // by its own sweeps: steps taken alone are a simulation's anyway
      CHECK(batch.summary().rescued == 0);
      CHECK(batch.lanes() == (instructions == Instructions::scalar ? 1 : 1 << static_cast<int>(instructions)));
      CHECK(worst < 1e-9);
    }
  }
}

template <class AnyBatch>
void check_bits() {
  const SharedModel model = shared(random_tree({.bodies = 10, .seed = 8}));
  const auto run = [&](std::int64_t size, int threads, std::int64_t first, const std::vector<std::int64_t>& parts) {
    AnyBatch batch(model, size, {}, {}, {.threads = threads});
    // some fast, so that neighbours differ in what they need
    for (std::int64_t i = 0; i < size; ++i) start(batch, i, static_cast<std::uint64_t>(first + i), (first + i) % 3 == 0 ? 4.0 : 0.2);
    for (const std::int64_t steps : parts) batch.step(steps);
    CHECK(batch.summary().rescued == 0);
    std::vector<std::string> bytes;
    for (std::int64_t i = 0; i < size; ++i) bytes.push_back(bytes_of(batch, i));
    return bytes;
  };
  const std::vector<std::string> reference = run(41, 1, 0, {60});
  CHECK(run(41, 2, 0, {60}) == reference);
  CHECK(run(41, 3, 0, {60}) == reference);
  CHECK(run(41, 1, 0, {1, 2, 57}) == reference);
  // other neighbours, other places, alone
  for (const std::int64_t first : {1, 5, 17, 40}) {
    const std::int64_t size = 41 - first;
    const std::vector<std::string> part = run(size, 2, first, {60});
    for (std::int64_t i = 0; i < size; ++i) CHECK(part[static_cast<std::size_t>(i)] == reference[static_cast<std::size_t>(first + i)]);
  }
}

TEST_CASE("results are equal to the bit for any threads, any batch, any place in it and any splitting of the steps") {
  check_bits<Batch>();
  check_bits<FloatBatch>();
}

TEST_CASE("of 10,000 instances with a poisoned one 9,999 end as without it, and it is frozen where it was") {
  const SharedModel model = shared(chain(3));
  constexpr std::int64_t kPoisoned = 4321;
  const auto run = [&](bool poison) {
    Options options;
    options.max_splits = 2;
    auto batch = std::make_unique<Batch>(model, 10'000, options);
    batch->reset_all([&](std::int64_t i, std::span<double> q, std::span<double> v) {
      const InitialState state = random_state(*model, static_cast<std::uint64_t>(i) + 1, 0.5);
      std::copy(state.positions.begin(), state.positions.end(), q.begin());
      std::copy(state.velocities.begin(), state.velocities.end(), v.begin());
    });
    if (poison) batch->reset(kPoisoned, std::vector{0.1, 0.2, 0.3}, std::vector{1e6, -1e6, 1e6});
    batch->step(20);
    return batch;
  };
  const auto healthy = run(false), poisoned = run(true);
  std::int64_t different = 0;
  for (std::int64_t i = 0; i < healthy->size(); ++i) different += bytes_of(*healthy, i) == bytes_of(*poisoned, i) ? 0 : 1;
  CHECK(different == 1);
  CHECK(healthy->summary().frozen == 0);
  CHECK(poisoned->summary().frozen == 1);
  CHECK(poisoned->summary().steps == 9'999 * 20);
  const InstanceRecord& record = poisoned->record(kPoisoned);
  CHECK(record.status != StepStatus::converged);
  CHECK(record.steps == 0);
  CHECK(poisoned->positions()(kPoisoned, 1) == 0.2);
  CHECK_THAT(poisoned->describe(kPoisoned), Catch::Contains("joint"));
  CHECK(poisoned->describe(0).empty());

  // and lives again once it is reset, beside others that do not notice
  poisoned->reset(kPoisoned, std::vector{0.1, 0.2, 0.3}, std::vector{0.0, 0.0, 0.0});
  const std::string neighbour = bytes_of(*poisoned, kPoisoned + 1);
  CHECK(neighbour == bytes_of(*healthy, kPoisoned + 1));
  healthy->step(5);
  poisoned->step(5);
  CHECK(poisoned->record(kPoisoned).steps == 5);
  CHECK(bytes_of(*poisoned, kPoisoned + 1) == bytes_of(*healthy, kPoisoned + 1));
}

TEST_CASE("an instance that is reset starts a new episode, the same as the first") {
  const SharedModel model = shared(own_model("arm.urdf", Base::fixed));
  Batch batch(model, 11);
  start_all(batch, 0.5);
  batch.step(30);
  const std::string once = bytes_of(batch, 6), other = bytes_of(batch, 5);
  start(batch, 6, 7, 0.5);
  CHECK(bytes_of(batch, 5) == other);
  CHECK(batch.record(6).steps == 0);
  batch.step(30);
  CHECK(bytes_of(batch, 6) == once);
  CHECK(batch.record(6).steps == 30);
  CHECK(batch.record(5).steps == 60);
}

TEST_CASE("a step that is too large for the lanes is taken alone, split as a simulation would split it") {
  const SharedModel model = shared(chain(10));
  Options options;
  options.step = 1e-2;
  options.tolerance = 1e-12;
  Batch batch(model, 40, options);
  start_all(batch, 80);
  batch.step(3);
  CHECK(batch.summary().rescued > 0);
  double worst = 0;
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    Simulation simulation(model, options);
    const InitialState state = random_state(*model, static_cast<std::uint64_t>(i) + 1, 80);
    simulation.set_positions(state.positions);
    simulation.set_velocities(state.velocities);
    std::int64_t steps = 0;
    while (steps < 3 && simulation.step().ok()) ++steps;
    CHECK(batch.record(i).steps == steps);
    worst = std::max(worst, difference(batch, i, simulation));
  }
  INFO("largest difference " << worst);
  CHECK(worst < 1e-6);
}

TEST_CASE("forces given from outside do the work they do in a simulation") {
  const SharedModel model = shared(own_model("humanoid.urdf", Base::floating));
  const Index nv = model->tree.shape.velocities;
  Options options;
  options.tolerance = 1e-13;
  options.gravity = {0, 0, 0};
  Batch batch(model, 5, options);
  start_all(batch, 0.2);
  const auto force = [&](std::int64_t i, Index row) { return 0.5 * std::sin(static_cast<double>(3 * i + row)); };
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    for (Index row = 0; row < nv; ++row) batch.forces()(i, row) = force(i, row);
  }
  batch.step(40);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    Simulation simulation(model, options);
    const InitialState state = random_state(*model, static_cast<std::uint64_t>(i) + 1, 0.2);
    simulation.set_positions(state.positions);
    simulation.set_velocities(state.velocities);
    std::vector<double> forces;
    for (Index row = 0; row < nv; ++row) forces.push_back(force(i, row));
    simulation.set_forces(forces);
    for (int k = 0; k < 40; ++k) REQUIRE(simulation.step().ok());
    CHECK(difference(batch, i, simulation) < 1e-9);
    simulation.set_forces({});
  }
}

TEST_CASE("instances with masses of their own move as models with those masses") {
  const Model plain = own_model("arm.urdf", Base::fixed);
  const Options options{.tolerance = 1e-13};
  for (const Instructions instructions : all_instructions()) {
    Batch batch(plain, 6, options, {}, {.instructions = instructions});
    const auto heavier = [](std::array<double, 10> inertia, std::int64_t i) {
      for (double& number : inertia) number *= 1 + 0.3 * static_cast<double>(i);
      return inertia;
    };
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      for (const Index slot : {2, 3}) batch.set_inertia(i, slot, heavier(batch.inertia(i, slot), i));
      start(batch, i, 4, 0.5);
    }
    batch.step(50);
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      Model model = plain;
      for (const Index slot : {2, 3}) {
        const std::array<double, 10> inertia = batch.inertia(i, slot);
        for (std::size_t k = 0; k < 10; ++k) model.constants.inertia(slot, static_cast<int>(k)) = inertia[k];
      }
      sum_subtree_masses(model.tree, model.constants);
      Simulation simulation(model, options);
      const InitialState state = random_state(model, 4, 0.5);
      simulation.set_positions(state.positions);
      simulation.set_velocities(state.velocities);
      for (int k = 0; k < 50; ++k) REQUIRE(simulation.step().ok());
      CHECK(difference(batch, i, simulation) < 1e-9);
      const auto seen = batch.observe();
      CHECK(seen.energies()(i, 0) == Approx(simulation.energy().kinetic).epsilon(1e-9));
      CHECK(seen.energies()(i, 1) == Approx(simulation.energy().potential).epsilon(1e-9));
    }
    CHECK(bytes_of(batch, 0) != bytes_of(batch, 5));
  }
}

TEST_CASE("velocities and energies are those of a simulation, mimic joints included") {
  for (const SharedModel& model : {shared(own_model("humanoid.urdf", Base::floating)), shared(own_model("hand.urdf", Base::fixed))}) {
    Batch batch(model, 10);
    start_all(batch, 0.4);
    const auto seen = batch.observe();
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      Simulation simulation(model);
      const InitialState state = random_state(*model, static_cast<std::uint64_t>(i) + 1, 0.4);
      simulation.set_positions(state.positions);
      simulation.set_velocities(state.velocities);
      const std::vector<double> v = simulation.velocities();
      for (Index row = 0; row < model->tree.shape.velocities; ++row) {
        CHECK(seen.velocities()(i, row) == Approx(v[static_cast<std::size_t>(row)]).margin(1e-10));
      }
      CHECK(seen.energies()(i, 0) == Approx(simulation.energy().kinetic).epsilon(1e-11));
      CHECK(seen.energies()(i, 1) == Approx(simulation.energy().potential).epsilon(1e-11).margin(1e-12));
    }
  }
}

TEST_CASE("single precision stays near double precision and keeps energy to its own digits") {
  const SharedModel model = shared(own_model("humanoid.urdf", Base::floating));
  Batch fine(model, 20);
  FloatBatch coarse(model, 20);
  CHECK(coarse.lanes() == 2 * fine.lanes());
  start_all(fine, 0.3);
  start_all(coarse, 0.3);
  const auto before = coarse.observe();
  fine.step(200);
  coarse.step(200);
  const auto after = coarse.observe();
  for (std::int64_t i = 0; i < fine.size(); ++i) {
    const Eigen::VectorXd difference = coarse.positions().instance(i).cast<double>() - fine.positions().instance(i);
    CHECK(difference.lpNorm<Eigen::Infinity>() < 1e-4);
    const auto total = [&](const auto& seen) { return static_cast<double>(seen.energies()(i, 0)) + static_cast<double>(seen.energies()(i, 1)); };
    CHECK(std::abs(total(after) - total(before)) < 1e-4 * static_cast<double>(after.energies()(i, 0)));
  }
  CHECK(coarse.summary().frozen == 0);
}

TEST_CASE("thousands of steps taken alone leave nothing behind on their thread") {
  // a tumbling brick with two arms that bounce off their limits, on the ground: each blow is a step alone
  TreeBuilder builder("brick with arms");
  LinkSpec brick;
  brick.name = "brick";
  brick.joint = "base";
  brick.type = JointType::free;
  brick.inertia = {1, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.004, 0.006, 0.008).asDiagonal()};
  builder.add(brick);
  for (const char* const name : {"left", "right"}) {
    LinkSpec arm;
    arm.name = name;
    arm.joint = std::string("to ") + name;
    arm.parent = "brick";
    arm.axis = Eigen::Vector3d::UnitX();
    arm.placement.translation().y() = arm.name == "left" ? 0.15 : -0.15;
    arm.inertia = {0.2, Eigen::Vector3d(0, 0, -0.05), 2e-4 * Eigen::Matrix3d::Identity()};
    builder.add(arm);
  }
  const SharedModel model = shared(builder.build());
  Effects effects;
  effects.limits = {{.row = row_of(*model, "to left"), .lower = -0.05, .upper = 0.05, .restitution = 1},
                    {.row = row_of(*model, "to right"), .lower = -0.3, .upper = 0.3}};
  effects.friction = {{.row = row_of(*model, "to right"), .force = 0.01}};
  effects.ground = Ground{.stiffness = 1e5, .damping = 100, .friction = 0.6};
  for (const double x : {-0.1, 0.1}) {
    for (const double y : {-0.15, 0.15}) {
      for (const double z : {-0.05, 0.05}) effects.ground->contacts.spheres.push_back({.slot = 1, .center = {x, y, z}, .radius = 0});
    }
  }
  std::int64_t rescued = 0;
  const auto start_one = [&](Batch& batch, std::int64_t i, std::int64_t number) {
    const double n = static_cast<double>(number);
    const double turn = 0.1 * n, w = std::cos(turn), z = std::sin(turn);
    std::vector<double> q = model->neutral(), v(static_cast<std::size_t>(model->tree.shape.velocities), 0.0);
    const auto first = static_cast<std::size_t>(model->tree.first_q(1));
    q[first + 2] = 0.3 + 0.01 * n;
    q[first + 3] = z;
    q[first + 6] = w;
    for (std::size_t row = 0; row < v.size(); ++row) v[row] = std::sin(n + static_cast<double>(row));
    v[static_cast<std::size_t>(row_of(*model, "to left"))] = 8;
    batch.reset(i, q, v);
  };
  const auto run = [&](std::int64_t size, int threads, std::int64_t first, const std::vector<std::int64_t>& parts, bool again = false) {
    Batch batch(model, size, {}, effects, {.threads = threads});
    for (std::int64_t i = 0; i < size; ++i) start_one(batch, i, first + i);
    if (again) {
      batch.step(123);
      for (std::int64_t i = 0; i < size; ++i) start_one(batch, i, first + i);
    }
    for (const std::int64_t steps : parts) batch.step(steps);
    CHECK(batch.summary().frozen == 0);
    rescued = batch.summary().rescued;
    const auto seen = batch.observe();
    std::vector<std::string> bytes;
    for (std::int64_t i = 0; i < size; ++i) {
      const Eigen::VectorXd v = seen.velocities().instance(i), e = seen.energies().instance(i);
      bytes.push_back(bytes_of(batch, i) + std::string(reinterpret_cast<const char*>(v.data()), static_cast<std::size_t>(v.size()) * sizeof(double)) +
                      std::string(reinterpret_cast<const char*>(e.data()), static_cast<std::size_t>(e.size()) * sizeof(double)));
    }
    return bytes;
  };
  const std::vector<std::string> reference = run(37, 1, 0, {600});
  CHECK(rescued > 1000);
  for (const int threads : {1, 2, 3}) CHECK(run(37, threads, 0, {600}) == reference);
  CHECK(run(37, 2, 0, std::vector<std::int64_t>(600, 1)) == reference);
  CHECK(run(37, 2, 0, {1, 98, 501}) == reference);
  CHECK(run(37, 2, 0, {600}, true) == reference);
  const std::vector<std::string> shifted = run(20, 2, 11, {600});
  for (std::size_t i = 0; i < shifted.size(); ++i) CHECK(shifted[i] == reference[i + 11]);
}

TEST_CASE("a batch keeps three numbers a degree of freedom and a small record an instance") {
  const SharedModel model = shared(own_model("humanoid.urdf", Base::floating));
  const auto dofs = static_cast<std::size_t>(model->tree.shape.velocities);
  constexpr std::size_t count = 1024, quaternion = 1;
  const BatchOptions lean{.hold_factors = false};
  CHECK(Batch(model, count, {}, {}, lean).bytes() == count * ((3 * dofs + quaternion) * sizeof(double) + sizeof(InstanceRecord)));
  CHECK(FloatBatch(model, count, {}, {}, lean).bytes() == count * ((3 * dofs + quaternion) * sizeof(float) + sizeof(InstanceRecord)));
  CHECK(sizeof(InstanceRecord) <= 48);
}

TEST_CASE("views lead to where the numbers lie") {
  Batch batch(chain(4), 21);
  start_all(batch, 0.5);
  const BatchView<const double> q = batch.positions();
  CHECK(q.rows() == 4);
  CHECK(q.flat().size() % static_cast<std::size_t>(4 * q.lanes()) == 0);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    const InitialState state = random_state(batch.model(), static_cast<std::uint64_t>(i) + 1, 0.5);
    CHECK(&q(i, 2) == q.instance(i).data() + 2 * q.lanes());
    CHECK(q.instance(i) == Eigen::Map<const Eigen::VectorXd>(state.positions.data(), 4));
  }
}

TEST_CASE("what makes no sense for a batch is refused with what was found and expected") {
  const SharedModel model = shared(chain(3));
  const auto with = [](const auto& change) {
    Options options;
    change(options);
    return options;
  };
  CHECK_THROWS_WITH(Batch(model, 0), Catch::Contains("0 instances"));
  CHECK_THROWS_WITH(Batch(model, 4, with([](auto& o) { o.solver = Solver::riqn; })), Catch::Contains("riqn"));
  CHECK_THROWS_WITH(Batch(model, 4, with([](auto& o) { o.guess = FirstGuess::ig3; })), Catch::Contains("ig3"));
  CHECK_THROWS_WITH(Batch(model, 4, with([](auto& o) { o.stop = StopTest::absolute; })), Catch::Contains("absolute"));
  CHECK_THROWS_WITH(Batch(model, 4, {}, {}, {.threads = -1}), Catch::Contains("-1 threads"));
  CHECK_THROWS_AS(Batch(model, 4, with([](auto& o) { o.step = 0; })), InputError);
  Batch batch(model, 4);
  const std::vector<double> three(3, 0.0), two(2, 0.0), broken{0, std::nan(""), 0};
  CHECK_THROWS_WITH(batch.reset(4, three, three), Catch::Contains("no instance 4"));
  CHECK_THROWS_WITH(batch.reset(0, two, three), Catch::Contains("expected 3"));
  CHECK_THROWS_WITH(batch.reset(0, three, broken), Catch::Contains("nan"));
  CHECK_THROWS_WITH(batch.set_inertia(0, 9, {}), Catch::Contains("no body 9"));
  CHECK_THROWS_WITH(batch.set_inertia(0, 1, {-1, 0, 0, 0, 1, 0, 0, 1, 0, 1}), Catch::Contains("no body's"));
  CHECK_THROWS_WITH(batch.set_inertia(0, 1, {1, 1, 0, 0, 1, 0, 0, 0.5, 0, 1}), Catch::Contains("no body's"));
}

TEST_CASE("instructions that this processor or this build has not are refused, and the best there is is named") {
  const Instructions best = best_instructions();
  REQUIRE(available(best));
  REQUIRE(available(Instructions::scalar));
  int refused = 0;
  for (const Instructions one : {Instructions::baseline, Instructions::avx2, Instructions::avx512}) {
    if (available(one)) continue;
    INFO(name(one));
    CHECK_THROWS_WITH(Batch(chain(3), 4, {}, {}, {.instructions = one}),
                      Catch::Contains(fmt::format("no {} instructions", name(one))) && Catch::Contains(std::string(name(best))));
    refused += 1;
  }
  CHECK(refused > 0);  // no build has all sets
}

TEST_CASE("an instance, a body or a row that there is not is refused wherever it is asked for") {
  CHECK_THROWS_WITH(Batch(SharedModel(), 4), Catch::Contains("the pointer to the model is null"));
  Batch batch(chain(3), 5);
  const std::array<double, 10> inertia = batch.inertia(0, 3);
  const auto refuses = [&](const auto& ask, const char* message) { CHECK_THROWS_WITH(ask(), Catch::Contains(message)); };
  for (const bool own_masses : {false, true}) {
    if (own_masses) batch.set_inertia(0, 3, inertia);
    for (const Index slot : {-1, 0, 4, 99'999}) {
      refuses([&] { batch.inertia(0, slot); }, "there is no body");
      refuses([&] { batch.set_inertia(0, slot, inertia); }, "there is no body");
    }
  }
  for (const std::int64_t i : {std::int64_t{-1}, std::int64_t{5}, std::int64_t{99'999}, std::numeric_limits<std::int64_t>::max()}) {
    const char* const message = "they go from 0 to 4";
    refuses([&] { batch.inertia(i, 1); }, message);
    refuses([&] { batch.set_inertia(i, 1, inertia); }, message);
    refuses([&] { batch.record(i); }, message);
    refuses([&] { batch.describe(i); }, message);
    refuses([&] { batch.positions()(i, 0); }, message);
    refuses([&] { batch.momenta().instance(i); }, message);
    refuses([&] { batch.forces()(i, 0); }, message);
    refuses([&] { batch.observe().velocities().instance(i); }, message);
  }
  for (const Index row : {-1, 3}) {
    refuses([&] { batch.positions()(0, row); }, "there is no row");
    refuses([&] { batch.forces()(0, row); }, "there is no row");
    refuses([&] { batch.observe().velocities()(0, row); }, "there is no row");
  }
  refuses([&] { batch.observe().energies()(0, 2); }, "there is no row 2: they go from 0 to 1");
  refuses([&] { batch.servo_targets()(0, 0); }, "there is no row 0: there are none");
  refuses([&] { batch.friction()(0, 0); }, "there is no row 0: there are none");
  CHECK(batch.servo_targets().instance(0).size() == 0);
}

}  // namespace
}  // namespace linden::batch_test
