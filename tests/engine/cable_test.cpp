// Cables: weights over pulleys, pendulums that go slack, winches, tendons, and what they keep.
#include <catch2/catch.hpp>

#include <numbers>

#include "engine/batch.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/random.hpp"
#include "tests/engine/mechanisms.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::cable_test {
namespace {

using Catch::Matchers::Contains;
constexpr double kGravity = 9.81;  // [m/s^2]

/// A weight, free or on a vertical slide at x.
LinkSpec weight(const std::string& name, double mass, JointType type, double x = 0, double z = 0) {
  LinkSpec link;
  link.name = name;
  link.joint = name + "_joint";
  link.type = type;
  link.placement.translation() = Eigen::Vector3d(x, 0, z);
  link.inertia = sphere_inertia(mass, 0.05, Eigen::Vector3d::Zero());
  return link;
}

Model with_cable(const TreeBuilder& builder, std::vector<CablePlace> through) {
  CouplingSpec cable;
  cable.name = "cable";
  cable.kind = CouplingKind::cable;
  cable.through = std::move(through);
  return coupled(builder.build(), {cable});
}

Index length_row(const Model& model) { return model.tree.first_v(model.names.slot_of_joint.at("cable")); }
double length_of(const Simulation& simulation) {
  const Model& model = simulation.model();
  return simulation.positions()[static_cast<std::size_t>(model.tree.first_q(model.names.slot_of_joint.at("cable")))];
}

std::size_t first_q(const Model& model, const char* joint) { return static_cast<std::size_t>(model.tree.first_q(model.names.slot_of_joint.at(joint))); }
std::size_t first_v(const Model& model, const char* joint) { return static_cast<std::size_t>(model.tree.first_v(model.names.slot_of_joint.at(joint))); }
/// x, y or z of the hanging weight against where it begins.
double moved(const Simulation& simulation, std::size_t k) { return simulation.positions()[first_q(simulation.model(), "load_joint") + k]; }
void move(Simulation& simulation, double x, double z) {
  std::vector<double> q(simulation.positions().begin(), simulation.positions().end());
  const std::size_t first = first_q(simulation.model(), "load_joint");
  q[first] = x;
  q[first + 2] = z;
  simulation.set_positions(q);
}

Effects no_longer(const Model& model, double length) {
  Effects effects;
  effects.limits.push_back({.row = length_row(model), .upper = length});
  return effects;
}

/// Atwood's machine: weights of 1 and 2 kg on slides, over a hook between them.
Model atwood() {
  TreeBuilder builder("atwood");
  builder.add(weight("light", 1, JointType::prismatic, -0.5)).add(weight("heavy", 2, JointType::prismatic, 0.5));
  return with_cable(builder, {{"light", {0, 0, 0}}, {"world", {-0.5, 0, 3}}, {"world", {0.5, 0, 3}}, {"heavy", {0, 0, 0}}});
}

/// A free weight below the origin.
Model hanging(double mass = 2) {
  TreeBuilder builder("hanging");
  builder.add(weight("load", mass, JointType::free, 0, -1));
  return with_cable(builder, {{"world", {0, 0, 0}}, {"load", {0, 0, 0}}});
}

double force_in(const Simulation& simulation) { return simulation.couplings().front().forces.front(); }

}  // namespace

TEST_CASE("Two weights on a cable over a hook fall as Atwood's machine does", "[cable]") {
  const Model model = atwood();
  Simulation simulation(model, {.step = 1e-3}, no_longer(model, 7));
  CHECK(length_of(simulation) == Approx(7).epsilon(1e-15));
  REQUIRE(simulation.run(1000).ok());
  const double fallen = 0.5 * kGravity * (2 - 1) / (2 + 1);
  const std::span<const double> q = simulation.positions();
  const auto z = [&](const char* joint) { return q[first_q(model, joint)]; };
  CHECK(z("light_joint") == Approx(fallen).epsilon(2e-6));
  CHECK(z("heavy_joint") == Approx(-fallen).epsilon(2e-6));
  CHECK(length_of(simulation) == Approx(7).epsilon(1e-12));
  CHECK(std::abs(force_in(simulation)) == Approx(2 * 1 * 2 * kGravity / 3).epsilon(1e-5));
}

TEST_CASE("A weight hangs still on a cable whose tension is its weight", "[cable]") {
  const Model model = hanging();
  Simulation simulation(model, {.step = 2e-3}, no_longer(model, 1));
  REQUIRE(simulation.run(5000).ok());
  CHECK(std::abs(force_in(simulation)) == Approx(2 * kGravity).epsilon(1e-9));
  CHECK(moved(simulation, 2) == Approx(0).margin(1e-11));
  for (const double v : simulation.velocities()) CHECK(std::abs(v) < 1e-12);
}

TEST_CASE("A pendulum on a cable has a pendulum's period, and falls freely while it is slack", "[cable]") {
  const Model model = hanging();
  Simulation simulation(model, {.step = 1e-3}, no_longer(model, 1));
  const double angle = 0.3;
  move(simulation, std::sin(angle), 1 - std::cos(angle));
  CHECK(length_of(simulation) == Approx(1).epsilon(1e-14));
  // the weight itself does not turn: a mathematical pendulum, whose period is this series in the angle
  const double period = 2 * std::numbers::pi / std::sqrt(kGravity) * (1 + angle * angle / 16 + 11 * std::pow(angle, 4) / 3072);
  const double before = simulation.energy().total();
  double last = moved(simulation, 0);
  int passed = 0;
  double first = 0, now = 0;
  for (int k = 0; k < 12'000 && passed < 11; ++k) {
    REQUIRE(simulation.step().ok());
    const double x = moved(simulation, 0);
    if (last > 0 && x <= 0) {
      now = simulation.time() - 1e-3 * (0 - x) / (last - x);
      if (passed++ == 0) first = now;
    }
    last = x;
  }
  REQUIRE(passed > 3);
  CHECK((now - first) / (passed - 1) == Approx(period).epsilon(1e-5));
  CHECK(simulation.energy().total() == Approx(before).margin(1e-5));
  CHECK(length_of(simulation) <= 1 + 1e-12);

  // thrown up it is slack, a stone; where it comes to its end again the cable takes what would stretch it
  Simulation thrown(model, {.step = 1e-3}, no_longer(model, 1));
  std::vector<double> v(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
  v[first_v(model, "load_joint") + 5] = 3;
  thrown.set_velocities(v);
  REQUIRE(thrown.run(300).ok());
  CHECK(moved(thrown, 2) == Approx(3 * 0.3 - 0.5 * kGravity * 0.09).epsilon(2 * kCableMass));
  CHECK(std::abs(force_in(thrown)) < 2 * kCableMass * 2 * kGravity);
  const double whole = thrown.energy().total();
  REQUIRE(thrown.run(700).ok());
  CHECK(moved(thrown, 2) == Approx(0).margin(1e-9));
  CHECK(whole - thrown.energy().total() == Approx(0.5 * 2 * 9).epsilon(1e-3));
}

TEST_CASE("A small ball that its cable whips round, over and over, gains nothing: steps that do not follow it are split", "[cable]") {
  // it hangs by a point off its middle, about which it turns round within a step wherever the cable comes taut across it
  TreeBuilder builder("whipped");
  LinkSpec load = weight("load", 1.7, JointType::free);
  load.inertia = sphere_inertia(1.7, 0.0125, Eigen::Vector3d::Zero());
  builder.add(load);
  const Model model = with_cable(builder, {{"world", {0, 0, 0}}, {"load", {0, 0, 0.05}}});
  const std::size_t first = first_v(model, "load_joint");
  Random random(1);
  double most = 0;
  std::int64_t split = 0;
  for (int start = 0; start < 20; ++start) {
    Simulation simulation(model, {.step = 3e-3}, no_longer(model, 0.4));
    move(simulation, 0.35, 0);
    std::vector<double> v(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      v[first + k] = random.uniform(-20, 20);
      v[first + 3 + k] = random.uniform(-1, 1);
    }
    simulation.set_velocities(v);
    const double lowest = -1.7 * kGravity * 0.45, begin = simulation.energy().total() - lowest;
    for (int k = 0; k < 1000; ++k) {
      const StepReport report = simulation.step();
      REQUIRE(report.ok());
      split += report.substeps > 1 ? 1 : 0;
      most = std::max(most, (simulation.energy().total() - lowest) / begin);
    }
  }
  CAPTURE(split);
  CHECK(most < 1.2);
}

TEST_CASE("A weight on an elastic cable bounces with the period of its spring and flight", "[cable]") {
  const Model model = hanging();
  Effects effects;
  constexpr double kStiffness = 2000;
  effects.dead_zone_springs.push_back({.row = length_row(model), .stiffness = kStiffness, .half_width = 0.5, .rest = 0.5});
  const auto lowest = [&](double h) {
    Simulation simulation(model, {.step = h}, effects);
    move(simulation, 0, 0.5);  // half a metre below the hook, slack
    const double before = simulation.energy().total();
    double least = 0;
    for (int k = 0; k < std::lround(2 / h); ++k) {
      REQUIRE(simulation.step().ok());
      least = std::min(least, moved(simulation, 2));
    }
    CHECK(simulation.energy().total() == Approx(before).margin(0.02 * 2 * kGravity));
    return least;
  };
  // m g (0.5 + x) = k x^2 / 2
  const double weight = 2 * kGravity, exact = (weight + std::sqrt(weight * weight + kStiffness * weight)) / kStiffness;
  CHECK(-lowest(1e-3) == Approx(exact).epsilon(2e-3));
  CHECK(-lowest(2e-4) == Approx(exact).epsilon(2e-4));
}

TEST_CASE("A weight caught by an elastic cable never gains, at any stiffness, step and mass", "[cable]") {
  constexpr double kFall = 0.5;
  for (const double mass : {1e-3, 1.0, 200.0}) {
    const Model model = hanging(mass);
    for (const double step : {1e-4, 1e-3, 1e-2}) {
      for (double stiffness = 1e4; stiffness < 2e9; stiffness *= 10) {
        CAPTURE(mass, step, stiffness);
        Effects effects;
        effects.dead_zone_springs.push_back({.row = length_row(model), .stiffness = stiffness, .half_width = 0.5, .rest = 0.5});
        Simulation simulation(model, {.step = step}, effects);
        move(simulation, 0, kFall);
        const double before = simulation.energy().total(), scale = mass * kGravity * kFall;
        double most = before;
        for (int k = 0; k < 2000; ++k) {
          REQUIRE(simulation.step().ok());
          most = std::max(most, simulation.energy().total());
        }
        CHECK(most - before < 1e-6 * scale);
        CHECK(simulation.passive_gifts().empty());
        CHECK(simulation.energy().total() + simulation.effect_work().taken() - before == Approx(0).margin(0.12 * scale));
        const double ratio = step * step * stiffness / mass;
        if (ratio < 0.9) CHECK(simulation.effect_work().taken() == 0);
        if (ratio > 100 && step > 5e-4) CHECK(simulation.effect_work().taken() == Approx(scale).epsilon(0.05));  // it hangs
      }
    }
  }
}

TEST_CASE("Two weights on an elastic cable over a hook, and a weight that swings into one, do not gain", "[cable]") {
  for (const double stiffness : {1e4, 1e5, 1e6, 1e8}) {
    for (const double step : {1e-3, 4e-3}) {
      CAPTURE(stiffness, step);
      const auto most_gain = [&](Simulation simulation, int steps) {
        const double before = simulation.energy().total();
        double most = before;
        for (int k = 0; k < steps; ++k) {
          REQUIRE(simulation.step().ok());
          most = std::max(most, simulation.energy().total());
        }
        CHECK(simulation.passive_gifts().empty());
        return most - before;
      };
      const Model lift = atwood();
      Effects over_hook;
      over_hook.dead_zone_springs.push_back({.row = length_row(lift), .stiffness = stiffness, .half_width = 3.6, .rest = 3.6});
      CHECK(most_gain(Simulation(lift, {.step = step}, over_hook), static_cast<int>(1 / step)) < 1e-4 * kGravity);

      const Model model = hanging();
      Effects effects;
      effects.dead_zone_springs.push_back({.row = length_row(model), .stiffness = stiffness, .half_width = 0.5, .rest = 0.5});
      Simulation swings(model, {.step = step}, effects);
      move(swings, 0.7, 0.6);
      CHECK(most_gain(std::move(swings), static_cast<int>(10 / step)) < 0.01 * 2 * kGravity);
    }
  }
}

TEST_CASE("The damping of an elastic cable acts while it is stretched and never pushes", "[cable]") {
  const Model model = hanging();
  Effects effects;
  effects.dead_zone_springs.push_back({.row = length_row(model), .stiffness = 2000, .half_width = 0.5, .rest = 0.5, .damping = 60});
  Simulation simulation(model, {.step = 1e-3}, effects);
  move(simulation, 0, 0.5);
  const double before = simulation.energy().total();
  REQUIRE(simulation.run(300).ok());
  CHECK(length_of(simulation) < 1);
  CHECK(moved(simulation, 2) == Approx(0.5 - 0.5 * kGravity * 0.09).margin(kCableMass));  // slack it falls freely
  for (int k = 0; k < 5000; ++k) {
    REQUIRE(simulation.step().ok());
    REQUIRE(force_in(simulation) < 1e-4);  // it pulls, but for the acceleration of its own mass
  }
  CHECK(moved(simulation, 2) == Approx(-2 * kGravity / 2000).epsilon(1e-6));
  CHECK(simulation.energy().total() + simulation.effect_work().of<DeadZoneSpring>() == Approx(before).margin(1e-3));
}

TEST_CASE("A winch lifts its weight by the motion of the cable's length", "[cable]") {
  const Model model = hanging();
  Effects effects;
  effects.motions.push_back({.row = length_row(model), .position = {{0.0, 1.0}, {1.0, 0.7}}});
  Simulation simulation(model, {.step = 1e-3}, effects);
  REQUIRE(simulation.run(1000).ok());
  CHECK(length_of(simulation) == Approx(0.7).epsilon(1e-12));
  CHECK(moved(simulation, 2) == Approx(0.3).epsilon(1e-6));
}

TEST_CASE("A tendon pulls a finger as its moment arms say", "[cable]") {
  TreeBuilder builder("finger");
  builder.add(bar("lower", "", {0, 0, 0}, {1, 0, 0})).add(bar("upper", "lower", {1, 0, 0}, {1, 0, 0}));
  const Model model = with_cable(builder, {{"world", {-0.1, 0, 0.1}}, {"lower", {0.2, 0, 0.1}}, {"lower", {0.8, 0, 0.1}}, {"upper", {0.3, 0, 0.1}}});
  constexpr double kTension = 30;
  Effects pulled;
  pulled.torques.push_back({.row = length_row(model), .force = {{0.0}, {-kTension}}});
  Simulation simulation(model, {.step = 1e-4}, pulled);
  REQUIRE(simulation.run(3000).ok());

  // the same without a cable: - tension d length / d q on each joint, by differences
  const Model bare = TreeBuilder("finger").add(bar("lower", "", {0, 0, 0}, {1, 0, 0})).add(bar("upper", "lower", {1, 0, 0}, {1, 0, 0})).build();
  const auto length = [](double a, double b) {
    using V = Eigen::Vector2d;
    const auto turned = [](double angle, const V& x) { return V(std::cos(angle) * x.x() + std::sin(angle) * x.y(), -std::sin(angle) * x.x() + std::cos(angle) * x.y()); };
    const V hook(-0.1, 0.1), one = turned(a, V(0.2, 0.1)), two = turned(a, V(0.8, 0.1)), tip = turned(a, V(1, 0)) + turned(a + b, V(0.3, 0.1));
    return (one - hook).norm() + (two - one).norm() + (tip - two).norm();
  };
  Simulation plain(bare, {.step = 1e-5});  // what is given here acts as it is at the beginning of each step
  constexpr double kSmall = 1e-6;
  for (int k = 0; k < 30'000; ++k) {
    const double a = plain.positions()[0], b = plain.positions()[1];
    const std::vector<double> force{-kTension * (length(a + kSmall, b) - length(a - kSmall, b)) / (2 * kSmall),
                                    -kTension * (length(a, b + kSmall) - length(a, b - kSmall)) / (2 * kSmall)};
    plain.set_forces(force);
    REQUIRE(plain.step().ok());
  }
  CHECK(std::abs(plain.positions()[0]) > 0.05);
  for (const char* joint : {"lower_joint", "upper_joint"}) {
    CAPTURE(joint);
    const auto at = [&](const Simulation& of) { return of.positions()[first_q(of.model(), joint)]; };
    CHECK(at(simulation) == Approx(at(plain)).epsilon(1e-4));
  }
}

TEST_CASE("Bodies tied by a cable in free fall keep their momentum to rounding", "[cable]") {
  TreeBuilder builder("bolas");
  builder.add(weight("one", 1, JointType::free)).add(weight("two", 3, JointType::free, 0.6)).add(weight("three", 2, JointType::free, 0.6, 0.7));
  const Model model = with_cable(builder, {{"one", {0.02, 0, 0}}, {"two", {0, 0, 0.03}}, {"three", {0, 0.01, 0}}});
  Simulation simulation(model, {.step = 1e-3, .gravity = {0, 0, 0}}, no_longer(model, 1.5));
  std::vector<double> v(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
  Random random(3);
  for (double& one : v) one = random.uniform(-2, 2);
  simulation.set_velocities(v);
  const Momentum before = simulation.momentum();
  const double kinetic = simulation.energy().kinetic;
  int taut = 0;
  for (int k = 0; k < 5000; ++k) {
    REQUIRE(simulation.step().ok());
    REQUIRE(length_of(simulation) < 1.5 + 1e-9);
    taut += length_of(simulation) > 1.5 - 1e-9 ? 1 : 0;
  }
  CHECK(taut > 100);
  CHECK(simulation.energy().kinetic <= kinetic * (1 + 1e-9));
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(simulation.momentum().linear[k] == Approx(before.linear[k]).margin(1e-9));
    CHECK(simulation.momentum().angular[k] == Approx(before.angular[k]).margin(1e-9));
  }
}

TEST_CASE("Cables step in a batch as alone, in doubles", "[cable]") {
  const Model model = atwood();
  const Effects effects = no_longer(model, 7.2);  // slack at first
  constexpr Options options{.step = 1e-3};
  Batch batch(model, 7, options, effects);
  Simulation alone(model, options, effects);
  batch.step(800);
  REQUIRE(alone.run(800).ok());
  for (std::size_t k = 0; k < alone.positions().size(); ++k) {
    for (std::int64_t i = 0; i < 7; ++i) CHECK(batch.positions()(i, static_cast<Index>(k)) == Approx(alone.positions()[k]).margin(1e-8));
  }
}

TEST_CASE("A cable that cannot be is refused by name", "[cable]") {
  TreeBuilder builder("hanging");
  builder.add(weight("load", 1, JointType::free));
  const auto refused = [&](std::vector<CablePlace> through, const std::string& why) {
    CHECK_THROWS_WITH(with_cable(builder, std::move(through)), Contains(why));
  };
  refused({{"world", {0, 0, 0}}}, "coupling \"cable\": it goes through 1 points; expected two or more");
  refused({{"load", {0, 0, 0}}, {"load", {0, 0, 1}}}, "all of its points are on one body");
  refused({{"world", {0, 0, 0}}, {"lod", {0, 0, 1}}}, "has no link \"lod\"; did you mean \"load\"?");
  CouplingSpec soft;
  soft.name = "soft";
  soft.kind = CouplingKind::cable;
  soft.through = {{"world", {0, 0, 0}}, {"load", {0, 0, 0}}};
  soft.shift = {100, 0};
  CHECK_THROWS_WITH(coupled(builder.build(), {soft}), Contains("a cable stretches by a spring on its length"));
}

}  // namespace linden::cable_test
