// Bodies that touch each other: rest, friction, rolling, stacks, blows, hands that push and hold, and that all of it continues to the same bits.
#include <catch2/catch.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "engine/sweeps/body_contacts.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::body_contact_test {
namespace {

using Eigen::Vector3d;
constexpr double kGravity = 9.81, kFriction = 0.5;
#ifdef LINDEN_SANITIZED  // which takes ten times as long
constexpr int kDrops = 2, kStack = 3, kHeld = 500;
constexpr std::array kSteps{5e-3};
#else
constexpr int kDrops = 12, kStack = 6, kHeld = 10000;
constexpr std::array kSteps{5e-4, 1e-3, 5e-3};
#endif

/// Solids of 0.2 m, and fixed slabs whose tops are at z = 0 of their own: a slab's slider along y plays no part.
class Bodies : public Folder {
 public:
  Bodies() {
    solid("ball", R"(<sphere radius="0.1"/>)", 1, 0.4 * 0.01);
    solid("drum", R"(<cylinder radius="0.1" length="0.2"/>)", 1, 0.005);
    solid("block", R"(<box size="0.2 0.2 0.2"/>)", 1, 0.04 / 6);
    solid("heavy", R"(<box size="0.2 0.2 0.2"/>)", 1000, 1000 * 0.04 / 6);
    solid("wheel", R"(<cylinder radius="0.1" length="0.06"/>)", 1, 0.005);
    solid("cube", R"(<box size="0.04 0.04 0.04"/>)", 0.2, 0.2 * 0.0016 / 6);
    slab("floor", "60 60 1", -0.5);
    slab("table", "0.6 2 0.1", -0.05);
    write("hand.urdf", R"(<robot name="hand"><link name="mount"/><joint name="wrist" type="continuous"><parent link="mount"/><child link="paddle"/>)"
                       R"(<axis xyz="0 0 1"/></joint><link name="paddle"><inertial><mass value="0.2"/>)"
                       R"(<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>)"
                       R"(<collision><geometry><box size="0.1 0.04 0.1"/></geometry></collision></link></robot>)");
  }
  Simulation scene(const std::string& models, const std::string& effects, double step = 1e-3) const {
    Scene scene = parse_scene("models:\n" + models + "effects: {" + effects + "}\n", file("scene.yaml"));
    scene.options.step = step;
    scene.start_as_given = true;
    return Simulation(scene);
  }

 private:
  void solid(const std::string& name, const std::string& shape, double mass, double inertia) const {
    write(name + ".urdf",
          fmt::format(R"(<robot name="{0}"><link name="{0}"><inertial><mass value="{1}"/><inertia ixx="{2}" iyy="{2}" izz="{2}" )"
                      R"(ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>{3}</geometry></collision></link></robot>)",
                      name, mass, inertia, shape));
  }
  void slab(const std::string& name, const std::string& size, double middle) const {
    write(name + ".urdf",
          fmt::format(R"(<robot name="{0}"><link name="slab"><collision><origin xyz="0 0 {1}"/>)"
                      R"(<geometry><box size="{2}"/></geometry></collision></link>)"
                      R"(<link name="weight"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>)"
                      R"(<joint name="slider" type="prismatic"><parent link="slab"/><child link="weight"/><axis xyz="0 1 0"/>)"
                      R"(<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)",
                      name, middle, size));
  }
};

const std::string kFloor = "  - {model: floor.urdf, name: floor}\n";

std::string effects(double stiffness, double friction = kFriction) {
  return fmt::format("gravity: [0, 0, {}], contact: {{stiffness: {}, friction: {}}}", -kGravity, stiffness, friction);
}

std::string body(const std::string& model, const std::string& name, const Vector3d& at, const std::string& more = "") {
  return fmt::format("  - {{model: {}.urdf, name: {}, base: floating, position: [{}, {}, {}]{}}}\n", model, name, at.x(), at.y(), at.z(), more);
}

/// Of the k-th solid behind a slab.
Vector3d place(const Simulation& simulation, std::size_t k = 0) { return Vector3d(&simulation.positions()[1 + 7 * k]); }

/// Where a link's frame is.
Vector3d where(Simulation& simulation, const std::string& link) {
  return Vector3d(link_pose(Kinematics(simulation), place_of(simulation.model(), link)).shift.data());
}

double fastest(Simulation& simulation) {
  double most = 0;
  for (const double v : simulation.velocities()) most = std::max(most, std::abs(v));
  return most;
}

int steps_of(double time, const Simulation& simulation) { return static_cast<int>(std::lround(time / simulation.options().step)); }

/// Of solids of 1 kg behind a slab, from where they were one step before: energy of the mean motion, and of weight in the middle of it.
double energy_between(const std::vector<double>& before, const Simulation& simulation) {
  const std::span<const double> now = simulation.positions();
  const double h = simulation.options().step;
  double sum = 0;
  for (std::size_t at = 1, k = 0; at + 7 <= now.size(); at += 7, ++k) {
    const double inertia = k % 2 == 0 ? 0.04 / 6 : 0.004;  // blocks and balls in turn
    const Eigen::Quaterniond turn = Eigen::Quaterniond(&before[at + 3]).conjugate() * Eigen::Quaterniond(&now[at + 3]);
    const double angle = 2 * std::asin(std::min(1.0, turn.vec().norm()));
    sum += 0.5 * (Vector3d(&now[at]) - Vector3d(&before[at])).squaredNorm() / (h * h) + 0.5 * inertia * angle * angle / (h * h);
    sum += kGravity * (now[at + 2] + before[at + 2]) / 2;
  }
  return sum;
}

/// Sums of all rises of energy in a run, as it is told and between states; how far the account of energy strays; how much is lost; by how much
/// momentum that is told changes.
struct Account {
  double rises = 0, between = 0, strays = 0, fell = 0, told = 0;
};

Account accounted(Simulation& simulation, double time) {
  const double start = simulation.energy().total();
  const Momentum first = simulation.momentum();
  double last = start, last_between = 1e9;
  Account account;
  for (int k = 0; k < steps_of(time, simulation); ++k) {
    const std::vector<double> before(simulation.positions().begin(), simulation.positions().end());
    const StepReport report = simulation.step();
    if (!report.ok()) FAIL(fmt::format("step {}: {}", k, simulation.describe(report)));
    const double now = simulation.energy().total();
    account.told = std::max({account.told, distance(simulation.momentum().linear, first.linear), distance(simulation.momentum().angular, first.angular)});
    account.rises += std::max(0.0, now - last);
    account.strays = std::max(account.strays, std::abs(now + simulation.effect_work().taken() - start));
    last = now;
    const double between = energy_between(before, simulation);
    account.between += std::max(0.0, between - last_between);
    last_between = between;
  }
  account.fell = start - last;
  return account;
}

std::vector<double> numbers(const Simulation& simulation) {
  std::vector<double> all(simulation.positions().begin(), simulation.positions().end());
  all.insert(all.end(), simulation.momenta().begin(), simulation.momenta().end());
  return all;
}

/// Five that fall onto each other, turned at random.
std::string falling(std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> random(-1, 1);
  const auto next = [&] { return random(engine); };
  std::string models = kFloor;
  for (int k = 0; k < 5; ++k) {
    const double x = 0.08 * next(), y = 0.08 * next(), roll = 3 * next(), pitch = next(), yaw = 3 * next(), v = 0.3 * next();
    models += body(k % 2 == 0 ? "block" : "ball", fmt::format("b{}", k), {x, y, 0.25 + 0.37 * k},
                   fmt::format(", rotation: [{}, {}, {}], velocity: [{}, 0, 0]", roll, pitch, yaw, v));
  }
  return models;
}

}  // namespace

TEST_CASE("a block at rest stands still, as deep as its weight presses it", "[body_contact]") {
  const Bodies bodies;
  for (const double stiffness : {1e6, 1e9}) {
    CAPTURE(stiffness);
    Simulation simulation = bodies.scene(kFloor + body("block", "b", {0, 0, 0.1}), effects(stiffness));
    run(simulation, 1000);
    const Vector3d then = place(simulation);
    CHECK(0.1 - then.z() == Approx(kGravity / (4 * stiffness)).epsilon(1e-6));
    double moved = 0, speed = 0;
    for (int second = 0; second < 10; ++second) {
      run(simulation, 1000);
      moved = std::max(moved, (place(simulation) - then).norm());
      speed = std::max(speed, fastest(simulation));
    }
    CHECK(moved < 1e-12);
    CHECK(speed < 1e-10);
  }
}

TEST_CASE("a block that slides stops after v^2 / 2 mu g", "[body_contact]") {
  const Bodies bodies;
  Simulation simulation = bodies.scene(kFloor + body("block", "b", {0, 0, 0.1}, ", velocity: [2, 0, 0]"), effects(1e7));
  run(simulation, 1000);
  CHECK(place(simulation).x() == Approx(4 / (2 * kFriction * kGravity)).epsilon(1e-3));
  CHECK(std::abs(place(simulation).y()) < 1e-9);
  CHECK(fastest(simulation) < 1e-9);
}

TEST_CASE("a block on a slope creeps below the angle of friction, and runs down above it as Coulomb has it", "[body_contact]") {
  const Bodies bodies;
  for (const double share : {0.9, 1.1}) {
    CAPTURE(share);
    const double angle = std::atan(share * kFriction);
    const Vector3d up(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
    const std::string turned = fmt::format(", rotation: [0, {}, 0]", angle);
    const std::string floor = fmt::format("  - {{model: floor.urdf, name: floor{}}}\n", turned);
    Simulation simulation = bodies.scene(floor + body("block", "b", 0.1 * up, turned), effects(1e7));
    const Vector3d start = place(simulation);
    run(simulation, 2000);
    const double way = (place(simulation) - start).dot(down);
    if (share < 1) {
      CHECK(way > 0.5 * 2 * kContactCreep);
      CHECK(way < 2 * 2 * kContactCreep);
    } else {
      CHECK(way == Approx(2 * kGravity * (std::sin(angle) - kFriction * std::cos(angle))).epsilon(2e-3));
    }
  }
}

TEST_CASE("a ball that falls with a sideways speed ends rolling at five sevenths of it", "[body_contact]") {
  const Bodies bodies;
  Simulation simulation = bodies.scene(kFloor + body("ball", "b", {0, 0, 0.3}, ", velocity: [1, 0, 0]"), effects(1e7));
  run(simulation, 1500);
  const Vector3d then = place(simulation);
  run(simulation, 500);
  CHECK((place(simulation) - then).x() / 0.5 == Approx(5.0 / 7).epsilon(1e-4));
  CHECK(std::abs(place(simulation).y()) < 1e-9);
}

TEST_CASE("a ball rolls down a slope with five sevenths of the pull", "[body_contact]") {
  const Bodies bodies;
  const double angle = 0.2;
  const Vector3d up(std::sin(angle), 0, std::cos(angle));
  const std::string floor = fmt::format("  - {{model: floor.urdf, name: floor, rotation: [0, {}, 0]}}\n", angle);
  Simulation simulation = bodies.scene(floor + body("ball", "b", 0.1 * up), effects(1e7));
  const Vector3d start = place(simulation);
  run(simulation, 2000);
  CHECK((place(simulation) - start).norm() == Approx(5.0 / 14 * kGravity * std::sin(angle) * 4).epsilon(1.5e-3));
}

TEST_CASE("a wheel rolls on at any step, and does not sink by what the place rises that touches first", "[body_contact]") {
  const Bodies bodies;
  const std::string rolls = ", rotation: [1.5707963267948966, 0, 0], velocity: [3, 0, 0], angular_velocity: [0, 30, 0]";
  for (const double step : kSteps) {
    CAPTURE(step);
    Simulation simulation = bodies.scene(kFloor + body("wheel", "b", {0, 0, 0.1}, rolls), effects(1e8), step);
    run(simulation, steps_of(2, simulation));
    CHECK(std::abs(place(simulation).z() - 0.1) < 1e-6);
    CHECK(place(simulation).x() == Approx(6).epsilon(5e-3));  // a step goes as far as the sine of its turn
    CHECK(std::abs(place(simulation).y()) < 1e-5);
  }
}

TEST_CASE("a wheel that leans rolls about a circle on its rim, and does not sink", "[body_contact]") {
  const Bodies bodies;
  const double lean = 0.3, height = 0.1 * std::cos(lean) + 0.03 * std::sin(lean);
  const std::string rolls = fmt::format(", rotation: [{}, 0, 0], velocity: [3, 0, 0], angular_velocity: [0, 30, 0]", std::numbers::pi / 2 - lean);
  for (const double step : kSteps) {
    CAPTURE(step);
    Simulation simulation = bodies.scene(kFloor + body("wheel", "b", {0, 0, height + 1e-5}, rolls), effects(1e8), step);
    double least = 0;
    for (int k = 0; k < steps_of(1, simulation); ++k) {
      run(simulation, 1);
      const std::span<const double> q = simulation.positions();
      const Vector3d axis = Eigen::Quaterniond(q[7], q[4], q[5], q[6]) * Vector3d::UnitZ();
      const double lowest = place(simulation).z() - 0.1 * std::sqrt(1 - axis.z() * axis.z()) - 0.03 * std::abs(axis.z());
      least = std::min(least, lowest);
    }
    CHECK(least > -2e-4);
  }
}

TEST_CASE("a cylinder rolls down a slope with two thirds of the pull, on its lowest line and not into the floor", "[body_contact]") {
  const Bodies bodies;
  const double angle = 0.3;
  const Vector3d up(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
  const std::string floor = fmt::format("  - {{model: floor.urdf, name: floor, rotation: [0, {}, 0]}}\n", angle);
  Simulation simulation = bodies.scene(floor + body("drum", "b", 0.1 * up, ", rotation: [1.5707963267948966, 0, 0]"), effects(1e7));
  const Vector3d start = place(simulation);
  run(simulation, 2000);
  const Vector3d way = place(simulation) - start;
  CHECK(way.dot(down) == Approx(1.0 / 3 * kGravity * std::sin(angle) * 4).epsilon(1.5e-3));
  CHECK(std::abs(way.dot(up)) < 1e-6);
}

TEST_CASE("what begins within the floor comes out of it, and nothing is said to have given energy", "[body_contact]") {
  const Bodies bodies;
  for (const double depth : {1e-9, 3e-6, 3e-4, 1e-2}) {
    for (const double step : kSteps) {
      CAPTURE(depth, step);
      Simulation simulation = bodies.scene(kFloor + body("block", "b", {0, 0, 0.1 - depth}), effects(1e8), step);
      run(simulation, steps_of(1.5, simulation));
      CHECK(simulation.passive_gifts().empty());
      CHECK(std::abs(place(simulation).z() - 0.1) < 1e-6);
    }
  }
}

TEST_CASE("a tall stack stands, and so do a thousand kilograms on one", "[body_contact]") {
  const Bodies bodies;
  const bool tall = GENERATE(true, false);
  CAPTURE(tall);
  std::string models = kFloor;
  for (int k = 0; k < (tall ? kStack : 2); ++k) models += body(tall || k == 0 ? "block" : "heavy", fmt::format("b{}", k), {0, 0, 0.1 + 0.2 * k});
  Simulation simulation = bodies.scene(models, effects(1e9), 2e-3);
  const std::size_t top = tall ? kStack - 1 : 1;
  const double start = place(simulation, top).z();
  run(simulation, 1000);
  const Vector3d then = place(simulation, top);
  // each interface is pressed by all that stands on it
  const double pressed = tall ? kStack * (kStack + 1) / 2 : 2001;
  CHECK(start - then.z() == Approx(pressed * kGravity / 4e9).epsilon(1e-3));
  run(simulation, 1000);
  CHECK(std::abs(place(simulation, top).z() - then.z()) < 1e-12);
  CHECK((place(simulation, top) - then).norm() < 1e-9);
}

/// Tops of the flights of a ball that is let go 0.5 m above a floor.
std::vector<double> tops_of(const Bodies& bodies, const std::string& contact, double step, double time) {
  Simulation simulation = bodies.scene(kFloor + body("ball", "b", {0, 0, 0.6}), "gravity: [0, 0, -9.81], contact: {" + contact + "}", step);
  std::vector<double> tops;
  double last = place(simulation).z(), rose = 0;
  const double start = simulation.energy().total();
  for (int k = 0; k < steps_of(time, simulation); ++k) {
    run(simulation, 1);
    const double now = place(simulation).z();
    if (rose > 0 && now <= last && last > 0.1 + 1e-5) tops.push_back(last - 0.1);
    rose = now - last;
    last = now;
    CHECK(simulation.energy().total() + simulation.effect_work().taken() == Approx(start).margin(1e-8));
  }
  return tops;
}

TEST_CASE("a ball bounces by its restitution, at any step and stiffness, and not at all without", "[body_contact]") {
  const Bodies bodies;
  for (const double step : {1e-4, 1e-3, 1e-2}) {
    for (const std::string stiffness : {"rigid", "1e5"}) {
      CAPTURE(step, stiffness);
      for (const double restitution : {0.5, 0.9, 1.0}) {
        const std::vector<double> tops = tops_of(bodies, fmt::format("stiffness: {}, restitution: {}", stiffness, restitution), step, 2);
        REQUIRE(tops.size() >= 2);
        double height = 0.5;
        for (std::size_t k = 0; k < 2; ++k) {
          height *= restitution * restitution;
          // a blow comes up to a step early, by v h too high, and leaves out half a step of gravity
          const double v = 3.14, early = v * step * (1 - restitution * restitution), late = v * step * (1 - restitution) / 2;
          CHECK(tops[k] == Approx(height).margin(static_cast<double>(k + 1) * (2e-5 + early + late)));
        }
      }
    }
    CHECK(tops_of(bodies, "", step, 0.6).empty());
  }
}

TEST_CASE("what damps a contact takes of a bounce what a damped spring would", "[body_contact]") {
  const Bodies bodies;
  const double frequency = std::sqrt(1e5), share = 0.1;  // of a ball of 1 kg, critical damping 1
  const std::vector<double> free = tops_of(bodies, "stiffness: 1e5", 2e-5, 0.7);
  const std::vector<double> damped = tops_of(bodies, fmt::format("stiffness: 1e5, damping: {}", 2 * share * frequency), 2e-5, 0.7);
  REQUIRE(!free.empty());
  REQUIRE(!damped.empty());
  CHECK(free[0] == Approx(0.49).margin(0.01));
  CHECK(damped[0] / free[0] == Approx(std::exp(-2 * M_PI * share / std::sqrt(1 - share * share))).epsilon(0.12));
}

TEST_CASE("links and pairs of them have materials of their own", "[body_contact]") {
  const Bodies bodies;
  Simulation simulation = bodies.scene(
      kFloor + body("ball", "hard", {0, 0, 0.6}) + body("ball", "dull", {1, 0, 0.6}) + body("block", "icy", {3, 0, 0.1}, ", velocity: [1, 0, 0]") +
          body("block", "rough", {3, 2, 0.1}, ", velocity: [1, 0, 0]"),
      "gravity: [0, 0, -9.81], contact: {friction: 0.5, between: [{links: [floor/slab], friction: 0.4}, {links: [hard/ball, floor/slab], restitution: 1}, "
      "{links: [floor/slab, icy/block], friction: 0}]}");
  double highest[2] = {0, 0};
  for (int k = 0; k < 700; ++k) {
    run(simulation, 1);
    for (std::size_t j = 0; j < 2 && k > 400; ++j) highest[j] = std::max(highest[j], place(simulation, j).z());
  }
  CHECK(highest[0] == Approx(0.6).margin(1e-3));
  CHECK(highest[1] == Approx(0.1).margin(1e-6));
  CHECK(place(simulation, 2).x() == Approx(3.7).margin(1e-9));
  CHECK(place(simulation, 3).x() == Approx(3 + 1 / (2 * 0.4 * kGravity)).epsilon(2e-3));
  const auto refused = [&](const std::string& contact, const std::string& told) {
    CHECK_THROWS_WITH(bodies.scene(kFloor + body("ball", "b", {0, 0, 0.6}), "contact: {" + contact + "}"), Catch::Contains(told));
  };
  refused("restitution: 1.5", "expected a number from 0 to 1");
  refused("stiffness: soft", "effects.contact.stiffness");
  refused("damping: -1", "effects.contact.damping");
  refused("between: [{friction: 0.4}]", "effects.contact.between[0] names no links");
  refused("between: [{links: [b/bal]}]", "b/ball");
  refused("between: [{links: [floor/weight]}]", "nothing that touches is between floor/weight");
  refused("between: [{links: [b/ball], frction: 1}]", "friction");
}

TEST_CASE("what collides in free flight keeps its momentum", "[body_contact]") {
  const Bodies bodies;
  const char* other = GENERATE("ball", "block");
  CAPTURE(other);
  const std::string tumbles = ", rotation: [0.3, 0.5, 0.2], velocity: [1, 0, 0], angular_velocity: [1, 2, 3]";
  Simulation simulation = bodies.scene(body("block", "a", {0, 0, 0}, tumbles) +
                                           body(other, "b", {0.5, 0.05, 0.03}, ", velocity: [-1, 0.2, 0], angular_velocity: [0, 0, -4]"),
                                       "contact: {stiffness: 1e7, friction: 0.5}");
  const Momentum before = simulation.momentum();
  const double start = simulation.energy().total();
  const Account account = accounted(simulation, 1);
  const Momentum after = simulation.momentum();
  CHECK(distance(before.linear, after.linear) < 1e-13);
  CHECK(distance(before.angular, after.angular) < 1e-13);
  CHECK(simulation.energy().total() < 0.8 * start);
  CHECK(account.told < 1e-13);
  CHECK(account.rises < 1e-10);
  CHECK(account.strays < 1e-3);
}

TEST_CASE("falls onto each other give no energy", "[body_contact]") {
  const Bodies bodies;
  Account worst;
  for (std::uint64_t seed = 1; seed <= kDrops; ++seed) {
    CAPTURE(seed);
    Simulation simulation = bodies.scene(falling(seed), effects(1e9));
    const Account account = accounted(simulation, 1.5);
    CHECK(account.fell > 10);
    worst.rises = std::max(worst.rises, account.rises);
    worst.between = std::max(worst.between, account.between);
    worst.strays = std::max(worst.strays, account.strays);
  }
  CHECK(worst.between < 2.6e-3);
  CHECK(worst.rises < 2e-3);
  CHECK(worst.strays < 0.05);
}

TEST_CASE("a pile comes to rest at any step", "[body_contact]") {
  const Bodies bodies;
  for (const double step : kSteps) {
    CAPTURE(step);
    Simulation simulation = bodies.scene(falling(3), effects(1e9), step);
    const Account account = accounted(simulation, 4);
    CHECK(account.fell > 10);
    CHECK(account.between < 3e-4);
    CHECK(account.rises < 3e-3);
    CHECK(account.strays < 0.1);
    for (std::size_t k = 0; k < 5; ++k) CHECK(place(simulation, k).z() > 0.0999);
  }
}

TEST_CASE("a run continued from a checkpoint in a pile, and steps alone, end at the same bits", "[body_contact]") {
  const Bodies bodies;
  const auto made = [&] { return bodies.scene(falling(5), effects(1e9)); };
  Simulation whole = made(), alone = made(), continued = made();
  run(whole, 500);
  const std::string middle = whole.checkpoint();
  run(whole, 300);
  for (int k = 0; k < 800; ++k) REQUIRE(alone.step().ok());
  run(continued, 100);
  continued.restore(middle);
  run(continued, 300);
  CHECK(numbers(whole) == numbers(alone));
  CHECK(numbers(whole) == numbers(continued));
  CHECK(whole.effect_work().taken() == continued.effect_work().taken());
  CHECK(whole.effect_work().taken() > 1);
}

TEST_CASE("an arm pushes a block along a table", "[body_contact]") {
  const Bodies bodies;
  const std::string models = "  - {model: table.urdf, name: table, position: [1.1, 0, 0.23]}\n" + body("block", "b", {1.0, 0.2, 0.33}) +
                             "  - {model: " + model_file("arm.urdf") + ", name: arm}\n" +
                             "  - {model: hand.urdf, name: hand, parent: arm/tool_flange, position: [0, 0, 0.05]}\n";
  const std::string turn = "{times: [0, 2, 4], values: [0, 0.5, 0.5]}";
  const std::string servo = "servo: {stiffness: 2000, damping: 200, targets: {arm/joint_1: " + turn + ", arm/joint_2: 1.5708}}";
  const std::string rest = "initial: {positions: {arm/joint_2: 1.5708}}\neffects: {" + effects(1e7, 0.3) + ", " + servo + "}\n";
  Simulation simulation(parse_scene("models:\n" + models + rest, bodies.file("scene.yaml")));
  run(simulation, 4000);
  const Vector3d then = where(simulation, "b/block");
  CHECK(then.y() > 0.4);
  CHECK(then.z() == Approx(0.33).margin(1e-5));
  run(simulation, 500);
  CHECK((where(simulation, "b/block") - then).norm() < 1e-5);
}

TEST_CASE("a gripper of closed loops holds a cube", "[body_contact]") {
  const Bodies bodies;
  const std::string text = "models:\n  - {model: " + model_file("gripper.urdf") + ", name: g}\n" + body("cube", "cube", {0, 0, 0.1966}) + R"(
initial:
  positions: {g/right_driver: 0.342, g/right_fingertip: -0.342, g/right_follower: 0.342, g/left_driver: 0.342, g/left_fingertip: -0.342,
              g/left_follower: 0.342}
couplings: [{type: gear, name: feet, joints: {g/right_driver: 1, g/left_driver: -1}}]
effects:
  gravity: [0, 0, 9.81]
  armature: {g/right_driver: 1e-3}
  contact: {stiffness: 1e7, friction: 0.5}
  servo: {stiffness: 40, damping: 0.8, joints: [g/right_driver], targets: {g/right_driver: 0.25}}
)";
  Simulation simulation(parse_scene(text, bodies.file("scene.yaml")));
  run(simulation, 500);
  const Vector3d then = where(simulation, "cube/cube");
  CHECK((then - Vector3d(0, 0, 0.1966)).norm() < 1e-3);
  run(simulation, kHeld);
  CHECK((where(simulation, "cube/cube") - then).norm() < 1e-5);
}

}  // namespace linden::body_contact_test
