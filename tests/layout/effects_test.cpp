#include "layout/effects.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

namespace linden::effects_test {
using Catch::Matchers::Contains;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

LinkSpec link_called(const std::string& name, const std::string& parent, JointType type) {
  LinkSpec link;
  link.name = name;
  link.parent = parent;
  link.joint = name + "_joint";
  link.type = type;
  link.inertia = box_inertia(1, {1, 1, 1}, {0, 0, 0});
  return link;
}

/// A free base, a leader with limits, two that follow it, a ball joint, a planar joint, and a link fixed to the leader's.
Model puppet() {
  TreeBuilder builder("puppet");
  builder.add(link_called("base", "", JointType::free));
  LinkSpec leader = link_called("leader", "base", JointType::revolute);
  leader.damping = 1;
  leader.friction = 0.5;
  leader.limits = {.lower = -1, .upper = 1, .velocity = 5, .effort = 7};
  builder.add(leader);
  LinkSpec twice = link_called("twice", "leader", JointType::revolute);
  twice.damping = 0.25;
  twice.friction = 0.1;
  twice.limits = {.lower = -1, .upper = 4};
  twice.mimic = leader.joint;
  twice.multiplier = 2;
  twice.offset = 0.5;
  builder.add(twice);
  LinkSpec back = link_called("back", "leader", JointType::prismatic);
  back.damping = 4;
  back.friction = 2;
  back.limits = {.lower = -0.25, .upper = kInfinity};
  back.mimic = leader.joint;
  back.multiplier = -0.5;
  builder.add(back);
  LinkSpec ball = link_called("ball", "leader", JointType::ball);
  ball.damping = 3;
  builder.add(ball);
  builder.add(link_called("sled", "", JointType::planar));
  LinkSpec fixed = link_called("plate", "leader", JointType::fixed);
  fixed.placement.translation() = Eigen::Vector3d(0, 0, 2);
  builder.add(fixed);
  return builder.build();
}

const Model& model() {
  static const Model instance = puppet();
  return instance;
}

Index row(const std::string& joint) { return row_of(model(), joint); }
Index slot(const std::string& link) { return place_of(model(), link).slot; }

}  // namespace

TEST_CASE("a table goes straight between its points and is held beyond them", "[effects]") {
  const TimeTable table{{1, 2, 4, 4, 5}, {10, 20, 0, 7, 9}};
  CHECK(table.at(-3) == 10);
  CHECK(table.at(1) == 10);
  CHECK(table.at(1.25) == Approx(12.5));
  CHECK(table.at(2) == 20);
  CHECK(table.at(3) == Approx(10));
  CHECK(table.at(std::nextafter(4, 0)) == Approx(0).margin(1e-12));
  CHECK(table.at(4) == 7);
  CHECK(table.at(4.5) == Approx(8));
  CHECK(table.at(5) == 9);
  CHECK(table.at(1e9) == 9);
  CHECK(TimeTable().at(3) == 0);
}

TEST_CASE("a table's mean is its integral over the time, exactly", "[effects]") {
  const TimeTable table{{1, 2, 4, 4, 5}, {10, 20, 0, 7, 9}};
  CHECK(table.mean(-3, 0.5) == 10);
  CHECK(table.mean(6, 7) == 9);
  CHECK(table.mean(1.2, 1.4) == Approx(13).epsilon(1e-14));       // one piece: the value at its middle
  CHECK(table.mean(0, 6) == Approx((10 + 15 + 20 + 8 + 9) / 6.0).epsilon(1e-14));
  CHECK(table.mean(3.5, 4.5) == Approx((0.5 * 2.5 + 0.5 * 7.5)).epsilon(1e-14));
  CHECK(table.mean(3, 4) == Approx(5).epsilon(1e-14));            // the jump at its end is not in it
  CHECK(table.mean(4, 5) == Approx(8).epsilon(1e-14));
  CHECK(table.mean(1.999, 2.001) == Approx(20 - 0.0005 * 0.5 * (10 + 10)).epsilon(1e-14));
  CHECK(table.mean(2, 2) == 20);
  CHECK(TimeTable().mean(0, 1) == 0);
  CHECK(TimeTable{{0}, {0.1}}.mean(0.3, 0.7) == 0.1);
  // parts add up to the whole
  double sum = 0;
  for (int k = 0; k < 70; ++k) sum += 0.1 * table.mean(0.1 * k - 0.5, 0.1 * k - 0.4);
  CHECK(sum == Approx(7 * table.mean(-0.5, 6.5)).epsilon(1e-13));
  // points as close as times can be, and a jump that is not there for its neighbours
  const TimeTable spike{{0, 1, std::nextafter(1, 2), 2}, {0, 0, 1e3, 0}};
  CHECK(spike.mean(0, 1) == Approx(0).margin(1e-9));
  CHECK(spike.mean(0.5, 1.5) == Approx(0.5 * 750).epsilon(1e-12));
}

TEST_CASE("a wrench acts from its beginning to its end and not a rounding longer", "[effects]") {
  BodyWrench wrench{.slot = 1};
  CHECK(wrench.mean_share(3, 4) == 1);
  wrench.from = 0.25;
  wrench.to = 0.75;
  CHECK(wrench.mean_share(0, 1) == 0.5);
  CHECK(wrench.mean_share(0, 0.25) == 0);
  CHECK(wrench.mean_share(0.5, 1) == 0.5);
  CHECK(wrench.mean_share(0.75, 1) == 0);
  wrench.scale = {{0.5, 0.5, 1}, {2, 4, 0}};
  CHECK(wrench.mean_share(0, 1) == Approx(0.25 * 2 + 0.25 * 3).epsilon(1e-14));
  wrench.scale = {{0}, {1}};
  wrench.to = wrench.from;
  CHECK(wrench.mean_share(0, 1) == 0);
  // k times a step and the decimal that people write for it are one time
  for (int k = 1; k < 20'000; ++k) {
    for (const double step : {1e-3, 0.1, 7e-4}) {
      const double at = step * k, before = step * (k - 1);
      wrench.from = step == 1e-3 ? k / 1000.0 : step == 0.1 ? k / 10.0 : k * 7 / 10000.0;
      wrench.to = 1e9;
      if (wrench.mean_share(before, before + step) != 0 || wrench.mean_share(at, at + step) != 1) {
        FAIL("from " << wrench.from << " s, step " << k << " of " << step << " s");
      }
      std::swap(wrench.from, wrench.to);
      wrench.from = 0;
      if (wrench.mean_share(before, before + step) != 1 || wrench.mean_share(at, at + step) != 0) {
        FAIL("to " << wrench.to << " s, step " << k << " of " << step << " s");
      }
    }
  }
}

TEST_CASE("rows and links are found by name, or with the nearest one", "[effects]") {
  for (Index i = 1; i < model().tree.shape.slots; ++i) {
    CHECK(row_of(model(), model().names.joint[static_cast<std::size_t>(i)]) == model().tree.first_v(i));
  }
  CHECK(place_of(model(), "plate").slot == slot("leader"));
  CHECK_THROWS_WITH(row("leadr_joint"), Contains("no joint \"leadr_joint\"") && Contains("did you mean \"leader_joint\"?"));
  CHECK_THROWS_WITH(row("plate_joint"), Contains("no joint \"plate_joint\" moves"));
  CHECK_THROWS_WITH(row("sled_joint"), Contains("planar") && Contains("\"sled_joint.x\""));
  CHECK(model().names.velocity[static_cast<std::size_t>(row("sled_joint.y"))] == "sled_joint.y");
  CHECK_THROWS_WITH(row(""), Contains("linden inspect"));
  CHECK_THROWS_WITH(place_of(model(), "plat"), Contains("no link \"plat\"") && Contains("did you mean \"plate\"?"));
}

TEST_CASE("what a file says of mimic joints acts on their leader", "[effects]") {
  const std::vector<JointDamping> damping = urdf_damping(model());
  REQUIRE(damping.size() == 4);  // the leader, and three rows of the ball joint
  for (const JointDamping& entry : damping) {
    const bool leads = entry.row == row("leader_joint");
    CHECK(entry.coefficient == (leads ? 1 + 4 * 0.25 + 0.25 * 4 : 3));
  }
  const std::vector<JointFriction> friction = urdf_friction(model());
  REQUIRE(friction.size() == 1);
  CHECK(friction[0].row == row("leader_joint"));
  CHECK(friction[0].force == 0.5 + 2 * 0.1 + 0.5 * 2);
  // -1 <= q <= 1, -1 <= 2 q + 0.5 <= 4, -0.25 <= -0.5 q
  const std::vector<JointLimit> limits = urdf_limits(model(), 0.25);
  REQUIRE(limits.size() == 1);
  CHECK(limits[0].row == row("leader_joint"));
  CHECK(limits[0].lower == -0.75);
  CHECK(limits[0].upper == 0.5);
  CHECK(limits[0].restitution == 0.25);
  CHECK(limits[0].velocity == kInfinity);
  CHECK(urdf_limits(model(), 0, true)[0].velocity == 5);
  // |q'| <= 3, |2 q'| <= 4, |-0.5 q'| <= 2
  const std::vector<JointLimit> speeds = on_leaders(model(), {{.row = row("leader_joint"), .velocity = 3},
                                                              {.row = row("twice_joint"), .velocity = 4},
                                                              {.row = row("back_joint"), .velocity = 2}});
  REQUIRE(speeds.size() == 1);
  CHECK(speeds[0].velocity == 2);
  CHECK(on_leaders(model(), {JointLimit{.row = row("back_joint"), .velocity = 2}})[0].velocity == 4);
}

TEST_CASE("a file's limits of velocity are of joints that have no others too", "[effects]") {
  LinkSpec wheel = link_called("wheel", "", JointType::revolute);
  wheel.limits.velocity = 9;
  const Model cart = TreeBuilder("cart").add(wheel).add(link_called("free", "wheel", JointType::revolute)).build();
  CHECK(urdf_limits(cart).empty());
  const std::vector<JointLimit> limits = urdf_limits(cart, 0.5, true);
  REQUIRE(limits.size() == 1);
  CHECK(limits[0].row == 0);
  CHECK((limits[0].lower == -kInfinity && limits[0].upper == kInfinity && limits[0].velocity == 9));
}

TEST_CASE("what is given everywhere reaches every joint once", "[effects]") {
  const std::vector<Armature> armature = armature_everywhere(model(), 2);
  CHECK(armature.size() == 4);  // the leader and three of the planar joint
  for (const Armature& entry : armature) CHECK(entry.inertia == (entry.row == row("leader_joint") ? 2 * (1 + 4 + 0.25) : 2));
  CHECK(damping_everywhere(model(), 1).size() == 7);
  CHECK(friction_everywhere(model(), 1).size() == 4);
  const std::vector<JointLimit> speeds = velocity_limit_everywhere(model(), 3);
  CHECK(speeds.size() == 4);
  for (const JointLimit& entry : speeds) CHECK(entry.velocity == (entry.row == row("leader_joint") ? 1.5 : 3));

  std::vector<double> positions = model().neutral();
  positions[static_cast<std::size_t>(model().tree.first_q(slot("leader")))] = 0.3;
  const std::vector<Servo> servos = servo_everywhere(model(), 100, 10, positions);
  CHECK(servos.size() == 4);
  for (const Servo& servo : servos) {
    const bool leads = servo.row == row("leader_joint");
    CHECK(servo.stiffness == 100);
    CHECK(servo.damping == 10);
    CHECK(servo.target == (leads ? 0.3 : 0));
    CHECK(servo.max_force == (leads ? 7 : kInfinity));
  }
  CHECK_THROWS_AS(servo_everywhere(model(), 100, 10, {1, 2}), InputError);
}

TEST_CASE("limits of a leader and its followers that leave no room are refused", "[effects]") {
  const std::vector<JointLimit> apart{{row("leader_joint"), 0.5, 1, 0}, {row("twice_joint"), 0, 1, 0}};
  CHECK_THROWS_WITH(on_leaders(model(), apart), Contains("leader_joint") && Contains("no room"));
  const std::vector<JointLimit> nowhere{{99, 0, 1, 0}};
  CHECK_THROWS_WITH(on_leaders(model(), nowhere), Contains("row 99 does not exist"));
}

TEST_CASE("effects of every robot pass the check", "[effects]") {
  for (const char* file : {"/arm.urdf", "/hand.urdf", "/humanoid.urdf"}) {
    for (const Base base : {Base::fixed, Base::floating}) {
      const Model robot = load_urdf(std::string(LINDEN_MODELS_DIR) + file, base);
      Effects effects;
      effects.armature = armature_everywhere(robot, 0.01);
      effects.damping = urdf_damping(robot);
      effects.friction = urdf_friction(robot);
      effects.limits = urdf_limits(robot);
      effects.servos = servo_everywhere(robot, 100, 10);
      effects.ground = Ground();
      CHECK_NOTHROW(check(effects, robot));
      CHECK_FALSE(effects.limits.empty());
    }
  }
}

TEST_CASE("effects that make no sense are refused, each by its place", "[effects]") {
  const Index free = row("base_joint"), follower = row("twice_joint"), ball = row("ball_joint"), leader = row("leader_joint");
  const auto refused = [](const std::function<void(Effects&)>& spoil, const std::string& where, const std::string& what) {
    Effects effects;
    spoil(effects);
    INFO(where << " " << what);
    CHECK_THROWS_WITH(check(effects, model()), Contains("effects." + where) && Contains(what) && Contains("; expected "));
  };
  for (const Index wrong : {Index{-1}, model().tree.shape.velocities}) {
    refused([&](Effects& e) { e.armature = {{leader, 1}, {wrong, 1}}; }, "armature[1]", "does not exist");
    refused([&](Effects& e) { e.torques = {{wrong, {}}}; }, "torques[0]", "does not exist");
  }
  for (const Index wrong : {Index{0}, Index{-1}, model().tree.shape.slots}) {
    refused([&](Effects& e) { e.wrenches = {{.slot = wrong}}; }, "wrenches[0]", "holds no body");
    refused([&](Effects& e) { e.drag = {{wrong, 1, 0}}; }, "drag[0]", "holds no body");
    refused([&](Effects& e) { e.ball_springs = {{wrong, 1}}; }, "ball_springs[0]", "holds no body");
  }
  refused([&](Effects& e) { e.damping = {{free, 1}}; }, "damping[0]", "free joint");
  refused([&](Effects& e) { e.springs = {{ball, 1, 0}}; }, "springs[0]", "ball joint");
  refused([&](Effects& e) { e.friction = {{free, 1}}; }, "friction[0]", "free joint");
  refused([&](Effects& e) { e.servos = {{.row = follower, .stiffness = 1}}; }, "servos[0]", "name its leader \"leader_joint\"");
  refused([&](Effects& e) { e.ball_springs = {{slot("leader"), 1}}; }, "ball_springs[0]", "no ball joint");
  refused([&](Effects& e) { e.ball_springs = {{slot("ball"), 1, {0, 0, 0, 2}}}; }, "ball_springs[0]", "has length 2");
  refused([&](Effects& e) { e.drag = {{model().tree.parent(slot("sled")), 1, 0}}; }, "drag[0]", "no mass");

  for (const double wrong : {-1.0, kNaN, kInfinity}) {
    refused([&](Effects& e) { e.armature = {{leader, wrong}}; }, "armature[0]", "inertia is");
    refused([&](Effects& e) { e.springs = {{leader, wrong, 0}}; }, "springs[0]", "stiffness is");
    refused([&](Effects& e) { e.damping = {{leader, wrong}}; }, "damping[0]", "coefficient is");
    refused([&](Effects& e) { e.friction = {{leader, wrong}}; }, "friction[0]", "force is");
    refused([&](Effects& e) { e.limits = {{leader, -1, 1, wrong}}; }, "limits[0]", "restitution is");
    refused([&](Effects& e) { e.servos = {{.row = leader, .stiffness = wrong}}; }, "servos[0]", "stiffness is");
    refused([&](Effects& e) { e.servos = {{.row = leader, .stiffness = 1, .damping = wrong}}; }, "servos[0]", "damping is");
    refused([&](Effects& e) { e.drag = {{slot("base"), wrong, 0}}; }, "drag[0]", "linear is");
    refused([&](Effects& e) { e.drag = {{slot("base"), 0, wrong}}; }, "drag[0]", "quadratic is");
    refused([&](Effects& e) { e.ground = Ground{.stiffness = wrong}; }, "ground", "stiffness is");
    refused([&](Effects& e) { e.ground = Ground{.damping = wrong}; }, "ground", "damping is");
    refused([&](Effects& e) { e.ground = Ground{.friction = wrong}; }, "ground", "friction is");
  }
  for (const double wrong : {kNaN, kInfinity}) {
    refused([&](Effects& e) { e.springs = {{leader, 1, wrong}}; }, "springs[0]", "rest is");
    refused([&](Effects& e) { e.servos = {{.row = leader, .stiffness = 1, .target = wrong}}; }, "servos[0]", "target is");
    refused([&](Effects& e) { e.torques = {{leader, {{0}, {wrong}}}}; }, "torques[0]", "force is");
    refused([&](Effects& e) { e.wrenches = {{.slot = 1, .force = {0, wrong, 0}}}; }, "wrenches[0]", "force is");
    refused([&](Effects& e) { e.wind = {0, 0, wrong}; }, "wind", "wind is");
    refused([&](Effects& e) { e.ground = Ground{.height = wrong}; }, "ground", "height is");
  }
  refused([&](Effects& e) { e.servos = {{.row = leader, .stiffness = 1, .max_force = -1}}; }, "servos[0]", "max_force is -1");
  refused([&](Effects& e) { e.servos = {{.row = leader, .stiffness = 1, .max_force = kNaN}}; }, "servos[0]", "max_force is nan");
  refused([&](Effects& e) { e.limits = {{leader, 1, -1, 0}}; }, "limits[0]", "lower is 1");
  refused([&](Effects& e) { e.limits = {{leader, kNaN, 1, 0}}; }, "limits[0]", "lower is nan");
  refused([&](Effects& e) { e.limits = {{leader, kInfinity, kInfinity, 0}}; }, "limits[0]", "may only be at inf");
  refused([&](Effects& e) { e.limits = {{leader, -1, 1, 1.5}}; }, "limits[0]", "restitution is 1.5");
  refused([&](Effects& e) { e.limits = {{.row = leader, .velocity = -1}}; }, "limits[0]", "velocity is -1");
  refused([&](Effects& e) { e.limits = {{.row = leader, .velocity = kNaN}}; }, "limits[0]", "velocity is nan");
  const TimeTable unsorted{{0, 2, 1}, {0, 0, 0}}, unequal{{}, {1}};
  for (TimeTable Servo::*member : {&Servo::target_over_time, &Servo::target_velocity, &Servo::feedforward}) {
    for (const auto& [table, what] : {std::pair{unsorted, "comes after 2 s"}, {unequal, "0 times and 1 values"}}) {
      Servo servo{.row = leader, .stiffness = 1};
      servo.*member = table;
      refused([&](Effects& e) { e.servos = {servo}; }, "servos[0]", what);
    }
  }
  refused([&](Effects& e) { e.torques = {{leader, {{0, 2, 1}, {0, 0, 0}}}}; }, "torques[0]", "comes after 2 s");
  refused([&](Effects& e) { e.torques = {{leader, {{0, 1}, {0}}}}; }, "torques[0]", "2 times and 1 values");
  refused([&](Effects& e) { e.torques = {{leader, {{}, {}}}}; }, "torques[0]", "0 times");
  refused([&](Effects& e) { e.wrenches = {{.slot = 1, .from = 2, .to = 1}}; }, "wrenches[0]", "from 2 to 1");
  refused([&](Effects& e) { e.friction = {{leader, 1}, {leader, 2}}; }, "friction[1]", "named twice");
  refused([&](Effects& e) { e.limits = {{leader, -1, 1, 0}, {leader, -1, 1, 0}}; }, "limits[1]", "named twice");
  refused(
      [&](Effects& e) {
        e.servos = {{.row = leader, .stiffness = 1}, {.row = leader, .stiffness = 2}};
      },
      "servos[1]", "named twice");
  refused([&](Effects& e) { e.ground = Ground{.normal = {0, 0, 2}}; }, "ground", "normal has length 2");
  const HeightField field{
      .columns = 2, .rows = 2, .spacing_x = 1, .spacing_y = 1, .origin_x = 0, .origin_y = 0, .heights = {0, 0, 0}};
  refused([&](Effects& e) { e.ground = Ground{.terrain = field}; }, "ground.terrain", "it has 3 heights");
  refused([&](Effects& e) { e.ground = Ground{.contacts = {{{2, {}, 0}, {1, {}, 0}}, {}, {}}}; }, "ground", "in no order");
}

TEST_CASE("what may be named twice may be", "[effects]") {
  const Index leader = row("leader_joint"), ball = row("ball_joint");
  Effects effects;
  effects.armature = {{leader, 1}, {leader, 2}};
  effects.damping = {{leader, 1}, {ball, 1}, {ball + 2, 1}, {leader, 2}};
  effects.torques = {{leader, {}}, {leader, {}}};
  effects.wrenches = {{.slot = 1}, {.slot = 1}};
  CHECK_NOTHROW(check(effects, model()));
}

}  // namespace linden::effects_test
