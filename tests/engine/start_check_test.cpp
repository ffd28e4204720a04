// Starts that no motion leads to: what is told of them, and who refuses them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "engine/initial_state.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "engine/start_check.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/builder.hpp"
#include "models/shapes/contacts_of.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::start_check_test {
namespace {

/// Two hinges, one below the other, and one that follows the first: q = -2 q_first + 0.1.
Model arm(double lower = -1, double upper = 1) {
  TreeBuilder builder("arm");
  const auto hinge = [&](const std::string& name, const std::string& parent) {
    LinkSpec link;
    link.name = name;
    link.parent = parent;
    link.joint = name + "_joint";
    link.placement.translation() = Eigen::Vector3d(0, 0, 0.5);
    link.axis = Eigen::Vector3d::UnitX();
    link.inertia = box_inertia(1, {0.1, 0.1, 0.5}, {0, 0, 0.25});
    return link;
  };
  LinkSpec first = hinge("upper", ""), second = hinge("lower", "upper"), third = hinge("tip", "lower");
  first.limits = second.limits = {lower, upper};
  third.mimic = "upper_joint";
  third.multiplier = -2;
  third.offset = 0.1;
  return builder.add(first).add(second).add(third).build();
}

/// A ball of 1 kg and radius 0.1 m on a free joint.
Model ball() {
  LinkSpec link;
  link.name = "ball";
  link.joint = "base";
  link.type = JointType::free;
  link.inertia = sphere_inertia(1, 0.1, {0, 0, 0});
  link.shapes = {{Pose{}, {ShapeKind::sphere, {0.1}, ""}}};
  return TreeBuilder("ball").add(link).build();
}

Scene ball_at(double height, double stiffness, std::optional<HeightField> terrain = std::nullopt) {
  Scene scene;
  scene.model = ball();
  Ground ground{.stiffness = stiffness, .terrain = std::move(terrain)};
  std::vector<std::string> notes;
  ground.contacts = contacts_of(scene.model, notes);
  scene.effects.ground = ground;
  scene.initial.positions = {0, 0, height, 0, 0, 0, 1};
  return scene;
}

StartFindings findings(const Scene& scene) { return StartCheck(scene.model, scene.options, scene.effects).look(scene.initial.positions); }

/// Rows upper, lower, tip.
Scene arm_at(std::vector<double> positions) {
  Scene scene;
  scene.model = arm();
  scene.effects.limits = {{0, -1, 0.4}, {1, -1, 1}};
  scene.initial.positions = std::move(positions);
  return scene;
}

TEST_CASE("a joint that starts outside its limits is told with its value, its limits and what to write", "[start]") {
  const StartFindings found = findings(arm_at({0.2, 1.5, -0.3}));
  REQUIRE(found.faults.size() == 1);
  CHECK_THAT(found.text(), Contains("joint \"lower_joint\" is at 1.5 rad") && Contains("-1 to 1 rad") &&
                               Contains("initial: {positions: {lower_joint: 1}}") && Contains("start: as given"));
  CHECK(findings(arm_at({0.2, 1, -0.3})).sound());
  CHECK(findings(arm_at({})).sound());
}

TEST_CASE("the position that is advised is the limit to the last digit, and is a start", "[start]") {
  Scene scene = arm_at({0.2, 2, -0.3});
  const double limit = 1.5707963267948966;
  scene.effects.limits = {{1, -1, limit}};
  CHECK_THAT(findings(scene).text(), Contains("{lower_joint: 1.5707963267948966}"));
  scene.initial.positions[1] = limit;
  CHECK(findings(scene).sound());
  CHECK(findings(scene).moved.empty());
}

TEST_CASE("all that is wrong with a start stands in one message", "[start]") {
  const StartFindings found = findings(arm_at({0.7, -1.5, -1.3}));
  CHECK(found.faults.size() == 2);
  CHECK_THAT(found.text(), Contains("upper_joint\" is at 0.7") && Contains("lower_joint\" is at -1.5") &&
                               Contains("{upper_joint: 0.4, lower_joint: -1}"));
}

TEST_CASE("what five written digits put outside is moved onto the limit, with what follows it, and told", "[start]") {
  const StartFindings found = findings(arm_at({0.40003, 0, 0.1 - 2 * 0.40003}));
  REQUIRE(found.sound());
  REQUIRE(found.moved.size() == 1);
  CHECK(found.positions[0] == 0.4);
  CHECK(found.positions[2] == -2 * 0.4 + 0.1);
  CHECK_FALSE(findings(arm_at({0.40005, 0, 0.1 - 2 * 0.40005})).sound());
}

TEST_CASE("a follower that is not where its leader puts it is told with both", "[start]") {
  const StartFindings found = findings(arm_at({0.2, 0, 0.4}));
  REQUIRE(found.faults.size() == 1);
  CHECK_THAT(found.text(), Contains("tip_joint\" is at 0.4") && Contains("upper_joint") && Contains("at -0.3"));
}

TEST_CASE("what lies deeper in the ground than it gives way under the whole weight is told with its depth", "[start]") {
  // 1 kg on 1,000 N/m gives way by 9.8 mm, on 1e5 N/m by less than the millimetre that is allowed
  CHECK(findings(ball_at(0.0905, 1e3)).sound());
  CHECK_FALSE(findings(ball_at(0.0895, 1e3)).sound());
  CHECK(findings(ball_at(0.0995, 1e5)).sound());
  const StartFindings found = findings(ball_at(0.06, 1e5));
  CHECK_THAT(found.text(), Contains("link \"ball\" is 0.04 m deep") && Contains("raise the base by 0.04 m"));
}

TEST_CASE("over a slope the depth straight down counts, and the depth across it is told", "[start]") {
  // 45 degrees: a ball whose centre is a radius above the point below is (1 - cos 45) 0.1 m deep
  const HeightField slope{.columns = 2, .rows = 2, .spacing_x = 20, .spacing_y = 20, .origin_x = -10, .origin_y = -10,
                          .heights = {-10, 10, -10, 10}};
  const StartFindings placed = findings(ball_at(0.1, 1e5, slope));
  CHECK(placed.sound());
  REQUIRE(placed.told.size() == 1);
  CHECK_THAT(placed.told.front(), Contains("0.02929 m"));
  CHECK_FALSE(findings(ball_at(0.09, 1e5, slope)).sound());
  const StartFindings apart = findings(ball_at(0.1415, 1e5, slope));
  CHECK(apart.sound());
  CHECK(apart.told.empty());
}

TEST_CASE("a simulation of a scene refuses a start that is none unless it takes it as given", "[start]") {
  Scene scene = arm_at({0.2, 1.5, -0.3});
  CHECK_THROWS_AS(Simulation(scene), InputError);
  scene.start_as_given = true;
  CHECK(Simulation(scene).positions()[1] == 1.5);
  Simulation simulation(arm_at({0.40003, 0, 0.1 - 2 * 0.40003}));
  CHECK(simulation.positions()[0] == 0.4);
}

TEST_CASE("random starts keep the limits of a scene and leave draws within them as they are", "[start]") {
  const Model model = arm();
  // of the first two joints, narrower than the file's
  Effects effects;
  effects.limits = {{0, -0.2, 0.2}, {1, 0.1, 0.3}};
  const std::vector<JointLimit>& limits = effects.limits;
  int inside = 0, outside = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const InitialState free = random_state(model, seed, 0.5), held = random_state(model, seed, 0.5, limits);
    CHECK(held.velocities == free.velocities);
    for (std::size_t row = 0; row < 2; ++row) {
      const double lower = limits[row].lower, upper = limits[row].upper;
      CHECK(held.positions[row] == std::clamp(free.positions[row], lower, upper));
      (held.positions[row] == free.positions[row] ? inside : outside) += 1;
    }
    const InitialState start{{0.1, 0.2, -0.1}, {0, 0, 0}};
    const InitialState around = random_around(model, start, seed, 0.5, effects);
    for (std::size_t row = 0; row < 2; ++row) CHECK((around.positions[row] >= limits[row].lower && around.positions[row] <= limits[row].upper));
  }
  CHECK(inside > 10);
  CHECK(outside > 10);
}

constexpr const char* kOutside = R"(<robot name="r"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="0.5" upper="1" effort="1" velocity="1"/></joint></robot>)";

TEST_CASE("a scene that leaves a zero outside its limits is refused by every command that moves it, and told what to write", "[start]") {
  Shell shell;
  shell.write("r.urdf", kOutside);
  shell.write("s.yaml", "model: r.urdf\nduration: 0.01\neffects: {gravity: [0, 0, -9.81], limits: urdf}\n");
  shell.write("as_given.yaml", "model: r.urdf\nduration: 0.01\nstart: as given\neffects: {gravity: [0, 0, -9.81], limits: urdf}\n");
  shell.write("named.yaml", "model: r.urdf\nduration: 0.01\ninitial: {positions: {j: 0.5}}\neffects: {gravity: [0, 0, -9.81], limits: urdf}\n");
  for (const std::string command : {"run ", "rollout --instances 2 ", "accuracy --budget 1 "}) {
    const Outcome refused = shell.linden(command + "s.yaml");
    CHECK(refused.exit_code == 2);
    CHECK_THAT(refused.err, Contains("\"j\" is at 0 rad") && Contains("initial: {positions: {j: 0.5}}"));
  }
  for (const std::string start : {"s.yaml --start as-given", "as_given.yaml"}) {
    const Outcome given = shell.linden("run " + start);
    CHECK(given.exit_code == 0);
    CHECK_THAT(given.err, Contains("warning") && Contains("\"j\" is at 0 rad"));
    CHECK(std::ranges::count(given.err, '\n') == 1);
  }
  const Outcome named = shell.linden("run named.yaml");
  CHECK(named.exit_code == 0);
  CHECK(named.err.empty());
  CHECK(shell.linden("run s.yaml --start now").exit_code == 2);
}

TEST_CASE("a model alone whose zero its file excludes runs, with one note", "[start]") {
  Shell shell;
  shell.write("r.urdf", kOutside);
  const Outcome outcome = shell.linden("run r.urdf --duration 0.01");
  CHECK(outcome.exit_code == 0);
  CHECK_THAT(outcome.err, Contains("note") && Contains("\"j\" (0, limits 0.5 to 1 rad)"));
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK(shell.linden("run r.urdf --duration 0.01 --seed 1").err.empty());
}

TEST_CASE("a scene's rounded number is moved onto its limit and told with its line", "[start]") {
  Shell shell;
  shell.write("r.urdf", kOutside);
  const Scene scene = parse_scene("model: r.urdf\ninitial: {positions: {j: 1.00005}}\neffects: {limits: urdf}\n", shell.file("s.yaml"));
  CHECK(scene.initial.positions == std::vector<double>{1});
  REQUIRE(scene.model.warnings.size() == 1);
  CHECK_THAT(scene.model.warnings.front(), Contains("s.yaml:2: initial: joint \"j\"") && Contains("moved onto it"));
}

TEST_CASE("springs, servos or a ground without gravity hint at it once, unless its absence was said", "[start]") {
  Shell shell;
  shell.write("none.yaml", "model: chain:2\nduration: 0.01\neffects: {spring: {joint1: {stiffness: 1}}}\n");
  shell.write("zero.yaml", "model: chain:2\nduration: 0.01\neffects: {gravity: [0, 0, 0], spring: {joint1: {stiffness: 1}}}\n");
  shell.write("bare.yaml", "model: chain:2\nduration: 0.01\ninitial: {velocities: {joint1: 1}}\n");
  CHECK_THAT(shell.linden("run none.yaml").err, Contains("springs and no gravity: name it under effects"));
  CHECK(shell.linden("run none.yaml --gravity 0,0,0").err.empty());
  CHECK(shell.linden("run none.yaml --gravity 0,0,-9.81").err.empty());
  CHECK(shell.linden("run zero.yaml").err.empty());
  CHECK(shell.linden("run bare.yaml").err.empty());
}

TEST_CASE("a scene in which nothing moves is told so, and no step is advised for it", "[start]") {
  Shell shell;
  shell.write("still.yaml", "model: chain:2\nduration: 0.05\n");
  CHECK_THAT(shell.linden("run still.yaml").out, Contains("nothing moves"));
  const Outcome outcome = shell.linden("accuracy still.yaml --budget 2");
  CHECK_THAT(outcome.out, Contains("nothing moves") && !Contains("for an error of"));
  shell.write("moving.yaml", "model: chain:2\nduration: 0.05\ninitial: {velocities: {joint1: 1e-6}}\n");
  CHECK_THAT(shell.linden("run moving.yaml").out, !Contains("nothing moves"));
}

TEST_CASE("a rollout tells how many of its instances random joints put in the ground", "[start]") {
  Shell shell;
  // a level leg of a metre whose foot is a ball
  shell.write("leg.urdf", R"(<robot name="leg"><link name="base"/><link name="leg"><inertial><origin xyz="0.5 0 0"/><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry>
</collision></link><joint name="hip" type="continuous"><parent link="base"/><child link="leg"/><axis xyz="0 1 0"/></joint></robot>)");
  shell.write("s.yaml", "model: leg.urdf\nduration: 0.002\neffects: {gravity: [0, 0, -9.81], ground: {height: -0.15}}\n");
  // 0.05 m of room: a turn of more than 0.05 rad downwards
  CHECK_THAT(shell.linden("rollout s.yaml --instances 40 --spread 0.3").err, Contains("of 40 instances start") && Contains("link \"leg\""));
  CHECK(shell.linden("rollout s.yaml --instances 40 --spread 0.04").err.empty());
}

}  // namespace
}  // namespace linden::start_check_test
