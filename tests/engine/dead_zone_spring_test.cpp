// Springs with a dead zone: the period between two of them, their energy, and their limits at no zone and at one that is never left.
#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <numbers>

#include "engine/baseline/baseline.hpp"
#include "engine/batch.hpp"
#include "engine/scene/scene_file.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/builder.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/reference/plain_scene.hpp"

namespace linden::dead_zone_spring_test {
namespace {

constexpr double kMass = 2, kStiffness = 500, kHalfWidth = 0.02, kRest = 0.1, kSpeed = 0.5;  // [kg, N/m, m, m, m/s]
constexpr double kEnergy = 0.5 * kMass * kSpeed * kSpeed;

/// A mass on a rail.
Model slider() {
  LinkSpec link;
  link.name = "link";
  link.joint = "joint";
  link.type = JointType::prismatic;
  link.axis = Eigen::Vector3d::UnitX();
  link.inertia = {kMass, Eigen::Vector3d::Zero(), 0.01 * Eigen::Matrix3d::Identity()};
  return TreeBuilder("slider").add(link).build();
}

Effects between_springs(double half_width = kHalfWidth) {
  Effects effects;
  effects.dead_zone_springs = {{.row = 0, .stiffness = kStiffness, .half_width = half_width, .rest = kRest}};
  return effects;
}

Simulation released(double step, const Effects& effects = between_springs()) {
  Simulation simulation(slider(), {.step = step, .gravity = {0, 0, 0}}, effects);
  simulation.set_positions(std::vector{kRest});
  simulation.set_velocities(std::vector{kSpeed});
  return simulation;
}

/// Mean over ten of them, from one passage through the middle to the next.
double period(double step) {
  constexpr int kPeriods = 10;
  Simulation simulation = released(step);
  double last = kRest;
  for (int passages = 0;;) {
    run(simulation, 1);
    const double now = simulation.positions()[0];
    if (last < kRest && now >= kRest && ++passages == kPeriods) return (simulation.time() - step * (now - kRest) / (now - last)) / kPeriods;
    last = now;
  }
}

}  // namespace

TEST_CASE("a mass between two springs has the period of its swing in them and its flight between them, to second order", "[dead_zone_spring]") {
  const double exact = 2 * std::numbers::pi * std::sqrt(kMass / kStiffness) + 4 * kHalfWidth / kSpeed;
  const double coarse = std::abs(period(2e-3) - exact), fine = std::abs(period(1e-3) - exact);
  CHECK(fine < 2e-5 * exact);
  CHECK(coarse / fine == Approx(4).epsilon(0.1));
}

TEST_CASE("its energy swings by what a step makes of the edge that it crosses, and does not drift", "[dead_zone_spring]") {
  constexpr double kStep = 1e-3, kOfAnEdge = kStiffness * kStep * kSpeed * kStep * kSpeed / 8;
  Simulation simulation = released(kStep);
  const auto strayed = [&] { return simulation.energy().total() - kEnergy; };
  CHECK(strayed() == Approx(0).margin(1e-13));
  double early = 0, late = 0, stored = 0;
  for (int k = 0; k < 100'000; ++k) {
    run(simulation, 1);
    double& most = k < 10'000 ? early : late;
    most = std::max(most, std::abs(strayed()));
    stored = std::max(stored, simulation.energy().springs);
  }
  CHECK(stored == Approx(kEnergy).epsilon(1e-3));
  CHECK(early > 0.2 * kOfAnEdge);  // it does cross them
  CHECK(early < 1.1 * kOfAnEdge);
  CHECK(late < 1.1 * kOfAnEdge);
  CHECK(simulation.effect_work().magnitude() == 0);
}

TEST_CASE("without a zone it is a spring, in one that is never left it is nothing", "[dead_zone_spring]") {
  Effects spring;
  spring.springs = {{.row = 0, .stiffness = kStiffness, .rest = kRest}};
  Simulation one = released(1e-3, between_springs(0)), other = released(1e-3, spring);
  run(one, 1000);
  run(other, 1000);
  CHECK(one.positions()[0] == Approx(other.positions()[0]).margin(1e-11));
  CHECK(one.velocities()[0] == Approx(other.velocities()[0]).margin(1e-9));
  Simulation free = released(1e-3, between_springs(1));
  run(free, 1000);
  CHECK(free.positions()[0] == Approx(kRest + kSpeed).epsilon(1e-12));
}

TEST_CASE("a chain with play in its joints moves as the plain simulator has it, by RK4 too, to second order", "[dead_zone_spring]") {
  const Model model = chain(4);
  Effects effects;
  for (Index row = 0; row < 4; ++row) effects.dead_zone_springs.push_back({.row = row, .stiffness = 2, .half_width = 0.05 + 0.02 * row});
  reference::PlainScene plain(model, effects, {0, 0, -9.81});
  plain.advance(0.5, 5000);
  const std::vector<double> exact(plain.q.data(), plain.q.data() + plain.q.size());
  double own[2], by_rk4[2];
  for (int halving = 0; halving < 2; ++halving) {
    const int steps = 500 << halving;
    const Options options{.step = 0.5 / steps};
    Simulation simulation(model, options, effects);
    run(simulation, steps);
    own[halving] = distance(simulation.positions(), exact);
    CHECK(simulation.energy().springs > 0.01);
    Baseline baseline(std::make_shared<const Model>(model), Scheme::rk4, options, effects);
    for (int k = 0; k < steps; ++k) REQUIRE(baseline.step());
    by_rk4[halving] = distance(baseline.positions(), exact);
  }
  INFO("errors " << own[0] << ", " << own[1] << "; of RK4 " << by_rk4[0] << ", " << by_rk4[1]);
  CHECK(own[0] / own[1] == Approx(4).epsilon(0.1));
  CHECK(by_rk4[0] / by_rk4[1] > 4);  // the edges of the zones cost it its fourth order, and not its second
  CHECK(by_rk4[1] < own[1]);
}

TEST_CASE("instances of a batch move as simulations do, each in its own piece of the force", "[dead_zone_spring]") {
  const auto model = std::make_shared<const Model>(chain(3));
  Effects effects;
  effects.dead_zone_springs = {{.row = 0, .stiffness = 2, .half_width = 0.1, .rest = -0.2}, {.row = 2, .stiffness = 1, .half_width = 0.3}};
  Batch batch(model, 9, {.step = 1e-3}, effects);
  const auto start = [](std::int64_t i) { return std::vector{0.1 * static_cast<double>(i) - 0.4, 0.2, -0.1 * static_cast<double>(i)}; };
  const std::vector<double> still(3, 0.0);
  for (std::int64_t i = 0; i < batch.size(); ++i) batch.reset(i, start(i), still);
  batch.step(500);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    Simulation simulation(model, {.step = 1e-3}, effects);
    simulation.set_positions(start(i));
    run(simulation, 500);
    for (Index row = 0; row < 3; ++row) {
      CHECK(batch.positions()(i, row) == Approx(simulation.positions()[static_cast<std::size_t>(row)]).margin(1e-7));
    }
  }
}

TEST_CASE("a scene names it by joint, and hears what it left out", "[dead_zone_spring]") {
  const Folder folder;
  const auto scene_with = [&](const std::string& values) {
    std::ofstream(folder / "scene.yaml") << "model: chain:2\neffects:\n  dead_zone_spring: {joint2: " << values << "}\n";
    return load_scene((folder / "scene.yaml").string());
  };
  const std::vector<DeadZoneSpring> read = scene_with("{stiffness: 3, half_width: 0.1, rest: -0.2}").effects.dead_zone_springs;
  REQUIRE(read.size() == 1);
  CHECK(read[0].row == 1);
  CHECK(read[0].stiffness == 3);
  CHECK(read[0].half_width == 0.1);
  CHECK(read[0].rest == -0.2);
  CHECK(scene_with("{stiffness: 3, half_width: 0.1}").effects.dead_zone_springs[0].rest == 0);
  using Catch::Matchers::Contains;
  CHECK_THROWS_WITH(scene_with("{stiffness: 3}"), Contains("scene.yaml:3: effects.dead_zone_spring.joint2 has no half_width"));
  CHECK_THROWS_WITH(scene_with("{stiffness: 3, half_width: -1}"), Contains("zero or more"));
  CHECK_THROWS_WITH(scene_with("{stiffness: 3, half_with: 1}"), Contains("did you mean") && Contains("half_width"));
}

}  // namespace linden::dead_zone_spring_test
