#include "engine/scene/scene_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/scene/scene_yaml.hpp"
#include "engine/simulation.hpp"
#include "models/build/generators.hpp"
#include "models/build/isometry.hpp"
#include "models/build/random.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/command_line.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::scene_file_test {
namespace {

const std::string kScenes = LINDEN_MODELS_DIR "/scenes/";
const std::string kArm = "model: " LINDEN_MODELS_DIR "/arm.urdf\n";
const std::string kHand = "model: " LINDEN_MODELS_DIR "/hand.urdf\n";
const std::string kHumanoid = "model: " LINDEN_MODELS_DIR "/humanoid.urdf\nbase: floating\n";

Scene scene(const std::string& text) { return parse_scene(text, "s.yaml"); }
Effects effects(const std::string& model, const std::string& text) { return scene(model + "effects:\n" + text).effects; }

double position(const Scene& s, const std::string& name) {
  const auto found = std::ranges::find(s.model.names.position, name);
  REQUIRE(found != s.model.names.position.end());
  return s.initial.positions[static_cast<std::size_t>(found - s.model.names.position.begin())];
}

double velocity(const Scene& s, const std::string& name) {
  const auto found = std::ranges::find(s.model.names.velocity, name);
  REQUIRE(found != s.model.names.velocity.end());
  return s.initial.velocities[static_cast<std::size_t>(found - s.model.names.velocity.begin())];
}

std::string message(const std::string& text) {
  try {
    scene(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

/// The message begins with the line, is one line of three parts at least, and holds all that is expected.
void check_message(const std::string& text, int line, const std::vector<std::string>& expected) {
  INFO(text);
  const std::string found = message(text);
  CHECK_THAT(found, StartsWith(fmt::format("s.yaml:{}: ", line)));
  CHECK(std::ranges::count(found, '\n') == 0);
  CHECK(std::ranges::count(found, ';') >= 2);
  for (const std::string& part : expected) CHECK_THAT(found, Contains(part));
}

template <class Entry>
const Entry& at_row(const std::vector<Entry>& list, Index row) {
  const auto found = std::ranges::find_if(list, [&](const Entry& entry) { return entry.row == row; });
  REQUIRE(found != list.end());
  return *found;
}

}  // namespace

TEST_CASE("a scene of a model alone is the model at rest without gravity", "[scene]") {
  const Scene s = scene("model: chain:3\n");
  CHECK(s.model.hash() == chain(3).hash());
  CHECK(s.options.gravity == std::array<double, 3>{0, 0, 0});
  CHECK(s.options.step == Options().step);
  CHECK(s.duration == 10);
  CHECK(s.initial.positions == s.model.neutral());
  CHECK(s.initial.velocities == std::vector<double>(3, 0.0));
  CHECK(s.effects.damping.empty());
  CHECK_FALSE(s.effects.ground);
  CHECK(s.model.warnings.empty());
}

TEST_CASE("every option of a scene reaches its value", "[scene]") {
  const Scene s = scene(
      "model: chain:3\nstep: 2e-3\nduration: 4.5\nsolver: riqn\norder: 2\nguess: ig2\ntolerance: 1e-8\nstop: absolute\n"
      "max_iterations: 77\nmax_splits: 3\neffects: {gravity: [1, -2, 3.5]}\n");
  CHECK(s.options.step == 2e-3);
  CHECK(s.duration == 4.5);
  CHECK(s.options.solver == Solver::riqn);
  CHECK(s.options.guess == FirstGuess::ig2);
  CHECK(s.options.tolerance == 1e-8);
  CHECK(s.options.stop == StopTest::absolute);
  CHECK(s.options.max_iterations == 77);
  CHECK(s.options.max_splits == 3);
  CHECK(s.options.gravity == std::array<double, 3>{1, -2, 3.5});
}

TEST_CASE("models are found beside the scene, and float where it says so", "[scene]") {
  const Folder folder;
  std::filesystem::create_directory(folder / "robots");
  std::filesystem::copy_file(LINDEN_MODELS_DIR "/arm.urdf", folder / "robots/arm.urdf");
  folder.write("a.yaml", "model: robots/arm.urdf\n");
  folder.write("b.yml", "model: robots/arm.urdf\nbase: floating\n");
  CHECK(load_scene(folder.file("a.yaml")).model.hash() == load_urdf(LINDEN_MODELS_DIR "/arm.urdf").hash());
  CHECK(load_scene(folder.file("b.yml")).model.hash() == load_urdf(LINDEN_MODELS_DIR "/arm.urdf", Base::floating).hash());
}

TEST_CASE("the start of a scene is where it says", "[scene]") {
  const Scene s =
      scene(kHumanoid +
            "initial:\n"
            "  base: {position: [1, 2, 3], rotation: [0.1, 0.2, 0.3], velocity: [0, 0, 5], angular_velocity: [1, 0, 0]}\n"
            "  positions: {left_knee_pitch: 0.4}\n"
            "  velocities: {neck_yaw: -2}\n");
  CHECK(position(s, "base.x") == 1);
  CHECK(position(s, "base.y") == 2);
  CHECK(position(s, "base.z") == 3);
  const Eigen::Quaterniond turn(position(s, "base.qw"), position(s, "base.qx"), position(s, "base.qy"), position(s, "base.qz"));
  const Eigen::Quaterniond expected = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  CHECK(turn.angularDistance(expected) < 1e-14);
  const Eigen::Vector3d v(velocity(s, "base.vx"), velocity(s, "base.vy"), velocity(s, "base.vz"));
  const Eigen::Vector3d w(velocity(s, "base.wx"), velocity(s, "base.wy"), velocity(s, "base.wz"));
  CHECK((turn * v).isApprox(Eigen::Vector3d(0, 0, 5), 1e-14));
  CHECK((turn * w).isApprox(Eigen::Vector3d(1, 0, 0), 1e-14));
  CHECK(position(s, "left_knee_pitch") == 0.4);
  CHECK(velocity(s, "neck_yaw") == -2);
  CHECK(position(s, "right_knee_pitch") == 0);

  const Scene q = scene(kHumanoid + "initial: {base: {quaternion: [0, 0, 3, 3]}}\n");
  CHECK(position(q, "base.qz") == Approx(std::sqrt(0.5)));
  CHECK(position(q, "base.qw") == Approx(std::sqrt(0.5)));
}

TEST_CASE("ball joints start from quaternions, followers follow", "[scene]") {
  const Scene s = scene("model: ball-chain:2\ninitial: {positions: {joint2: [0, 1, 0, 0]}, velocities: {joint1: [1, 2, 3]}}\n");
  CHECK(position(s, "joint2.qy") == 1);
  CHECK(position(s, "joint2.qw") == 0);
  CHECK(position(s, "joint1.qw") == 1);
  CHECK(velocity(s, "joint1.wz") == 3);

  const Model hand = load_urdf(LINDEN_MODELS_DIR "/hand.urdf");
  REQUIRE_FALSE(hand.mimics.empty());
  const Mimic& mimic = hand.mimics.front();
  const std::string leader = hand.names.joint[static_cast<std::size_t>(mimic.leader_slot)];
  const std::string follower = hand.names.joint[static_cast<std::size_t>(mimic.follower_slot)];
  const Scene h = scene(fmt::format("{}initial: {{positions: {{{}: 0.25}}}}\n", kHand, leader));
  CHECK(position(h, follower) == mimic.multiplier * 0.25 + mimic.offset);
  check_message(fmt::format("{}initial: {{positions: {{{}: 0.25}}}}\n", kHand, follower), 2, {"follows another", leader});
}

TEST_CASE("a random start is that of the same seed, and what is named goes over it", "[scene]") {
  const Model arm = load_urdf(LINDEN_MODELS_DIR "/arm.urdf");
  const InitialState expected = random_state(arm, 7, 0.3);
  const Scene s = scene(kArm + "initial: {seed: 7, spread: 0.3}\n");
  CHECK(s.initial.positions == expected.positions);
  CHECK(s.initial.velocities == expected.velocities);
  const Scene over = scene(kArm + "initial: {seed: 7, spread: 0.3, positions: {joint_2: 1}}\n");
  CHECK(position(over, "joint_2") == 1);
  CHECK(position(over, "joint_3") == expected.positions[2]);
  const Scene given = parse_scene(kArm + "initial: {seed: 7, spread: 0.3}\n", "s.yaml", {.seed = 9, .spread = std::nullopt});
  CHECK(given.initial.positions == random_state(arm, 9, 0.3).positions);
  CHECK(parse_scene(kArm, "s.yaml", {.seed = 9, .spread = 0.2}).initial.positions == random_state(arm, 9, 0.2).positions);
}

TEST_CASE("armature, damping and friction come from the file, for all joints, or by name", "[scene]") {
  const Model arm = load_urdf(LINDEN_MODELS_DIR "/arm.urdf");
  const Effects urdf = effects(kArm, "  damping: urdf\n  friction: urdf\n");
  REQUIRE(urdf.damping.size() == 7);
  for (const JointDamping& entry : urdf.damping) CHECK(entry.coefficient == arm.attributes.damping(entry.row));
  REQUIRE(urdf.friction.size() == 7);
  for (const JointFriction& entry : urdf.friction) CHECK(entry.force == arm.attributes.friction(entry.row));

  const Effects all = effects(kArm, "  damping: 2\n  friction: 3\n  armature: 0.5\n");
  CHECK(all.damping.size() == 7);
  CHECK(at_row(all.damping, 6).coefficient == 2);
  CHECK(all.friction.size() == 7);
  CHECK(at_row(all.friction, 0).force == 3);
  CHECK(all.armature.size() == 7);
  CHECK(at_row(all.armature, 3).inertia == 0.5);

  const Effects named = effects(kArm, "  damping: {joint_2: 4}\n  friction: {joint_3: 5}\n  armature: {joint_4: 6}\n");
  REQUIRE((named.damping.size() == 1 && named.friction.size() == 1 && named.armature.size() == 1));
  CHECK(named.damping[0].row == row_of(arm, "joint_2"));
  CHECK(named.damping[0].coefficient == 4);
  CHECK(named.friction[0].row == row_of(arm, "joint_3"));
  CHECK(named.armature[0].row == row_of(arm, "joint_4"));

  // a free base takes none, a ball joint three rows
  CHECK(effects(kHumanoid, "  damping: 1\n").damping.size() == 34);
  CHECK(effects("model: ball-chain:2\n", "  damping: {joint2: 1}\n").damping.size() == 3);
  CHECK(effects("model: ball-chain:2\n", "  damping: 1\n").damping.size() == 6);
}

TEST_CASE("springs know screws and ball joints", "[scene]") {
  const Effects arm = effects(kArm, "  spring:\n    joint_2: {stiffness: 50, rest: 0.2}\n    joint_3: {stiffness: 60}\n");
  REQUIRE(arm.springs.size() == 2);
  CHECK(arm.springs[0].row == 1);
  CHECK(arm.springs[0].stiffness == 50);
  CHECK(arm.springs[0].rest == 0.2);
  CHECK(arm.springs[1].rest == 0);
  const Effects ball = effects("model: ball-chain:2\n", "  spring: {joint2: {stiffness: 5, rest: [2, 0, 0, 0]}}\n");
  REQUIRE(ball.ball_springs.size() == 1);
  CHECK(ball.ball_springs[0].slot == 2);
  CHECK(ball.ball_springs[0].stiffness == 5);
  CHECK(ball.ball_springs[0].rest == std::array<double, 4>{1, 0, 0, 0});
}

TEST_CASE("limits come from the file, bounce, or are given by name", "[scene]") {
  const Model arm = load_urdf(LINDEN_MODELS_DIR "/arm.urdf");
  for (const char* text : {"  limits: urdf\n", "  limits: {restitution: 0.4}\n"}) {
    const Effects all = effects(kArm, text);
    REQUIRE(all.limits.size() == 7);
    for (const JointLimit& entry : all.limits) {
      CHECK(entry.lower == arm.attributes.lower(entry.row));
      CHECK(entry.upper == arm.attributes.upper(entry.row));
      CHECK(entry.restitution == (std::string(text).ends_with("urdf\n") ? 0 : 0.4));
    }
  }
  const Effects named = effects(kArm,
                                "  limits:\n    restitution: 0.2\n    joint_2: {lower: -0.5, upper: 0.25}\n    joint_3: urdf\n   "
                                " joint_4: {upper: 1, restitution: 1}\n");
  REQUIRE(named.limits.size() == 3);
  CHECK(named.limits[0].lower == -0.5);
  CHECK(named.limits[0].upper == 0.25);
  CHECK(named.limits[0].restitution == 0.2);
  CHECK(named.limits[1].lower == arm.attributes.lower(2));
  CHECK(named.limits[2].lower == arm.attributes.lower(3));
  CHECK(named.limits[2].upper == 1);
  CHECK(named.limits[2].restitution == 1);
  const Effects half = effects("model: chain:2\n", "  limits: {joint1: {lower: -1}}\n");
  CHECK(half.limits[0].upper == std::numeric_limits<double>::infinity());
}

TEST_CASE("limits of velocity come from the file, for all or by name", "[scene]") {
  const double none = std::numeric_limits<double>::infinity();
  const Model arm = load_urdf(std::string(LINDEN_MODELS_DIR) + "/arm.urdf");
  for (const JointLimit& entry : effects(kArm, "  limits: urdf\n").limits) CHECK(entry.velocity == none);
  const Effects all = effects(kArm, "  limits: {velocity: urdf, restitution: 0.4}\n");
  REQUIRE(all.limits.size() == 7);
  for (const JointLimit& entry : all.limits) {
    CHECK(std::isfinite(entry.velocity));
    CHECK(entry.velocity == arm.attributes.max_velocity(entry.row));
    CHECK(entry.lower == arm.attributes.lower(entry.row));
    CHECK(entry.restitution == 0.4);
  }
  const Effects same = effects(kArm, "  limits: {velocity: 0.25, restitution: 0.4}\n");
  REQUIRE(same.limits.size() == 7);
  for (const JointLimit& entry : same.limits) {
    CHECK(entry.velocity == 0.25);
    CHECK(entry.upper == arm.attributes.upper(entry.row));
    CHECK(entry.restitution == 0.4);
  }
  const Effects named = effects(kArm,
                                "  limits:\n    velocity: 3\n    joint_1: urdf\n    joint_2: {velocity: urdf}\n    joint_3: {lower: 0}\n"
                                "    joint_4: {velocity: 0.5, upper: 2}\n");
  REQUIRE(named.limits.size() == 4);
  CHECK(named.limits[0].velocity == 3);
  CHECK(named.limits[1].velocity == arm.attributes.max_velocity(1));
  CHECK(named.limits[2].velocity == 3);
  CHECK(named.limits[3].velocity == 0.5);
  CHECK(named.limits[3].upper == 2);
  // a joint without any in its file
  const Effects chained = effects("model: chain:3\n", "  limits: {joint2: {velocity: 2}}\n");
  REQUIRE(chained.limits.size() == 1);
  CHECK(chained.limits[0].lower == -none);
  CHECK(effects("model: chain:3\n", "  limits: {velocity: 2}\n").limits.size() == 3);
}

TEST_CASE("servos take targets, their velocities and feed-forward forces over time", "[scene]") {
  const Folder folder;
  folder.write("way.csv", "time,angle\n0,0.5\n1,0.75\n2.5,-1\n");
  folder.write("scene.yaml", "model: " LINDEN_MODELS_DIR
                             "/arm.urdf\neffects:\n  servo:\n    stiffness: 200\n    damping: 20\n"
                             "    targets: {joint_1: way.csv, joint_2: {times: [0, 1], values: [0, 3]}, joint_3: 0.5}\n"
                             "    velocities: {joint_2: 3, joint_4: {times: [0, 1, 1], values: [0, 1, 0]}}\n"
                             "    feedforward: {joint_1: way.csv, joint_5: -2}\n"
                             "    joints:\n      joint_6:\n        target: way.csv\n        target_velocity: 1\n"
                             "        feedforward: {times: [1, 2], values: [3, 4]}\n");
  const std::vector<Servo> servos = load_scene(folder.file("scene.yaml")).effects.servos;
  REQUIRE(servos.size() == 7);
  CHECK(servos[0].target_over_time.times == std::vector<double>{0, 1, 2.5});
  CHECK(servos[0].target_over_time.values == std::vector<double>{0.5, 0.75, -1});
  CHECK(servos[0].feedforward.values == std::vector<double>{0.5, 0.75, -1});
  CHECK(servos[1].target_at(0.5) == 1.5);
  CHECK(servos[1].target_velocity.at(7) == 3);
  CHECK_FALSE(servos[2].target_moves());
  CHECK(servos[2].target == 0.5);
  CHECK(servos[2].target_velocity.at(1) == 0);
  CHECK(servos[3].target_velocity.values == std::vector<double>{0, 1, 0});
  CHECK(servos[4].feedforward.at(0) == -2);
  CHECK(servos[5].target_at(1) == 0.75);
  CHECK(servos[5].target_velocity.at(0) == 1);
  CHECK(servos[5].feedforward.at(1.5) == 3.5);
  // a force alone is enough
  const Effects pushed = effects(kArm, "  servo: {joints: {joint_1: {stiffness: 0, feedforward: 2}, joint_2: {stiffness: 0}}}\n");
  REQUIRE(pushed.servos.size() == 1);
  CHECK(pushed.servos[0].feedforward.at(0) == 2);
}

TEST_CASE("servos hold the start, as strong as the motors are", "[scene]") {
  const Model arm = load_urdf(LINDEN_MODELS_DIR "/arm.urdf");
  const std::string start = kArm + "initial: {positions: {joint_2: 0.7, joint_5: -0.3}}\n";
  const Effects all = effects(start, "  servo: {stiffness: 200, damping: 20, targets: {joint_5: 0.1}}\n");
  REQUIRE(all.servos.size() == 7);
  for (const Servo& servo : all.servos) {
    CHECK(servo.stiffness == 200);
    CHECK(servo.damping == 20);
    CHECK(servo.max_force == arm.attributes.max_effort(servo.row));
    CHECK(servo.target == (servo.row == 1 ? 0.7 : servo.row == 4 ? 0.1 : 0));
  }
  const Effects own = effects(
      kArm,
      "  servo: {stiffness: 200, max_force: 9, joints: {joint_3: {stiffness: 5, damping: 1, target: 2, max_force: none}}}\n");
  REQUIRE(own.servos.size() == 7);
  CHECK(own.servos[0].max_force == 9);
  CHECK(own.servos[2].stiffness == 5);
  CHECK(own.servos[2].damping == 1);
  CHECK(own.servos[2].target == 2);
  CHECK(own.servos[2].max_force == std::numeric_limits<double>::infinity());

  const Effects some = effects(kArm, "  servo: {stiffness: 200, joints: [joint_3, joint_1], targets: {joint_1: 0.5}}\n");
  REQUIRE(some.servos.size() == 2);
  CHECK(some.servos[0].row == 0);
  CHECK(some.servos[0].target == 0.5);
  CHECK(some.servos[1].row == 2);
  const Effects alone = effects(kArm, "  servo: {damping: 3, joints: {joint_6: {stiffness: 8}}}\n");
  REQUIRE(alone.servos.size() == 1);
  CHECK(alone.servos[0].row == 5);
  CHECK(alone.servos[0].stiffness == 8);
  CHECK(alone.servos[0].damping == 3);
  CHECK(effects(kArm, "  servo: {stiffness: 1, joints: {joint_6: {stiffness: 0}}}\n").servos.size() == 6);
  // followers have none of their own
  const Model hand = load_urdf(LINDEN_MODELS_DIR "/hand.urdf");
  CHECK(effects(kHand, "  servo: {stiffness: 1}\n").servos.size() == static_cast<std::size_t>(hand.degrees_of_freedom()));
}

TEST_CASE("motions are numbers, tables or files; their joints start there and have neither friction nor limits", "[scene]") {
  ScratchFolder folder;
  folder.write("way.csv", "time,position\n0.5,0.2\n1,0.4\n");
  folder.write("s.yaml", kArm + "effects:\n  friction: 0.1\n  limits: urdf\n"
               "  motion: {joint_1: 0.3, joint_2: way.csv, joint_3: {times: [0, 1], values: [0.5, -0.5]}}\n");
  const Scene read = load_scene(folder.file("s.yaml"));
  REQUIRE(read.effects.motions.size() == 3);
  CHECK(read.effects.motions[1].position.times == std::vector<double>{0.5, 1});
  Simulation simulation(read);
  CHECK(std::ranges::equal(simulation.positions().first(3), std::vector<double>{0.3, 0.2, 0.5}));
  CHECK(simulation.velocities()[2] == Approx(-1));
  for (const JointMotion& motion : read.effects.motions) {
    CHECK(std::ranges::find(read.effects.friction, motion.row, &JointFriction::row) == read.effects.friction.end());
    CHECK(std::ranges::find(read.effects.limits, motion.row, &JointLimit::row) == read.effects.limits.end());
  }
  CHECK(read.effects.friction.size() == read.model.names.velocity.size() - 3);
  REQUIRE(std::ranges::any_of(read.model.warnings, [](const std::string& warning) {
    return warning.find("effects.friction: left out where the motion is given (3 joints)") != std::string::npos;
  }));
  check_message(kArm + "effects:\n  limits: urdf\n  motion: {joint_1: {times: [0, 2], values: [0, 7]}}\n", 4,
                {"effects.motion leads \"joint_1\" to 7 at 2 s, beyond its limits"});
  folder.write("fast.csv", "0,0,1\n1,1,1\n");
  folder.write("fast.yaml", kArm + "effects:\n  motion: {joint_1: fast.csv, joint_2: {times: [0, 1], values: [0, 0], velocities: [4, -4]}}\n");
  const Scene fast = load_scene(folder.file("fast.yaml"));
  CHECK(fast.effects.motions[0].velocities == std::vector<double>{1, 1});
  CHECK(fast.initial.velocities[1] == Approx(4));
  check_message(kArm + "effects:\n  limits: urdf\n  motion: {joint_1: {times: [0, 1], values: [0, 0], velocities: [40, -40]}}\n", 4,
                {"effects.motion leads \"joint_1\" to 10 at 0.5 s, beyond its limits"});
  check_message(kArm + "effects:\n  motion: {joint_1: {times: [0, 1], values: [0, 7], velocities: [1]}}\n", 3, {"2 times and 1 velocities"});
  check_message(kArm + "effects:\n  motion: {joint_1: {times: [0, 0], values: [0, 7]}}\n", 3, {"at two places at 0 s"});
  check_message(kArm + "initial: {positions: {joint_1: 1}}\neffects: {motion: {joint_1: 0}}\n", 2, {"the motion of joint \"joint_1\" is given"});
}

TEST_CASE("torques are numbers, tables or files", "[scene]") {
  const Folder folder;
  folder.write("push.csv", "time,torque\n# comment\n0, 0\n\n1.5,2\r\n2,-1e-1\n");
  folder.write("marked.csv", "\xEF\xBB\xBF" "0, 3\n1, 4\n");
  folder.write("marked.yaml", "model: chain:1\neffects: {torque: {joint1: marked.csv}}\n");
  CHECK(load_scene(folder.file("marked.yaml")).effects.torques[0].force.at(0) == 3);
  folder.write("s.yaml",
               "model: chain:3\neffects:\n  torque: {joint1: 4, joint2: push.csv, joint3: {times: [0, 1], values: [5, 6]}}\n");
  const std::vector<JointTorque> torques = load_scene(folder.file("s.yaml")).effects.torques;
  REQUIRE(torques.size() == 3);
  CHECK(torques[0].force.at(7) == 4);
  CHECK(torques[1].force.times == std::vector<double>{0, 1.5, 2});
  CHECK(torques[1].force.values == std::vector<double>{0, 2, -0.1});
  CHECK(torques[2].force.at(0.5) == 5.5);
}

TEST_CASE("a wrench acts where its link is, behind fixed joints too", "[scene]") {
  const Folder folder;
  folder.write("gust.csv", "0,1\n1,3\n");
  folder.write("s.yaml",
               "model: " LINDEN_MODELS_DIR
               "/arm.urdf\n"
               "effects:\n"
               "  wrench:\n"
               "    tool_flange: {force: [1, 2, 3], moment: [4, 5, 6], point: [0.1, 0.2, 0.3], frame: body, from: 1, to: 1.5}\n"
               "    link_3:\n"
               "      - {force: [7, 8, 9]}\n"
               "      - {moment: [1, 0, 0], frame: world, file: gust.csv}\n");
  const Scene s = load_scene(folder.file("s.yaml"));
  const std::vector<BodyWrench>& wrenches = s.effects.wrenches;
  REQUIRE(wrenches.size() == 3);
  const LinkPlace flange = s.model.names.link.at("tool_flange");
  const Isometry in_body = isometry(flange.in_body);
  const Eigen::Vector3d point = in_body * Eigen::Vector3d(0.1, 0.2, 0.3),
                        force = in_body.linear() * Eigen::Vector3d(1, 2, 3),
                        moment = in_body.linear() * Eigen::Vector3d(4, 5, 6);
  CHECK(wrenches[0].slot == flange.slot);
  CHECK_FALSE(wrenches[0].in_world);
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    CHECK(wrenches[0].point[at] == point[k]);
    CHECK(wrenches[0].force[at] == force[k]);
    CHECK(wrenches[0].moment[at] == moment[k]);
  }
  CHECK(wrenches[0].from == 1);
  CHECK(wrenches[0].to == 1.5);
  CHECK(wrenches[1].slot == s.model.names.link.at("link_3").slot);
  CHECK(wrenches[1].in_world);
  CHECK(wrenches[1].force == std::array<double, 3>{7, 8, 9});
  CHECK(wrenches[1].scale.at(3) == 1);
  CHECK(wrenches[1].to == std::numeric_limits<double>::infinity());
  CHECK(wrenches[2].moment == std::array<double, 3>{1, 0, 0});
  CHECK(wrenches[2].scale.at(0.5) == 2);
}

TEST_CASE("drag acts on all bodies or on some", "[scene]") {
  const Effects all =
      effects(kArm, "  drag: {linear: 0.1, quadratic: 0.2, wind: [2, 0, 1], bodies: {tool_flange: {linear: 5}}}\n");
  REQUIRE(all.drag.size() == 7);
  CHECK(all.drag[0].linear == 0.1);
  CHECK(all.drag[0].quadratic == 0.2);
  CHECK(all.drag[6].linear == 5);
  CHECK(all.drag[6].quadratic == 0);
  CHECK(all.wind == std::array<double, 3>{2, 0, 1});
  const Effects some = effects(kArm, "  drag: {bodies: {link_2: {quadratic: 3}}}\n");
  REQUIRE(some.drag.size() == 1);
  CHECK(some.drag[0].slot == 2);
  CHECK(some.drag[0].quadratic == 3);
}

TEST_CASE("the ground is a plane, tilted or with heights", "[scene]") {
  const Folder folder;
  folder.write("heights.csv", "0,1,2\n3,4,5\n");
  folder.write(
      "s.yaml",
      "model: chain:2\neffects:\n  ground:\n    normal: [0, 3, 4]\n    height: 0.5\n    stiffness: 2e5\n    damping: 10\n"
      "    friction: 0.6\n    terrain: {file: heights.csv, spacing: [0.1, 0.2], origin: [-1, -2]}\n");
  const Effects e = load_scene(folder.file("s.yaml")).effects;
  REQUIRE(e.ground);
  CHECK(e.ground->normal == std::array<double, 3>{0, 0.6, 0.8});
  CHECK(e.ground->height == 0.5);
  CHECK(e.ground->stiffness == 2e5);
  CHECK(e.ground->damping == 10);
  CHECK(e.ground->friction == 0.6);
  REQUIRE(e.ground->terrain);
  CHECK(e.ground->terrain->columns == 3);
  CHECK(e.ground->terrain->rows == 2);
  CHECK(e.ground->terrain->spacing_x == 0.1);
  CHECK(e.ground->terrain->spacing_y == 0.2);
  CHECK(e.ground->terrain->origin_x == -1);
  CHECK(e.ground->terrain->origin_y == -2);
  CHECK(e.ground->terrain->heights == std::vector<double>{0, 1, 2, 3, 4, 5});
  const Effects plain = effects("model: humanoids:2\n", "  ground:\n");
  REQUIRE(plain.ground);
  CHECK(plain.ground->contacts.spheres.size() == 2 * 8 * 15);  // of 31 bodies 16 are the small ones between two hinges
  CHECK(plain.ground->stiffness == Ground().stiffness);
  CHECK(plain.ground->normal == std::array<double, 3>{0, 0, 1});
}

TEST_CASE("several models are one system, placed and named", "[scene]") {
  const std::string text =
      "models:\n"
      "  - {model: " LINDEN_MODELS_DIR
      "/arm.urdf, name: left, position: [0, 1, 0]}\n"
      "  - {model: " LINDEN_MODELS_DIR
      "/humanoid.urdf, base: floating, position: [2, 0, 1], rotation: [0, 0, 0.5], velocity: [1, 0, 0]}\n"
      "  - {model: chain:3, quaternion: [0, 0, 1, 0]}\n"
      "initial: {positions: {left/joint_2: 0.5, 'chain:3/joint1': 0.25}}\n"
      "effects: {damping: {humanoid/neck_yaw: 2}}\n";
  const Scene s = scene(text);
  CHECK(s.model.names.model == "s");
  CHECK(s.model.tree.bodies() == 7 + 35 + 3);
  CHECK(position(s, "left/joint_2") == 0.5);
  CHECK(position(s, "chain:3/joint1") == 0.25);
  CHECK(position(s, "humanoid/base.x") == 2);
  CHECK(position(s, "humanoid/base.z") == 1);
  CHECK(position(s, "humanoid/base.qz") == Approx(std::sin(0.25)));
  CHECK(velocity(s, "humanoid/base.vx") == Approx(std::cos(0.5)));
  CHECK(velocity(s, "humanoid/base.vy") == Approx(-std::sin(0.5)));
  CHECK(s.effects.damping.at(0).row == row_of(s.model, "humanoid/neck_yaw"));
  CHECK(s.model.names.link.at("left/base_link").in_body.shift[1] == 1);
}

TEST_CASE("models in one scene move as each alone", "[scene]") {
  const std::string rest = "effects: {gravity: [0, 0, -9.81]}\n";
  const std::string arm = std::string(LINDEN_MODELS_DIR) + "/arm.urdf", hand = std::string(LINDEN_MODELS_DIR) + "/hand.urdf";
  const Scene both =
      scene("models:\n  - {model: " + arm + ", name: a}\n  - {model: " + hand +
            ", name: h, base: floating}\n  - {model: 'chain:12', name: c}\n" +
            "initial: {positions: {a/joint_2: 0.8, a/joint_4: -1, c/joint3: 0.5}, velocities: {a/joint_1: 2}}\n" + rest);
  const Scene alone[] = {
      scene("model: " + arm + "\ninitial: {positions: {joint_2: 0.8, joint_4: -1}, velocities: {joint_1: 2}}\n" + rest),
      scene("model: " + hand + "\nbase: floating\n" + rest),
      scene("model: chain:12\ninitial: {positions: {joint3: 0.5}}\n" + rest)};
  Simulation whole(both);
  std::vector<Simulation> parts;
  for (const Scene& s : alone) parts.emplace_back(s);
  const auto energies = [&] {
    double sum = 0;
    for (Simulation& part : parts) sum += part.energy().total();
    return sum;
  };
  CHECK(whole.energy().total() == Approx(energies()).epsilon(1e-12));
  run(whole, 200);
  for (Simulation& part : parts) run(part, 200);
  CHECK(whole.energy().total() == Approx(energies()).epsilon(1e-9));
  const std::string prefixes[] = {"a/", "h/", "c/"};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::vector<std::string>& names = parts[k].model().names.position;
    for (std::size_t row = 0; row < names.size(); ++row) {
      INFO(prefixes[k] + names[row]);
      const auto found = std::ranges::find(both.model.names.position, prefixes[k] + names[row]);
      REQUIRE(found != both.model.names.position.end());
      const auto at = static_cast<std::size_t>(found - both.model.names.position.begin());
      CHECK(whole.positions()[at] == Approx(parts[k].positions()[row]).margin(1e-8));
    }
  }
}

TEST_CASE("a placed model moves as the world turned about it would have it", "[scene]") {
  // turned a half about x, gravity points the other way
  const Scene turned = scene(
      "models:\n  - {model: 'chain:5', rotation: [3.141592653589793, 0, 0], position: [4, 5, 6]}\neffects: {gravity: [0, 0, "
      "9.81]}\n");
  const Scene plain = scene("model: chain:5\neffects: {gravity: [0, 0, -9.81]}\n");
  Simulation a(turned), b(plain);
  run(a, 100);
  run(b, 100);
  CHECK(distance(a.positions(), b.positions()) < 1e-9);
  CHECK(std::abs(b.positions()[0]) > 1e-3);
}

TEST_CASE("a simulation of a scene starts where the scene does", "[scene]") {
  const Scene s = scene("model: chain:3\nstep: 2e-3\ninitial: {positions: {joint1: 0.5}, velocities: {joint2: 1}}\n");
  Simulation simulation(s);
  CHECK(simulation.positions()[0] == 0.5);
  CHECK(simulation.velocities()[1] == Approx(1));
  CHECK(simulation.options().step == 2e-3);
  Scene empty{.model = chain(2), .options = {}, .initial = {}, .effects = {}};
  CHECK(Simulation(empty).positions()[0] == 0);
}

TEST_CASE("unknown keys are refused with the nearest one", "[scene]") {
  check_message("model: chain:3\nstepp: 1e-3\n", 2, {"the key \"stepp\" is not known", "did you mean step?"});
  check_message("model: chain:3\ngravity: [0, 0, 1]\n", 2, {"the key \"gravity\"", "write it below effects"});
  check_message("model: chain:3\nxyzzy: 1\n", 2, {"the key \"xyzzy\"", "expected model, models", "leave it out"});
  check_message("model: chain:3\neffects:\n  gravty: [0, 0, 1]\n", 3, {"the key \"gravty\" of effects", "did you mean gravity?"});
  check_message("model: chain:3\neffects:\n\n  spring:\n    joint1:\n      stifness: 4\n", 6,
                {"effects.spring.joint1", "did you mean stiffness?"});
  check_message(kArm + "effects:\n  servo: {stiffness: 1, target: {}}\n", 3, {"did you mean targets?"});
  check_message(kArm + "effects:\n  servo: {joints: {joint_1: {stifness: 1}}}\n", 3, {"did you mean stiffness?"});
  check_message(kArm + "effects:\n  limits: {joint_1: {min: 1}}\n", 3, {"the key \"min\""});
  check_message(kArm + "effects:\n  ground: {frction: 1}\n", 3, {"did you mean friction?"});
  check_message(kArm + "effects:\n  ground: {terrain: {fil: a}}\n", 3, {"did you mean file?"});
  check_message(kArm + "effects:\n  drag: {linea: 1}\n", 3, {"did you mean linear?"});
  check_message(kArm + "effects:\n  wrench: {link_1: {froce: 1}}\n", 3, {"did you mean force?"});
  check_message(kArm + "effects:\n  torque: {joint_1: {time: 1}}\n", 3, {"did you mean times?"});
  check_message(kHumanoid + "initial: {base: {positon: 1}}\n", 3, {"did you mean position?"});
  check_message(kHumanoid + "initial:\n  position: {}\n", 4, {"did you mean positions?"});
  check_message("models: [{modl: chain:3}]\n", 1, {"the key \"modl\" of models[0]", "did you mean model?"});
}

TEST_CASE("unknown joints and links are refused with the nearest one", "[scene]") {
  for (const char* effect :
       {"armature: {joint_22: 1}", "damping: {joint_22: 1}", "friction: {joint_22: 1}", "spring: {joint_22: {stiffness: 1}}",
        "limits: {joint_22: urdf}", "servo: {stiffness: 1, joints: [joint_22]}", "servo: {stiffness: 1, targets: {joint_22: 1}}",
        "servo: {joints: {joint_22: {stiffness: 1}}}", "torque: {joint_22: 1}", "motion: {joint_22: 1}"}) {
    check_message(kArm + "effects:\n  gravity: [0, 0, 1]\n  " + effect + "\n", 4,
                  {"no joint \"joint_22\" moves", "did you mean \"joint_2\"?"});
  }
  for (const char* effect : {"wrench: {link_33: {force: [0, 0, 1]}}", "drag: {bodies: {link_33: {linear: 1}}}"}) {
    check_message(kArm + "effects:\n  " + effect + "\n", 3, {"no link \"link_33\"", "did you mean \"link_3\"?"});
  }
  check_message(kArm + "initial:\n  positions:\n    joint_22: 1\n", 4,
                {"no joint \"joint_22\" moves", "did you mean \"joint_2\"?"});
  check_message(kArm + "effects: {wrench: {base_link: {force: [0, 0, 1]}}}\n", 2, {"\"base_link\" is fixed to the world"});
  check_message(kArm + "effects: {torque: {tool_flange_fixed: 1}}\n", 2, {"no joint \"tool_flange_fixed\" moves"});
}

TEST_CASE("names of any length are cut in messages", "[scene]") {
  const std::string name(900, 'x');  // YAML allows keys of 1,024
  for (const std::string& text :
       {name + ": 1\n", "effects: {damping: {" + name + ": 1}}\n", "effects: {wrench: {\"a\\n" + name + "\": [1]}}\n",
        "initial: {positions: {" + name + ": 1}}\n", "solver: " + name + "\n"}) {
    check_message("model: chain:3\n" + text, 2, {"xxx..."});
    CHECK(message("model: chain:3\n" + text).size() < 500);
  }
}

TEST_CASE("joints that cannot have an effect are refused by name", "[scene]") {
  for (const char* effect : {"armature: {base: 1}", "damping: {base: 1}", "friction: {base: 1}", "spring: {base: {stiffness: 1}}",
                             "limits: {base: urdf}", "servo: {stiffness: 1, joints: [base]}", "torque: {base: 1}", "motion: {base: 1}"}) {
    check_message(kHumanoid + "effects:\n  " + effect + "\n", 4, {"\"base\" is a free joint"});
  }
  for (const char* effect : {"armature: {joint2: 1}", "friction: {joint2: 1}", "limits: {joint2: {lower: 1}}",
                             "servo: {stiffness: 1, joints: [joint2]}", "torque: {joint2: 1}", "motion: {joint2: 1}"}) {
    check_message(std::string("model: ball-chain:2\neffects:\n  ") + effect + "\n", 3, {"\"joint2\" is a ball joint"});
  }
  const Model hand = load_urdf(LINDEN_MODELS_DIR "/hand.urdf");
  const std::string leader = hand.names.joint[static_cast<std::size_t>(hand.mimics.front().leader_slot)];
  const std::string follower = hand.names.joint[static_cast<std::size_t>(hand.mimics.front().follower_slot)];
  for (const std::string effect : {"spring: {JOINT: {stiffness: 1}}", "servo: {stiffness: 1, joints: [JOINT]}",
                                   "torque: {JOINT: 1}", "motion: {JOINT: 1}", "servo: {stiffness: 1, targets: {JOINT: 1}}"}) {
    std::string text = effect;
    text.replace(text.find("JOINT"), 5, follower);
    check_message(kHand + "effects:\n  " + text + "\n", 3, {fmt::format("\"{}\" follows another", follower), leader});
  }
}

TEST_CASE("values that make no sense are refused where they stand", "[scene]") {
  const auto refused = [](const std::string& text, const std::vector<std::string>& expected) {
    check_message("model: chain:3\n" + text, 2, expected);
  };
  refused("step: 0\n", {"step is \"0\"", "above zero"});
  refused("step: -1e-3\n", {"above zero"});
  refused("step: nan\n", {"step is \"nan\"", "a finite number"});
  refused("step: .inf\n", {"a finite number"});
  refused("step: 1ms\n", {"step is \"1ms\""});
  refused("step: [1]\n", {"step is a list of 1"});
  refused("step: {a: 1}\n", {"step is a map"});
  refused("step:\n", {"step is nothing"});
  refused("duration: 0\n", {"above zero"});
  refused("tolerance: -1\n", {"above zero"});
  refused("order: 5\n", {"2, 4, 6 or 8"});
  refused("solver: newtn\n", {"expected one of newton, riqn", "did you mean newton?"});
  refused("guess: ig7\n", {"one of extrapolation, ig1"});
  refused("stop: [a]\n", {"one of energy, absolute"});
  refused("max_splits: 21\n", {"a whole number from 0 to 20"});
  refused("max_iterations: 1.5\n", {"a whole number"});
  refused("base: floating\n", {"chain:3 is generated"});
  refused("initial: 3\n", {"a map of base"});
  refused("initial: {seed: -1}\n", {"zero or more"});
  refused("initial: {seed: 0.5}\n", {"a whole number"});
  refused("initial: {spread: -1}\n", {"zero or more"});
  refused("initial: {base: {}}\n", {"no floating base"});
  refused("initial: {positions: [1]}\n", {"a map of joints"});
  refused("initial: {positions: {joint1: [1]}}\n", {"a finite number"});
  refused("effects: [1]\n", {"effects is a list of 1"});
  refused("effects: {gravity: -9.81}\n", {"effects.gravity is \"-9.81\"", "[x, y, z]"});
  refused("effects: {gravity: [0, 0]}\n", {"a list of 2"});
  refused("effects: {gravity: [0, 0, x]}\n", {"effects.gravity[2] is \"x\""});
  refused("effects: {armature: urdf}\n", {"URDF files say nothing of armature"});
  refused("effects: {armature: -1}\n", {"zero or more"});
  refused("effects: {damping: udrf}\n", {"expected urdf, a number or {joint: number}"});
  refused("effects: {damping: {joint1: -1}}\n", {"effects.damping.joint1 is \"-1\"", "zero or more"});
  refused("effects: {friction: {joint1: x}}\n", {"effects.friction.joint1"});
  refused("effects: {spring: {joint1: {rest: 1}}}\n", {"has no stiffness"});
  refused("effects: {spring: {joint1: 5}}\n", {"effects.spring.joint1 is \"5\""});
  refused("effects: {limits: {restitution: 2}}\n", {"from 0 to 1"});
  refused("effects: {limits: {joint1: {lower: 1, upper: 0}}}\n", {"goes from 1 to 0"});
  refused("effects: {limits: {joint1: urdf}}\n", {"has no limit"});
  refused("effects: {limits: yes}\n", {"urdf, {restitution: number, velocity: urdf or number}"});
  refused("effects: {servo: {damping: 1}}\n", {"has no stiffness"});
  refused("effects: {servo: {joints: {joint1: {damping: 1}}}}\n", {"effects.servo.joints.joint1 has no stiffness"});
  refused("effects: {servo: {stiffness: 1, joints: [joint1, joint1]}}\n", {"every joint once"});
  refused("effects: {servo: {stiffness: 1, joints: [joint1], targets: {joint2: 1}}}\n", {"\"joint2\" has no servo"});
  refused("effects: {servo: {stiffness: 1, joints: {joint1: {target: 1}}, targets: {joint1: 1}}}\n", {"one target a joint"});
  refused("effects: {servo: {stiffness: 1, max_force: lots}}\n", {"urdf, none or a number"});
  refused("effects: {servo: {stiffness: 1, targets: {joint1: soon}}}\n", {"effects.servo.targets.joint1 is \"soon\"", "FILE.csv"});
  refused("effects: {servo: {stiffness: 1, targets: {joint1: none.csv}}}\n", {"none.csv"});
  refused("effects: {servo: {stiffness: 1, velocities: {joint1: {times: [1, 0], values: [1, 2]}}}}\n", {"time 0 s comes after 1 s"});
  refused("effects: {servo: {stiffness: 1, feedforward: {joint1: {times: [1]}}}}\n", {"effects.servo.feedforward.joint1 has no values"});
  refused("effects: {servo: {stiffness: 1, feed_forward: {joint1: 1}}}\n", {"did you mean feedforward?"});
  refused("effects: {servo: {stiffness: 1, joints: {joint1: {target_velocty: 1}}}}\n", {"did you mean target_velocity?"});
  refused("effects: {servo: {stiffness: 1, joints: {joint1: {target_velocity: 1}}, velocities: {joint1: 1}}}\n",
          {"one target_velocity a joint"});
  refused("effects: {servo: {stiffness: 1, joints: [joint1], feedforward: {joint2: 1}}}\n", {"\"joint2\" has no servo"});
  refused("effects: {limits: {velocity: -1}}\n", {"effects.limits.velocity is \"-1\"; expected zero or more"});
  refused("effects: {limits: {velocity: fast}}\n", {"urdf or a number"});
  refused("effects: {limits: {joint1: {velocity: urdf}}}\n", {"the model's file limits no velocity of \"joint1\""});
  refused("effects: {limits: {joint1: {velocty: 1}}}\n", {"did you mean velocity?"});
  refused("effects: {servo: {stiffness: -1}}\n", {"zero or more"});
  refused("effects: {torque: {joint1: much}}\n", {"a number, FILE.csv or {times, values}"});
  refused("effects: {torque: {joint1: none.csv}}\n", {"none.csv: there is no such file"});
  refused("effects: {torque: {joint1: {times: [0]}}}\n", {"has no values"});
  refused("effects: {torque: {joint1: {times: [0, 1], values: [1]}}}\n", {"2 times and 1 values"});
  refused("effects: {torque: {joint1: {times: [1, 0], values: [1, 2]}}}\n", {"time 0 s comes after 1 s"});
  refused("effects: {wrench: {link1: {point: [0, 0, 1]}}}\n", {"neither force nor moment"});
  refused("effects: {wrench: {link1: {force: [0, 0, 1], frame: link}}}\n", {"one of world, body"});
  refused("effects: {wrench: {link1: {force: [0, 0, 1], from: 2, to: 1}}}\n", {"from 2 to 1"});
  refused("effects: {drag: {linear: -1}}\n", {"zero or more"});
  refused("effects: {ground: {normal: [0, 0, 0]}}\n", {"has no direction"});
  refused("effects: {ground: {stiffness: 0}}\n", {"above zero"});
  refused("effects: {ground: {terrain: {spacing: [1, 1]}}}\n", {"has no file"});
  refused("effects: {ground: {terrain: {file: a.csv, spacing: [1, 0]}}}\n", {"two numbers above zero"});
  check_message("model: ball-chain:1\ninitial: {positions: {joint1: [0, 0, 0, 0]}}\n", 2, {"length 0", "unit quaternion"});
  check_message("step: 2\nduration: 1\nmodel: chain:3\n", 1, {"less than a step"});
  refused("initial: {spread: 1.7e308}\n", {"the position \"joint1\" is ", " at the start", "a smaller spread"});
  check_message(kHumanoid + "initial: {base: {velocity: [1.5e308, 1.5e308, 0], rotation: [0, 0, 0.8]}}\n", 3,
                {"the velocity \"base.vx\" is inf at the start"});
}

TEST_CASE("models of a scene that cannot be are refused where they stand", "[scene]") {
  check_message("step: 1\n", 1, {"the scene has no model"});
  check_message("model: chain:3\nmodels: [{model: chain:3}]\n", 2, {"both given"});
  check_message("model: missing.urdf\n", 1, {"there is no file \"missing.urdf\"", "relative to the scene"});
  check_message("model: chain:x\n", 1, {"no number of bodies"});
  check_message("model: chian:3\n", 1, {"cannot be generated"});
  check_message("model: chain:9999999999\n", 1, {"memory"});
  check_message("model: chain:nan\n", 1, {"\"nan\" is no number of bodies"});
  std::string many = "models:\n";
  for (int k = 0; k < 100'000; ++k) many += fmt::format("- {{model: chain:1000000, name: a{}}}\n", k);
  CHECK_THAT(message(many), StartsWith("s.yaml:1: models: all of them need about 236 TiB of memory; expected no more than "));
  check_message("model: other.yaml\n", 1, {"models, not scenes"});
  check_message("model: [chain:3]\n", 1, {"model is a list of 1"});
  check_message(kArm + "base: loose\n", 2, {"one of fixed, floating"});
  check_message("models: []\n", 1, {"models is a list of 0"});
  check_message("models: chain:3\n", 1, {"a list of models"});
  check_message("models: [{name: a}]\n", 1, {"models[0] has no model"});
  check_message("models:\n- {model: chain:3}\n- {model: chain:3}\n", 3, {"two models are called \"chain:3\"", "write name:"});
  check_message("models:\n- {model: chain:3, velocity: [0, 0, 1]}\n", 2, {"has a velocity, but its base is fixed"});
  check_message("models:\n- {model: chain:3, rotation: [0, 0, 1], quaternion: [0, 0, 0, 1]}\n", 2, {"both given"});
  check_message("base: fixed\nmodels:\n- {model: chain:3}\n", 1, {"base stands beside models"});
  check_message("model: humanoids:2\ninitial: {base: {position: [0, 0, 1]}}\n", 2,
                {"2 floating bases", "beside each model in models"});
  // a mistake in a model's own file is said with its own place
  const Folder folder;
  folder.write("bad.urdf", "<robot name=\"r\">\n<link/>\n</robot>\n");
  folder.write("s.yaml", "model: bad.urdf\n");
  CHECK_THROWS_WITH(load_scene(folder.file("s.yaml")), Contains("bad.urdf:2"));
}

TEST_CASE("what is no YAML is refused with its line", "[scene]") {
  check_message("", 1, {"the file is empty"});
  check_message("# only a comment\n", 1, {"the file is empty"});
  check_message("model: chain:3\neffects:\n\tgravity: [0, 0, 1]\n", 3, {"no YAML", "tab"});
  check_message("model: chain:3\neffects: {gravity: [0, 0, 1}\n", 2, {"no YAML"});
  check_message("model: \"chain:3\nstep: 1\n", 2, {"no YAML"});
  check_message("- model: chain:3\n", 1, {"the file holds a list"});
  check_message("chain:3\n", 1, {"the file holds \"chain:3\""});
  check_message("model: chain:3\nstep: 1e-3\nstep: 2e-3\n", 3, {"the key \"step\" is here for the second time"});
  check_message(kArm + "effects:\n  damping:\n    joint_1: 1\n    joint_1: 2\n", 5, {"\"joint_1\" is here for the second time"});
  CHECK(message("---\nmodel: chain:3\n...\n") == "nothing was thrown");
  CHECK(message("model: chain:3\n...") == "nothing was thrown");
  CHECK(message("\xef\xbb\xbfmodel: chain:3\r\nstep: 1\r\n") == "nothing was thrown");
  check_message("model: chain:3\n---\nmodel: chain:4\n", 2, {"a second document"});
  check_message("model: !!python/object chain:3\n", 1, {"the tag"});
  check_message("model: chain:3\n? [a, b]\n: 3\n", 2, {"a key is no plain text"});
  check_message("model: chain:3\n: 3\n", 2, {"a key"});
  check_message(std::string("model: chain:3\nstep: \0", 22), 2, {"control character"});
  check_message("model: chain:3\nstep: \x04 1\n", 2, {"control character"});
}

TEST_CASE("aliases are read, but not when they multiply or swallow themselves", "[scene]") {
  const Effects e = effects("model: chain:3\n", "  spring: {joint1: &soft {stiffness: 5}, joint2: *soft}\n");
  REQUIRE(e.springs.size() == 2);
  CHECK(e.springs[1].stiffness == 5);
  check_message("model: chain:3\ninitial: &a {positions: *a}\n", 2, {"an alias stands within what it names"});
  check_message("model: chain:3\ninitial: *nowhere\n", 2, {"no YAML"});
  std::string bomb = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (int k = 1; k < 9; ++k) {
    bomb += fmt::format("a{0}: &a{0} [*a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}]\n", k, k - 1);
  }
  check_message(bomb, 6, {"values, aliases written out"});
  std::string tower = "a0: &a0 [1]\n";
  for (int k = 1; k < 100; ++k) tower += fmt::format("a{0}: &a{0} [*a{1}]\n", k, k - 1);
  check_message(tower, 15, {"levels deep"});
}

TEST_CASE("scenes that are deep or long are refused, not read for ever", "[scene]") {
  for (const char* bracket : {"[", "{a: ", "- "}) {
    std::string deep = "effects: ";
    if (bracket[0] == '-') deep = "";
    for (int k = 0; k < 100'000; ++k) deep += bracket;
    INFO(bracket);
    CHECK_THAT(message(deep), StartsWith("s.yaml:1: "));
  }
  check_message("effects: [[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]\n", 1, {"levels deep"});
  CHECK_THAT(message("model: " + std::string(SceneYaml::kMostBytes, 'x')), Contains("bytes"));
}

TEST_CASE("a scene that is no file is refused by name", "[scene]") {
  const Folder folder;
  CHECK_THROWS_WITH(load_scene(folder.file("none.yaml")), Contains("there is no such file"));
  CHECK_THROWS_WITH(load_scene(folder.path().string()), Contains("this is a folder"));
  folder.write("empty.yaml", "");
  CHECK_THROWS_WITH(load_scene(folder.file("empty.yaml")), Contains("empty.yaml:1: the file is empty"));
}

TEST_CASE("tables that are none are refused with their own line", "[scene]") {
  const Folder folder;
  folder.write("s.yaml", "model: chain:3\neffects:\n  torque:\n    joint1: t.csv\n");
  const auto refused = [&](const std::string& table, const std::string& place, const std::string& what) {
    folder.write("t.csv", table);
    INFO(table);
    CHECK_THROWS_WITH(load_scene(folder.file("s.yaml")), Contains("s.yaml:4: ") && Contains("t.csv" + place) && Contains(what));
  };
  refused("", ": ", "holds no numbers");
  refused("time,torque\n", ": ", "holds no numbers");
  refused("time,torque\n0,1\n1\n", ":3: ", "1 numbers; expected 2");
  refused("0,1\n1,2,3\n", ":2: ", "3 numbers; expected 2");
  refused("0,1\n1,two\n", ":2: ", "\"two\"");
  refused("0,1\n1,nan\n", ":2: ", "\"nan\"");
  refused("0,1\n\n2,1\n1,1\n", ":4: ", "time 1 s comes after 2 s");
  refused("0,\n", ":1: ", "\"\"");
  folder.write("t.csv", "0,1,2\n");
  folder.write("s.yaml", "model: chain:3\neffects:\n  ground:\n    terrain: {file: t.csv, spacing: [1, 1]}\n");
  CHECK_THROWS_WITH(load_scene(folder.file("s.yaml")), Contains("t.csv has one row"));
  folder.write("t.csv", "0,1,2\n1,2\n");
  CHECK_THROWS_WITH(load_scene(folder.file("s.yaml")), Contains("t.csv:2: 2 numbers; expected 3"));
}

TEST_CASE("what is named and does nothing is said", "[scene]") {
  const auto warned = [](const std::string& text, const std::string& what) {
    const std::vector<std::string> warnings = scene("model: chain:3\neffects:\n  " + text + "\n").model.warnings;
    INFO(text);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], StartsWith("s.yaml:3: effects.") && Contains(what));
  };
  warned("damping: urdf", "no joint has any");
  warned("limits: urdf", "no joint has any");
  warned("spring: {}", "no joint has any");
  warned("drag: {wind: [1, 0, 0]}", "no body has any");
  warned("ground: {}", "nothing touches it");
  warned("limits: {velocity: 0}", "3 of 3 joints cannot move");
  warned("servo: {stiffness: 5, max_force: 0}", "3 of 3 servos have no strength");
  CHECK(scene("model: chain:3\neffects:\n  damping: 1\n").model.warnings.empty());
}

TEST_CASE("the scenes of the project can be run", "[scene]") {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kScenes)) {
    if (entry.path().extension() != ".yaml") continue;
    INFO(entry.path());
    const Scene s = load_scene(entry.path().string());
    CHECK(s.model.warnings.empty());
    Simulation simulation(s);
    CHECK(simulation.step().ok());
    ++scenes;
  }
  CHECK(scenes >= 4);
  // the soles of the humanoid are 0.3 m above the ground
  const Scene drop = load_scene(kScenes + "humanoid_drop.yaml");
  CHECK(position(drop, "base.z") - (0.927 - 0.859 * (1 - std::cos(0.2))) == Approx(0.3).margin(2e-3));
}

TEST_CASE("the scenes of the page on scenes are scenes", "[scene]") {
  const Folder folder;
  for (const char* file : {"arm.urdf", "crate.urdf", "four_bar.urdf", "humanoid.urdf"})
    std::filesystem::copy_file(LINDEN_MODELS_DIR + std::string("/") + file, folder / file);
  folder.write("push.csv", "0,0\n1,2\n");
  const std::string page = text_of(kScenes + "README.md"), fence = "```yaml\n";
  int scenes = 0;
  for (std::size_t at = page.find(fence); at != page.npos; at = page.find(fence, at)) {
    at += fence.size();
    const std::string text = page.substr(at, page.find("```", at) - at);
    CHECK(parse_scene(text, folder.file("s.yaml")).model.warnings.empty());
    ++scenes;
  }
  CHECK(scenes == 9);
  CHECK_THAT(page, Contains("no joint\n\"left_kne_pitch\" moves in model \"humanoid\"; expected one that does; did you mean"));
  check_message(
      kHumanoid + "effects: {damping: {left_kne_pitch: 1}}\n", 3,
      {"effects.damping.left_kne_pitch: no joint \"left_kne_pitch\" moves in model \"humanoid\"; expected one that does; did you "
       "mean \"left_knee_pitch\"?"});
}

TEST_CASE("mangled scenes are read or refused, and nothing else", "[scene]") {
  const std::string seeds[] = {text_of(kScenes + "humanoid_drop.yaml"), text_of(kScenes + "two_models.yaml"),
                               text_of(kScenes + "arm_servo.yaml"),
                               "model: ball-chain:2\ninitial: {positions: {joint1: [0, 0, 0, 1]}, seed: 3}\neffects:\n"
                               "  spring: &s {joint1: {stiffness: 5, rest: [0, 0, 0, 1]}}\n  torque: {}\n"
                               "  wrench: {link1: [{force: [1, 2, 3], from: 0, to: 1}]}\n  drag: {linear: 1, wind: [1, 2, 3]}\n"
                               "  ground: {normal: [0, 0, 1], height: 0, friction: 0.5}\n"};
  const std::string pieces[] = {":", "-", "{", "}", "[",  "]",   "\n", "\t",  " ", "&a", "*a",   "!!",  "|",
                                ">", "?", "#", "'", "\"", "nan", "~",  "---", ",", "%",  "\xff", "<<: "};
  Random random(11);
  int read = 0, refused = 0;
  for (int round = 0; round < 4000; ++round) {
    std::string text = seeds[random.below(std::size(seeds))];
    const int changes = 1 + static_cast<int>(random.below(4));
    for (int k = 0; k < changes; ++k) {
      const std::size_t at = random.below(text.size()), length = std::min<std::size_t>(random.below(12), text.size() - at);
      switch (random.below(4)) {
        case 0:
          text.erase(at, length);
          break;
        case 1:
          text.insert(at, pieces[random.below(std::size(pieces))]);
          break;
        case 2:
          text[at] = static_cast<char>(random.below(128));
          break;
        default:
          text.insert(random.below(text.size()), text.substr(at, length));
          break;
      }
      if (text.empty()) text = "x";
    }
    try {
      const Scene s = parse_scene(text, kScenes + "mangled.yaml");
      check(s.effects, s.model);
      ++read;
    } catch (const InputError& error) {
      const std::string what = error.what();
      if (what.find('\n') != what.npos) FAIL(what << "\n\n" << text);
      ++refused;
    } catch (const std::exception& error) {
      FAIL(error.what() << "\n\n" << text);
    }
  }
  CHECK(read > 100);
  CHECK(refused > 1000);
}

TEST_CASE("the program runs and inspects scenes", "[scene][command line]") {
  const Shell shell;
  shell.write("a.yaml",
              "model: " LINDEN_MODELS_DIR
              "/arm.urdf\nduration: 0.02\nstep: 2e-3\neffects:\n  gravity: [0, 0, -9.81]\n  damping: urdf\n  limits: urdf\n");
  const Outcome run = shell.linden("run a.yaml --json run.json");
  CHECK(run.exit_code == 0);
  CHECK(run.err.empty());
  CHECK_THAT(run.out, Contains("arm (a.yaml)") && Contains("damping: 7 joints, 0.5 to 5 N m s/rad") && Contains("10 steps"));
  CHECK_THAT(run.out, Contains("ignored     friction of 7, velocity limits of 7;") && Contains("as the scene says"));
  const auto figures = nlohmann::json::parse(text_of(shell / "run.json"));
  CHECK(figures.at("ignored").at("limits") == 0);
  CHECK(figures.at("ignored").at("friction") == 7);
  CHECK(figures.at("effects").size() == 2);
  CHECK(figures.at("gravity") == nlohmann::json({0, 0, -9.81}));

  const Outcome facts = shell.linden("inspect a.yaml --json inspect.json");
  CHECK(facts.exit_code == 0);
  CHECK_THAT(facts.out, Contains("gravity   0 0 -9.81 m/s^2") && Contains("damping   7 joints, 0.5 to 5 N m s/rad") &&
                            Contains("limits    7 joints"));
  const auto json = nlohmann::json::parse(text_of(shell / "inspect.json"));
  CHECK(json.at("effects").at("damping").size() == 7);
  CHECK(json.at("effects").at("damping")[0].at("joint") == "joint_1");
  CHECK(json.at("effects").at("limits")[1].at("lower") == -2.05);
  CHECK(json.at("duration") == 0.02);
}

TEST_CASE("a run accounts for what effects take and give", "[scene][command line]") {
  const Shell shell;
  const auto figures = [&](const std::string& file) {
    const Outcome outcome = shell.linden("run '" + kScenes + file + "' --duration 2 --json a.json --plot a.svg");
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.err.empty());
    CHECK_THAT(outcome.out, Contains("  work      effects took"));
    return nlohmann::json::parse(text_of(shell / "a.json"));
  };
  const auto pendulum = figures("pendulum_damped.yaml");
  CHECK(pendulum.at("energy_taken") > 0.02);
  CHECK(pendulum.at("energy_given") == 0);
  CHECK(pendulum.at("energy_band").get<double>() < 1e-4 * pendulum.at("energy_scale").get<double>());
  const auto arm = figures("arm_servo.yaml");
  CHECK(arm.at("energy_given") > 10);
  CHECK(arm.at("energy_band").get<double>() < 1e-3 * arm.at("energy_scale").get<double>());
  // the ground takes momentum, a servo does not
  CHECK(figures("humanoid_drop.yaml").at("momentum_drift_linear").is_null());
}

TEST_CASE("what the command line says goes over the scene", "[scene][command line]") {
  const Shell shell;
  shell.write("a.yaml",
              "model: chain:4\nduration: 0.02\nstep: 2e-3\nsolver: riqn\ntolerance: 1e-9\ninitial: {seed: 3}\neffects: {gravity: "
              "[0, 0, -1]}\n");
  const auto figures = [&](const std::string& options) {
    const Outcome outcome = shell.linden("run a.yaml --json a.json --record a.csv " + options);
    INFO(outcome.err);
    REQUIRE(outcome.exit_code == 0);
    return nlohmann::json::parse(text_of(shell / "a.json"));
  };
  const auto scene_says = figures("");
  CHECK(scene_says.at("step") == 2e-3);
  CHECK(scene_says.at("steps") == 10);
  CHECK(scene_says.at("solver") == "riqn");
  CHECK(scene_says.at("tolerance") == 1e-9);
  CHECK(scene_says.at("gravity") == nlohmann::json({0, 0, -1}));
  const std::string first = text_of(shell / "a.csv");
  const auto over =
      figures("--dt 1e-3 --duration 0.03 --solver newton --tolerance 1e-11 --gravity 0,0,0 --guess ig1 --stop absolute");
  CHECK(over.at("step") == 1e-3);
  CHECK(over.at("steps") == 30);
  CHECK(over.at("solver") == "newton");
  CHECK(over.at("tolerance") == 1e-11);
  CHECK(over.at("gravity") == nlohmann::json({0, 0, 0}));
  CHECK(over.at("guess") == "ig1");
  CHECK(over.at("stop") == "absolute");
  figures("--seed 3");
  CHECK(text_of(shell / "a.csv") == first);
  figures("--seed 4");
  CHECK(text_of(shell / "a.csv") != first);
}

TEST_CASE("scenes that cannot be run are refused in one line", "[scene][command line]") {
  const Shell shell;
  shell.write("a.yaml", "model: chain:4\n");
  shell.write("bad.yaml", "model: chain:4\nstep: 0\n");
  for (const char* command : {"run ", "inspect "}) {
    check_refused(shell, std::string(command) + "bad.yaml", "bad.yaml:2: step is \"0\"");
    check_refused(shell, std::string(command) + "a.yaml --base floating", "leave --base out");
    check_refused(shell, std::string(command) + "none.yaml", "none.yaml: there is no such file");
    check_refused(shell, std::string(command) + "a.yaml --json a.yaml", "expected .json");
  }
  check_refused(shell, "rollout a.yaml --base floating", "leave --base out");
  check_refused(shell, "run a.yaml --spread -1", "--spread");
}

}  // namespace linden::scene_file_test
