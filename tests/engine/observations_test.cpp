// Observations: what a list of names comes to, alone and in a batch.
#include "engine/queries/observations.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "engine/batch.hpp"
#include "engine/queries/centre_of_mass.hpp"
#include "engine/queries/imu.hpp"
#include "engine/queries/link_motion.hpp"
#include "models/build/builder.hpp"
#include "models/shapes/contacts_of.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::observations_test {
namespace {

using Numbers = std::vector<double>;

Contacts touching(const Model& model) {
  std::vector<std::string> notes;
  return contacts_of(model, notes);
}

/// A humanoid over the ground, with a servo at every joint.
struct Stage {
  Model model = load_urdf(model_file("humanoid.urdf"), Base::floating);
  Effects effects = acting(model);
  Options options{.step = 1e-3};

  static Effects acting(const Model& model) {
    Effects effects;
    effects.servos = servo_everywhere(model, 100, 5);
    effects.damping = damping_everywhere(model, 0.2);
    effects.ground = Ground{.height = -1.0, .stiffness = 2e4, .damping = 50, .contacts = touching(model)};
    return effects;
  }
  std::vector<std::string> links() const {
    std::vector<std::string> names;
    for (const auto& [name, place] : model.names.link) names.push_back(name);
    std::ranges::sort(names);
    return names;
  }
};

std::vector<std::string> everything(const Stage& stage) {
  std::vector<std::string> names{"q", "v", "a", "targets", "time", "energy", "com", "com_velocity", "momentum"};
  for (const std::string& link : stage.links()) {
    for (const char* kind : {"pose", "position", "quaternion", "twist", "acceleration", "imu", "contact"}) {
      names.push_back(fmt::format("{}:{}", kind, link));
    }
  }
  return names;
}

void expect(const Observations& seen, const Numbers& row, const std::string& name, const Numbers& expected, double tolerance = 1e-12) {
  const Observed& entry = seen.at(name);
  INFO(name);
  REQUIRE(entry.width == static_cast<Index>(expected.size()));
  REQUIRE(entry.rows.size() == expected.size());
  double scale = 1;
  for (const double number : expected) scale = std::max(scale, std::abs(number));
  for (std::size_t k = 0; k < expected.size(); ++k) {
    CHECK(std::abs(row[static_cast<std::size_t>(entry.offset) + k] - expected[k]) <= tolerance * scale);
  }
}

Numbers joined(std::span<const double> a, std::span<const double> b) {
  Numbers both(a.begin(), a.end());
  both.insert(both.end(), b.begin(), b.end());
  return both;
}
Numbers joined(const SpatialMotion& V) { return joined(V.angular, V.linear); }

}  // namespace

TEST_CASE("every observation of a simulation is the answer to its question", "[observations]") {
  const Stage stage;
  Simulation simulation(stage.model, stage.options, stage.effects);
  random_start(simulation, 3, 0.3);
  Observations seen(stage.model, simulation.effects(), everything(stage));
  Numbers row(static_cast<std::size_t>(seen.width()), NAN);
  for (int round = 0; round < 3; ++round) {
    run(simulation, 40);
    seen.observe(simulation, row);
    CHECK(std::ranges::all_of(row, [](double x) { return std::isfinite(x); }));
    const Kinematics now(simulation);
    const auto copy = [](std::span<const double> rows) { return Numbers(rows.begin(), rows.end()); };
    expect(seen, row, "q", copy(simulation.positions()), 0);
    expect(seen, row, "v", simulation.velocities(), 0);
    expect(seen, row, "a", simulation.accelerations(), 0);
    CHECK(std::ranges::any_of(simulation.accelerations(), [](double a) { return a != 0; }));
    expect(seen, row, "targets", Numbers(stage.effects.servos.size(), 0.0), 0);
    expect(seen, row, "time", {simulation.time()}, 0);
    const Energy energy = simulation.energy();
    expect(seen, row, "energy", {energy.kinetic, energy.potential}, 0);
    const CentreOfMass centre = centre_of_mass(now);
    expect(seen, row, "com", copy(centre.position));
    expect(seen, row, "com_velocity", copy(centre.velocity));
    const Momentum momentum = total_momentum(now);
    expect(seen, row, "momentum", joined(momentum.angular, momentum.linear));
    for (const auto& [name, link] : stage.model.names.link) {
      const std::array<double, 7> pose = position_and_quaternion(link_pose(now, link));
      expect(seen, row, "pose:" + name, copy(pose));
      expect(seen, row, "position:" + name, copy(std::span(pose).first(3)));
      expect(seen, row, "quaternion:" + name, copy(std::span(pose).last(4)));
      expect(seen, row, "twist:" + name, joined(link_twist(now, link)));
      expect(seen, row, "acceleration:" + name, joined(link_acceleration(now, link)));
      const ImuReading reading = imu(now, link);
      expect(seen, row, "imu:" + name, joined(reading.angular_velocity, reading.specific_force));
    }
  }
}

TEST_CASE("what is observed of a joint are its rows", "[observations]") {
  const Stage stage;
  Simulation simulation(stage.model, stage.options, stage.effects);
  random_start(simulation, 3, 0.3);
  Numbers targets(stage.effects.servos.size());
  for (std::size_t k = 0; k < targets.size(); ++k) targets[k] = 0.01 * static_cast<double>(k);
  simulation.set_servo_targets(targets);
  const Tree& tree = stage.model.tree;
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const std::string joint = stage.model.names.joint[static_cast<std::size_t>(i)];
    Observations seen(stage.model, stage.effects, {"q:" + joint, "v:" + joint});
    REQUIRE(seen.width() == position_count(tree.kind(i)) + velocity_count(tree.kind(i)));
    Numbers row(static_cast<std::size_t>(seen.width()));
    seen.observe(simulation, row);
    for (Index k = 0; k < seen.layout()[0].width; ++k) {
      CHECK(row[static_cast<std::size_t>(k)] == simulation.positions()[static_cast<std::size_t>(tree.first_q(i) + k)]);
      CHECK(seen.layout()[0].rows[static_cast<std::size_t>(k)] ==
            stage.model.names.position[static_cast<std::size_t>(tree.first_q(i) + k)]);
    }
    CHECK(row[static_cast<std::size_t>(seen.layout()[1].offset)] == simulation.velocities()[static_cast<std::size_t>(tree.first_v(i))]);
    const auto servo = std::ranges::find(stage.effects.servos, tree.first_v(i), &Servo::row);
    if (servo == stage.effects.servos.end()) continue;
    Observations target(stage.model, stage.effects, {"target:" + joint});
    Numbers one(1);
    target.observe(simulation, one);
    CHECK(one[0] == targets[static_cast<std::size_t>(servo - stage.effects.servos.begin())]);
  }
}

TEST_CASE("a body that rests on the ground is seen to press on it with its weight", "[observations]") {
  LinkSpec link;
  link.name = "box";
  link.joint = "root";
  link.type = JointType::free;
  link.inertia = {5, Eigen::Vector3d::Zero(), 0.1 * Eigen::Matrix3d::Identity()};
  CollisionShape shape;
  shape.kind = ShapeKind::box;
  shape.size = {0.4, 0.4, 0.2};
  link.shapes = {{Pose{}, shape}};
  const Model model = TreeBuilder("box").add(link).build();
  Effects effects;
  effects.ground = Ground{.height = 0.3, .stiffness = 1e4, .damping = 100, .contacts = touching(model)};
  Simulation simulation(model, {.step = 1e-3}, effects);
  simulation.set_positions(Numbers{0, 0, 0.401, 0, 0, 0, 1});
  Observations seen(model, effects, {"contact:box", "imu:box"});
  Numbers row(8);
  seen.observe(simulation, row);
  CHECK((row[0] == 0 && row[1] == 0));
  run(simulation, 2000);
  seen.observe(simulation, row);
  CHECK(row[0] == 4);
  CHECK(std::abs(row[1] - 5 * 9.81) < 1e-6);
  CHECK(std::abs(row[7] - 9.81) < 1e-6);
}

TEST_CASE("a batch sees what simulations see, with any instructions and any number of threads", "[observations]") {
  const Stage stage;
  const std::vector<std::string> names = everything(stage);
  const std::int64_t size = 11;
  Numbers first;
  for (const Instructions instructions : {Instructions::scalar, Instructions::baseline, Instructions::avx2, Instructions::avx512}) {
    if (!available(instructions)) continue;
    for (const int threads : {1, 3}) {
      Batch batch(stage.model, size, stage.options, stage.effects, {.threads = threads, .instructions = instructions});
      const auto start = [&](std::int64_t i) { return random_state(stage.model, static_cast<std::uint64_t>(i + 1), 0.3); };
      for (std::int64_t i = 0; i < size; ++i) batch.reset(i, start(i).positions, start(i).velocities);
      batch.servo_targets()(4, 2) = 0.25;
      batch.step(60);
      Observations seen(stage.model, stage.effects, names);
      const auto width = static_cast<std::size_t>(seen.width());
      Numbers rows(static_cast<std::size_t>(size) * width, NAN);
      batch.observe(seen, rows);
      if (instructions == Instructions::scalar && threads == 1) first = rows;
      if (instructions == Instructions::scalar) {
        CHECK(std::ranges::equal(rows, first, {}, std::bit_cast<std::uint64_t, double>, std::bit_cast<std::uint64_t, double>));
      }
      CHECK(rows[4 * width + static_cast<std::size_t>(seen.at("targets").offset) + 2] == 0.25);
      CHECK(rows[3 * width + static_cast<std::size_t>(seen.at("targets").offset) + 2] == 0);
      std::vector<float> short_rows(rows.size());
      batch.observe(seen, short_rows);
      for (std::size_t k = 0; k < rows.size(); ++k) REQUIRE(short_rows[k] == static_cast<float>(rows[k]));
      // an instance's positions and velocities, put into a state of their own, answer for the rest
      for (std::int64_t i = 0; i < size; i += 5) {
        const Numbers row(rows.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(i) * width),
                          rows.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(i + 1) * width));
        const auto part = [&](const char* name) {
          return std::span(row).subspan(static_cast<std::size_t>(seen.at(name).offset), static_cast<std::size_t>(seen.at(name).width));
        };
        const Kinematics now(stage.model, part("q"), part("v"), part("a"));
        for (const std::string& name : {std::string("pelvis"), stage.links().back()}) {
          const LinkPlace& link = place_of(stage.model, name);
          const std::array<double, 7> pose = position_and_quaternion(link_pose(now, link));
          expect(seen, row, "pose:" + name, Numbers(pose.begin(), pose.end()));
          expect(seen, row, "twist:" + name, joined(link_twist(now, link)));
          const ImuReading reading = imu(now, link);
          expect(seen, row, "imu:" + name, joined(reading.angular_velocity, reading.specific_force));
        }
        const CentreOfMass centre = centre_of_mass(now);
        expect(seen, row, "com", Numbers(centre.position.begin(), centre.position.end()));
        expect(seen, row, "com_velocity", Numbers(centre.velocity.begin(), centre.velocity.end()));
        expect(seen, row, "time", {0.06});
        // and is that of a simulation from the same start, to the solver's tolerance; accelerations to the eleven bits that are kept of
        // them
        Simulation simulation(stage.model, stage.options, stage.effects);
        simulation.set_positions(start(i).positions);
        simulation.set_velocities(start(i).velocities);
        Numbers targets(stage.effects.servos.size(), 0.0);
        if (i == 4) targets[2] = 0.25;
        simulation.set_servo_targets(targets);
        run(simulation, 60);
        Numbers alone(width);
        seen.observe(simulation, alone);
        for (const char* name : {"q", "v", "energy", "momentum"}) {
          expect(seen, row, name, Numbers(alone.begin() + seen.at(name).offset, alone.begin() + seen.at(name).offset + seen.at(name).width),
                 1e-6);
        }
        expect(seen, row, "a", Numbers(alone.begin() + seen.at("a").offset, alone.begin() + seen.at("a").offset + seen.at("a").width),
               1e-3);
      }
    }
  }
}

TEST_CASE("instances with masses of their own have centres of mass of their own", "[observations]") {
  const Model model = chain(4);
  Batch batch(model, 5);
  std::array<double, 10> heavy = batch.inertia(3, 4);
  for (double& number : heavy) number *= 10;
  batch.set_inertia(3, 4, heavy);
  Observations seen(model, {}, {"com"});
  Numbers rows(15);
  batch.observe(seen, rows);
  const Numbers others(rows.begin(), rows.begin() + 3);
  CHECK(Numbers(rows.begin() + 12, rows.end()) == others);
  Model weighted = model;
  for (int k = 0; k < 10; ++k) weighted.constants.inertia(4, k) = heavy[static_cast<std::size_t>(k)];
  const CentreOfMass expected = centre_of_mass(Kinematics(weighted));
  for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(rows[9 + k] - expected.position[k]) < 1e-14);
  CHECK(std::abs(rows[9] - others[0]) > 1e-3);
}

TEST_CASE("single precision sees what it can, and says what it cannot", "[observations]") {
  const Stage stage;
  FloatBatch batch(stage.model, 3, stage.options, stage.effects);
  batch.step(20);
  Observations seen(stage.model, stage.effects, {"q", "v", "pose:pelvis", "com"});
  std::vector<float> rows(static_cast<std::size_t>(3 * seen.width()));
  batch.observe(seen, rows);
  const Numbers q(rows.begin(), rows.begin() + stage.model.tree.shape.positions);
  const std::array<double, 7> pose = position_and_quaternion(link_pose(Kinematics(stage.model, q), place_of(stage.model, "pelvis")));
  for (std::size_t k = 0; k < 7; ++k) CHECK(std::abs(rows[static_cast<std::size_t>(seen.at("pose:pelvis").offset) + k] - pose[k]) < 1e-5);
  const Observations accelerated(stage.model, stage.effects, {"imu:pelvis"});
  std::vector<float> six(18);
  CHECK_THROWS_WITH(batch.observe(accelerated, six), Catch::Contains("single precision"));
  const Batch fourth(chain(2), 2, {.order = 4});
  Numbers rates(4);
  CHECK_THROWS_WITH(fourth.observe(Observations(fourth.model(), {}, {"a"}), rates), Catch::Contains("order 2"));
}

TEST_CASE("names that are not known, and room that does not fit, are told with what was expected", "[observations]") {
  const Stage stage;
  const auto made = [&](const std::vector<std::string>& names) { return Observations(stage.model, stage.effects, names); };
  CHECK_THROWS_WITH(made({"posi"}), Catch::Contains("\"posi\" is not known") && Catch::Contains("com_velocity"));
  CHECK_THROWS_WITH(made({"twst:pelvis"}), Catch::Contains("did you mean twist?"));
  CHECK_THROWS_WITH(made({"pose:pelviss"}), Catch::Contains("observation \"pose:pelviss\"") && Catch::Contains("did you mean \"pelvis\"?"));
  CHECK_THROWS_WITH(made({"pose"}), Catch::Contains("of which link?"));
  CHECK_THROWS_WITH(made({"target"}), Catch::Contains("of which joint?"));
  CHECK_THROWS_WITH(made({"com:pelvis"}), Catch::Contains("com is of the whole state"));
  CHECK_THROWS_WITH(made({"q", "q"}), Catch::Contains("twice"));
  CHECK_THROWS_WITH(made({"q:nothing"}), Catch::Contains("no joint \"nothing\" moves"));
  CHECK_THROWS_WITH(Observations(stage.model, {}, {"contact:pelvis"}), Catch::Contains("no ground"));
  CHECK_THROWS_WITH(Observations(stage.model, {}, {"targets"}), Catch::Contains("no servo"));
  Observations seen = made({"q", "pose:pelvis"});
  CHECK_THROWS_WITH(seen.at("pose:pelvi"), Catch::Contains("did you mean pose:pelvis?"));
  Simulation simulation(stage.model, stage.options, stage.effects);
  Numbers row(3);
  CHECK_THROWS_WITH(seen.observe(simulation, row), Catch::Contains("room for 3 numbers given"));
  const Batch batch(stage.model, 2, stage.options, stage.effects);
  CHECK_THROWS_WITH(batch.observe(seen, row), Catch::Contains("2 x") && Catch::Contains("room for 3"));
  Simulation other(chain(3));
  Numbers room(static_cast<std::size_t>(seen.width()));
  CHECK_THROWS_WITH(seen.observe(other, room), Catch::Contains("another model"));
}

}  // namespace linden::observations_test
