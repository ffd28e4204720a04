// Couplings that give way: springs and dampers between bodies, soft joints.
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include "engine/batch.hpp"
#include "engine/simulation.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/mechanisms.hpp"

namespace linden::compliance_test {
namespace {

Options weightless(double h) {
  Options options{.step = h};
  options.gravity = {0, 0, 0};
  return options;
}

LinkSpec ball_of(const std::string& name, double mass, JointType type) {
  LinkSpec link;
  link.name = name;
  link.joint = name + "_joint";
  link.type = type;
  link.axis = Eigen::Vector3d::UnitZ();
  link.inertia = {mass, Eigen::Vector3d::Zero(), 0.1 * mass * Eigen::Matrix3d::Identity()};
  return link;
}

/// Two free balls of 1 and 2 kg, tied between points 0.1 m off their centres.
Model two_balls(double stiffness, double damping, double rest = 0.5) {
  TreeBuilder builder("two balls");
  builder.add(ball_of("a", 1, JointType::free));
  builder.add(ball_of("b", 2, JointType::free));
  CouplingSpec spring{.name = "spring", .kind = CouplingKind::rod, .link_a = "a", .link_b = "b", .length = rest, .shift = {stiffness, damping}};
  spring.frame_a.translation() = Eigen::Vector3d(0, 0.1, 0);
  spring.frame_b.translation() = Eigen::Vector3d(0, 0, 0.1);
  return coupled(builder.build(), {spring});
}

std::vector<double> apart(double distance) {
  std::vector<double> q(14, 0.0);
  q[6] = q[13] = 1;
  q[7] = distance;
  return q;
}

/// A body of 2 kg that slides upright, tied to the world along its way.
Model slider(double stiffness, double damping) {
  TreeBuilder builder("slider");
  builder.add(ball_of("body", 2, JointType::prismatic));
  CouplingSpec spec{.name = "spring", .kind = CouplingKind::point_on_plane, .link_a = "", .link_b = "body", .shift = {stiffness, damping}};
  return coupled(builder.build(), {spec});
}

double balance(Simulation& simulation) { return simulation.energy().total() + simulation.effect_work().taken(); }

}  // namespace

TEST_CASE("What a spring between two bodies does keeps their momenta to rounding, and their energy in a band of second order") {
  const auto band = [](double stiffness, double h, double seconds) {
    Simulation simulation(two_balls(stiffness, 0), weightless(h));
    simulation.set_positions(apart(0.7));
    simulation.set_velocities(std::vector{0.3, -0.2, 0.5, 0.1, 0.4, 0.0, -0.4, 0.1, 0.2, 0.0, -0.3, 0.2});
    const Momentum before = simulation.momentum();
    const double start = simulation.energy().total();
    double widest = 0;
    for (int k = 0; k < seconds / h; ++k) {
      const StepReport report = simulation.step();
      INFO(simulation.describe(report));
      REQUIRE(report.ok());
      widest = std::max(widest, std::abs(simulation.energy().total() - start));
    }
    const Momentum after = simulation.momentum();
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(after.linear[k] == Approx(before.linear[k]).margin(2e-12));
      CHECK(after.angular[k] == Approx(before.angular[k]).margin(2e-12));
    }
    CHECK(simulation.effect_work().couplings == 0);
    return widest / start;
  };
  for (const double stiffness : {1.0, 100.0}) {
    CAPTURE(stiffness);
    const double whole = band(stiffness, 1e-2, 5), half = band(stiffness, 5e-3, 5);
    CHECK(whole < 2e-2);
    CHECK(half == Approx(whole / 4).epsilon(0.15));
  }
}

TEST_CASE("Stiff springs keep momenta, give no energy and hold as rods do") {
  Model rigid = two_balls(0, 0);
  const auto end = [](const Model& model, double& given, double& open) {
    Simulation simulation(model, weightless(1e-3));
    simulation.set_positions(apart(std::sqrt(0.25 - 0.02)));
    simulation.set_velocities(std::vector{0.3, -0.2, 0.5, 0.0, 0.4, 0.0, -0.4, 0.1, 0.2, 0.0, -0.3, 0.2});
    const Momentum before = simulation.momentum();
    const double start = balance(simulation);
    for (int k = 0; k < 1000; ++k) {
      REQUIRE(simulation.step().ok());
      given = std::max(given, balance(simulation) - start);
      for (const CouplingState& state : simulation.couplings()) open = std::max(open, std::abs(state.gaps[0]));
    }
    const Momentum after = simulation.momentum();
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(after.linear[k] == Approx(before.linear[k]).margin(1e-11));
      CHECK(after.angular[k] == Approx(before.angular[k]).margin(1e-11));
    }
    return std::vector<double>(simulation.positions().begin(), simulation.positions().end());
  };
  double unused = 0, closed = 0;
  const std::vector<double> rod = end(rigid, unused, closed);
  CHECK(closed < 1e-13);
  for (const double stiffness : {1e7, 1e9, 1e12}) {
    CAPTURE(stiffness);
    double given = 0, open = 0;
    const std::vector<double> spring = end(two_balls(stiffness, 0), given, open);
    CHECK(given < 1e-5);
    CHECK(open < 200 / stiffness);
    for (std::size_t k = 0; k < rod.size(); ++k) CHECK(spring[k] == Approx(rod[k]).margin(1e-6 + 1e3 / stiffness));
  }
}

TEST_CASE("A body on a spring swings, settles where its weight is borne, and reads as standing there, at any stiffness and damping") {
  for (const double h : {1e-3, 1e-2}) {
    for (const double stiffness : {50.0, 5e4, 5e8}) {
      for (const double damping : {2.0, 500.0, 1e6}) {
        if (damping > 100 * stiffness) continue;  // creeps for hours
        CAPTURE(h, stiffness, damping);
        Simulation simulation(slider(stiffness, damping), {.step = h});
        const double start = balance(simulation);
        double loss = 0;
        for (int k = 0; k < 60 / h; ++k) {
          REQUIRE(simulation.step().ok());
          CHECK(simulation.effect_work().couplings >= loss);
          loss = simulation.effect_work().couplings;
        }
        const double sag = 2 * 9.81 / stiffness;
        // where steps do not resolve it, what moved at first is not known to them
        CHECK(balance(simulation) == Approx(start).margin(h * h * stiffness / 2 < 1 ? 2e-2 * loss + 1e-9 : 2 * 9.81 * sag));
        if (damping < 10 * std::sqrt(stiffness)) {
          CHECK(simulation.positions()[0] == Approx(-sag).epsilon(1e-9));
          CHECK(std::abs(simulation.velocities()[0]) < 1e-9);
          CHECK(simulation.couplings()[0].forces[0] == Approx(2 * 9.81).epsilon(1e-9));
        }
      }
    }
  }
}

TEST_CASE("A body that falls against a damper reads its terminal velocity, however stiff the damper is") {
  for (const double damping : {10.0, 1e3, 1e5}) {
    CAPTURE(damping);
    Simulation simulation(slider(0, damping), {.step = 1e-2});
    const double terminal = -2 * 9.81 / damping;
    REQUIRE(simulation.run(1000).ok());
    CHECK(simulation.velocities()[0] == Approx(terminal).epsilon(1e-6));
    CHECK(simulation.energy().kinetic == Approx(terminal * terminal).epsilon(1e-5));
    Batch batch(slider(0, damping), 5, {.step = 1e-2});
    batch.step(1000);
    CHECK(batch.observe().velocities()(3, 0) == Approx(simulation.velocities()[0]).epsilon(1e-10));
    CHECK(batch.observe().energies()(3, 0) == Approx(simulation.energy().kinetic).epsilon(1e-9));
  }
}

TEST_CASE("A state with stretched springs reads as it was set") {
  for (const double stiffness : {10.0, 1e6, 1e9}) {
    CAPTURE(stiffness);
    Simulation simulation(two_balls(stiffness, 0.01 * stiffness), weightless(1e-2));
    simulation.set_positions(apart(0.8));
    for (const double v : simulation.velocities()) CHECK(std::abs(v) < 1e-12);
    const std::vector<double> given{0.3, -0.2, 0.5, 0.1, 0.4, 0.0, -0.4, 0.1, 0.2, 0.0, -0.3, 0.2};
    simulation.set_velocities(given);
    const std::vector<double> read = simulation.velocities();
    for (std::size_t k = 0; k < given.size(); ++k) CHECK(read[k] == Approx(given[k]).margin(1e-9));
  }
}

TEST_CASE("What starts with a stretched spring, however stiff, begins at rest and moves the same alone and in a batch") {
  TreeBuilder builder("stretched");
  builder.add(ball_of("body", 2, JointType::prismatic));
  CouplingSpec spec{.name = "spring", .kind = CouplingKind::rod, .link_a = "", .link_b = "body", .length = 0.5, .shift = {1e7, 10}};
  spec.frame_a.translation() = Eigen::Vector3d(0, 0, 0.6);
  const Model model = coupled(builder.build(), {spec});
  Simulation simulation(model, {.step = 1e-2});
  Batch batch(model, 3, {.step = 1e-2});
  CHECK(std::abs(simulation.velocities()[0]) < 1e-12);
  CHECK(std::abs(batch.observe().velocities()(1, 0)) < 1e-12);
  REQUIRE(simulation.run(100).ok());
  batch.step(100);
  CHECK(batch.positions()(1, 0) == Approx(simulation.positions()[0]).epsilon(1e-10));
  CHECK(simulation.positions()[0] == Approx(0.1).epsilon(1e-3));
}

TEST_CASE("What rests on a stiff spring is not kicked where a step is cut in parts") {
  // another body bounces on its limit, so that steps end where it does
  TreeBuilder builder("resting");
  builder.add(ball_of("body", 2, JointType::prismatic));
  builder.add(ball_of("bouncing", 1, JointType::prismatic));
  CouplingSpec spec{.name = "spring", .kind = CouplingKind::point_on_plane, .link_a = "", .link_b = "body", .shift = {5e5, 500}};
  Effects effects;
  JointLimit floor;
  floor.row = 1;
  floor.lower = -0.1;
  floor.upper = 10;
  floor.restitution = 1;
  effects.limits.push_back(floor);
  const Model model = coupled(builder.build(), {spec});
  Simulation simulation(model, {.step = 1e-2}, effects);
  simulation.set_positions(std::vector{-2 * 9.81 / 5e5, 0.5});
  REQUIRE(simulation.run(20).ok());
  int blows = 0;
  for (int k = 0; k < 300; ++k) {
    const StepReport report = simulation.step();
    REQUIRE(report.ok());
    blows += report.blows;
    CHECK(std::abs(simulation.velocities()[0]) < 1e-8);
  }
  CHECK(blows >= 4);
}

TEST_CASE("A spring without a length pulls where both points meet") {
  TreeBuilder builder("anchored");
  builder.add(ball_of("body", 2, JointType::free));
  CouplingSpec spec{.name = "anchor", .kind = CouplingKind::ball, .link_a = "", .link_b = "body", .shift = {200, 0}};
  Simulation simulation(coupled(builder.build(), {spec}), weightless(1e-3));
  simulation.set_velocities(std::vector{0.0, 0.0, 0.0, 0.5, 0.0, 0.0});
  const double period = 2 * std::numbers::pi / 10;
  REQUIRE(simulation.run(std::llround(period / 4 / 1e-3)).ok());
  CHECK(simulation.positions()[0] == Approx(0.05).epsilon(1e-4));
  REQUIRE(simulation.run(std::llround(period * 10.5 / 1e-3) - std::llround(period / 4 / 1e-3)).ok());
  CHECK(simulation.positions()[0] == Approx(0.05 * std::sin(10 * simulation.time())).margin(1e-4));
}

TEST_CASE("Two rotors on a soft shaft turn against each other at its frequency") {
  TreeBuilder builder("shaft");
  for (const std::string name : {"a", "b"}) {
    LinkSpec rotor = ball_of(name, 1, JointType::revolute);
    rotor.inertia.about_center = (name == "a" ? 0.1 : 0.3) * Eigen::Matrix3d::Identity();
    builder.add(rotor);
  }
  CouplingSpec shaft;
  shaft.kind = CouplingKind::gear;
  shaft.joints = {{"a_joint", 1}, {"b_joint", -1}};
  shaft.turn = {30, 0};
  Simulation simulation(coupled(builder.build(), {shaft}), weightless(1e-3));
  simulation.set_velocities(std::vector{1.0, 0.0});
  const double w = std::sqrt(30 * (1 / 0.1 + 1 / 0.3));
  for (int k = 0; k < 500; ++k) {
    REQUIRE(simulation.step().ok());
    const double t = simulation.time(), twist = simulation.positions()[0] - simulation.positions()[1];
    CHECK(twist == Approx(std::sin(w * t) / w).margin(2e-5));
    CHECK(0.1 * simulation.velocities()[0] + 0.3 * simulation.velocities()[1] == Approx(0.1).epsilon(1e-12));
  }
}

TEST_CASE("A four-bar with a soft hinge for its pin moves nearly as one with a hinge, alone and in lanes") {
  const auto four = [](double stiffness) {
    TreeBuilder builder("four-bar");
    builder.add(bar("crank", "", {0, 0, 0}, {0, 0, 1}));
    builder.add(bar("coupler", "crank", {0, 0, 1}, {2, 0, 1}));
    builder.add(bar("rocker", "", {3, 0, 0}, {-1, 0, 2}));
    CouplingSpec pin{.name = "pin", .kind = CouplingKind::hinge, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}};
    if (stiffness > 0) pin.shift = {stiffness, 1e-4 * stiffness};
    if (stiffness > 0) pin.turn = {stiffness, 1e-4 * stiffness};
    return coupled(builder.build(), {pin});
  };
  Simulation closed(four(0), {.step = 1e-3});
  closed.set_velocities(std::vector{1.0, 0.0, 0.0});
  const auto end = [&](double stiffness) {
    Simulation simulation(four(stiffness), {.step = 1e-3});
    simulation.set_velocities(closed.velocities());
    REQUIRE(simulation.run(800).ok());
    return simulation.positions()[0];
  };
  const double hinge = end(0);
  CHECK(end(1e6) == Approx(hinge).epsilon(1e-3));
  CHECK(end(1e9) == Approx(hinge).epsilon(1e-5));

  Simulation alone(four(1e4), {.step = 1e-3});
  alone.set_velocities(std::vector{1.0, 0.0, 0.0});
  const std::vector<double> start(alone.positions().begin(), alone.positions().end()), rates = alone.velocities();
  Batch batch(four(1e4), 9, {.step = 1e-3});
  for (std::int64_t i = 0; i < 9; ++i) batch.reset(i, start, rates);
  batch.step(300);
  REQUIRE(alone.run(300).ok());
  CHECK(batch.summary().frozen == 0);
  for (Index row = 0; row < 3; ++row) {
    CHECK(batch.positions()(7, row) == Approx(alone.positions()[static_cast<std::size_t>(row)]).epsilon(1e-10));
    CHECK(batch.observe().velocities()(7, row) == Approx(alone.velocities()[static_cast<std::size_t>(row)]).epsilon(1e-8));
  }
  CHECK(batch.observe().energies()(7, 0) == Approx(alone.energy().kinetic).epsilon(1e-8));
  CHECK(batch.observe().energies()(7, 1) == Approx(alone.energy().potential).epsilon(1e-8));
}

TEST_CASE("Springs between bodies are of the order that is asked for, and dampers are refused above order 2") {
  const auto end = [](double h, int order) {
    Options options = weightless(h);
    options.order = order;
    use_default_tolerance(options);
    Simulation simulation(two_balls(50, 0), options);
    simulation.set_positions(apart(0.7));
    simulation.set_velocities(std::vector{0.3, -0.2, 0.5, 0.1, 0.4, 0.0, -0.4, 0.1, 0.2, 0.0, -0.3, 0.2});
    REQUIRE(simulation.run(std::llround(1 / h)).ok());
    return simulation.positions()[7];
  };
  const double exact = end(5e-3, 8);
  CHECK((end(1e-2, 2) - exact) / (end(5e-3, 2) - exact) == Approx(4).epsilon(0.05));
  CHECK((end(4e-2, 4) - exact) / (end(2e-2, 4) - exact) == Approx(16).epsilon(0.25));
  Options fourth = weightless(1e-3);
  fourth.order = 4;
  CHECK_THROWS_WITH(Simulation(two_balls(50, 1), fourth), Catch::Contains("the damping of coupling \"spring\""));
}

TEST_CASE("What is no spring is refused by name") {
  CHECK_THROWS_WITH(two_balls(-1, 0), Catch::Contains("\"spring\"") && Catch::Contains("-1"));
  TreeBuilder builder("one");
  builder.add(ball_of("body", 2, JointType::free));
  CouplingSpec spec{.name = "pin", .kind = CouplingKind::ball, .link_a = "", .link_b = "body", .turn = {5, 0}};
  CHECK_THROWS_WITH(coupled(builder.build(), {spec}), Catch::Contains("a ball has nothing that turns"));
}

}  // namespace linden::compliance_test
