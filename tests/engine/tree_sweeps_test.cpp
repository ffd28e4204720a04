// One large tree, branch by branch.
#include "engine/sweeps/tree_sweeps.hpp"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <memory>

#include "kernels/values/joints.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::tree_sweeps_test {
namespace {

/// The same bodies in the same slots, gone through level by level to the end and back.
Model in_one_piece(Model model) {
  model.tree.trunk = all_slots(model.tree);
  model.tree.branches.clear();
  return model;
}

struct End {
  std::vector<double> positions, velocities;
};

End after_steps(const Model& model, const Options& options, int steps, double spread = 0.3) {
  Simulation simulation(model, options);
  random_start(simulation, 3, spread);
  run(simulation, steps);
  const auto copy = [](std::span<const double> numbers) { return std::vector<double>(numbers.begin(), numbers.end()); };
  return {copy(simulation.positions()), copy(simulation.velocities())};
}

TEST_CASE("steps branch by branch are those of whole sweeps, to rounding") {
  // Which bodies are at the end of a stretch, and so go one by one, is another matter: compilers contract their products otherwise. Masses over
  // six decades make 2e-11 of that where four bodies go at once, less where eight do.
  for (const Model& model : {balanced_tree(5000), random_tree({.bodies = 3000, .seed = 1}), humanoids(60), chain(2000)}) {
    INFO(model.names.model);
    REQUIRE_FALSE(model.tree.branches.empty());
    const End branches = after_steps(model, {.step = 1e-3}, 8), whole = after_steps(in_one_piece(model), {.step = 1e-3}, 8);
    CHECK(distance(branches.positions, whole.positions) < 1e-10);
    CHECK(distance(branches.velocities, whole.velocities) < 1e-7);
  }
}

TEST_CASE("branches that share rows leave what a step needs that takes no correction, several, or fails") {
  const Model model = balanced_tree(4000), piece = in_one_piece(model);
  const auto same = [&](const Options& options, int steps, double spread) {
    const End branches = after_steps(model, options, steps, spread), whole = after_steps(piece, options, steps, spread);
    CHECK(distance(branches.positions, whole.positions) < 1e-10);
    CHECK(distance(branches.velocities, whole.velocities) < 1e-7);
  };
  SECTION("no correction") {
    const Options options{.step = 1e-4, .tolerance = 1e-4};
    Simulation simulation(model, options);
    random_start(simulation, 3, 0.1);
    run(simulation, 10);
    REQUIRE(simulation.step().evaluations == 1);
    same(options, 12, 0.1);
  }
  SECTION("several, to the floor that rounding sets") {
    const Options options{.step = 1e-3, .tolerance = 1e-18};
    Simulation simulation(model, options);
    random_start(simulation, 3, 0.3);
    const StepReport report = simulation.step();
    REQUIRE(report.ok());
    REQUIRE(report.at_rounding_floor);
    REQUIRE(report.evaluations > 2);
    same(options, 5, 0.3);
  }
  SECTION("failure") {
    Simulation branches(model, {.step = 1}), whole(piece, {.step = 1});
    for (Simulation* simulation : {&branches, &whole}) random_start(*simulation, 3, 20);
    const std::vector<double> before(branches.positions().begin(), branches.positions().end());
    const StepReport report = branches.step(), other = whole.step();
    REQUIRE_FALSE(report.ok());
    CHECK(report.status == other.status);
    CHECK(report.slot == other.slot);
    CHECK(distance(branches.positions(), before) == 0);
  }
}

TEST_CASE("the number of threads does not change a bit") {
  const oneapi::tbb::global_control allowed(oneapi::tbb::global_control::max_allowed_parallelism, 8);
  for (const Model& model : {balanced_tree(20'000), balanced_tree(9000, 7), random_tree({.bodies = 8000, .seed = 1})}) {
    INFO(model.names.model);
    REQUIRE(model.tree.branches_apart);
    struct Ran {
      std::unique_ptr<Simulation> simulation;
      StepsReport report;
    };
    const auto ran_by = [&](int threads) {
      oneapi::tbb::task_arena arena(threads);
      Ran ran;
      arena.execute([&] {
        ran.simulation = std::make_unique<Simulation>(model, Options{.step = 1e-3});
        random_start(*ran.simulation, 3, 0.3);
        ran.report = ran.simulation->run(12);
        ran.simulation->energy();
        ran.report.add(ran.simulation->step());
      });
      REQUIRE(ran.report.ok());
      return ran;
    };
    const Ran expected = ran_by(1);
    for (const int threads : {2, 3, 8}) {
      CAPTURE(threads);
      const Ran found = ran_by(threads);
      CHECK(std::ranges::equal(found.simulation->positions(), expected.simulation->positions()));
      CHECK(std::ranges::equal(found.simulation->momenta(), expected.simulation->momenta()));
      CHECK(found.simulation->energy().total() == expected.simulation->energy().total());
      CHECK(found.report.largest_residual == expected.report.largest_residual);
      CHECK(found.report.evaluations == expected.report.evaluations);
    }
  }
}

TEST_CASE("the order of bodies does not matter to their motion but for rounding") {
  // one crowd is sorted in pieces; the other, one humanoid at a time, is not
  constexpr Index count = 40;
  const Model crowd = humanoids(count), one = humanoids(1);
  REQUIRE_FALSE(crowd.tree.branches.empty());
  REQUIRE(one.tree.branches.empty());
  Simulation together(crowd, {.step = 1e-3}), alone(one, {.step = 1e-3});
  const auto row_in = [](const Model& model, const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(model.names.velocity, name) - model.names.velocity.begin());
  };
  std::vector<double> rates(crowd.names.velocity.size(), 0.0), rates_of_one(one.names.velocity.size(), 0.0);
  const char* const joints[] = {"left_shoulder_pitch", "right_hip_roll", "torso", "neck_yaw"};
  for (const char* joint : joints) {
    rates_of_one[row_in(one, fmt::format("{}1_joint", joint))] = 2;
    for (Index k = 1; k <= count; ++k) rates[row_in(crowd, fmt::format("{}{}_joint", joint, k))] = 2;
  }
  together.set_velocities(rates);
  alone.set_velocities(rates_of_one);
  run(together, 50);
  run(alone, 50);
  double worst = 0;
  for (Index k = 1; k <= count; ++k) {
    for (std::size_t row = 0; row < rates_of_one.size(); ++row) {
      std::string name = one.names.velocity[row];
      name.replace(name.find('1'), 1, std::to_string(k));
      worst = std::max(worst, std::abs(together.velocities()[row_in(crowd, name)] - alone.velocities()[row]));
    }
  }
  CHECK(worst < 1e-8);
}

}  // namespace
}  // namespace linden::tree_sweeps_test
