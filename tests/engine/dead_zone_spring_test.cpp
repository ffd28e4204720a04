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
Model slider(double mass = kMass, const Eigen::Vector3d& axis = Eigen::Vector3d::UnitX()) {
  LinkSpec link;
  link.name = "link";
  link.joint = "joint";
  link.type = JointType::prismatic;
  link.axis = axis;
  link.inertia = {mass, Eigen::Vector3d::Zero(), 0.01 * Eigen::Matrix3d::Identity()};
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

TEST_CASE("it keeps its energy to rounding, however often it crosses the edges of the zone", "[dead_zone_spring]") {
  Simulation simulation = released(1e-3);
  double strayed = 0, stored = 0;
  for (int k = 0; k < 100'000; ++k) {
    run(simulation, 1);
    strayed = std::max(strayed, std::abs(simulation.energy().total() - kEnergy));
    stored = std::max(stored, simulation.energy().springs);
  }
  CHECK(stored == Approx(kEnergy).epsilon(1e-3));
  CHECK(strayed < 1e-9 * kEnergy);
  CHECK(simulation.effect_work().magnitude() == 0);
}

TEST_CASE("what drops on one again and again never gains, at any stiffness, step and mass", "[dead_zone_spring]") {
  constexpr double kDrop = 0.2;
  for (const double mass : {1e-3, 0.02, 1.0, 200.0}) {
    for (const double step : {1e-4, 1e-3, 1e-2}) {
      for (double stiffness = 1e4; stiffness < 2e9; stiffness *= 10) {
        CAPTURE(mass, step, stiffness);
        Effects effects;
        effects.dead_zone_springs = {{.row = 0, .stiffness = stiffness, .half_width = 1, .rest = 1}};
        Simulation simulation(slider(mass, Eigen::Vector3d::UnitZ()), {.step = step}, effects);
        simulation.set_positions(std::vector{kDrop});
        const double before = simulation.energy().total(), scale = mass * 9.81 * kDrop;
        double most = before;
        for (int k = 0; k < 3000; ++k) {
          REQUIRE(simulation.step().ok());
          most = std::max(most, simulation.energy().total());
        }
        const double left = simulation.energy().total() - before, taken = simulation.effect_work().of<DeadZoneSpring>();
        CHECK(most - before < 1e-9 * scale);
        CHECK(simulation.passive_gifts().empty());
        const double ratio = step * step * stiffness / mass;
        if (ratio <= 1) {
          CHECK(taken == 0);
          CHECK(left == Approx(0).margin(1e-9 * scale));
        } else {
          CHECK(left + taken == Approx(0).margin(0.12 * scale));
        }
        if (ratio > 100) CHECK(taken == Approx(scale).epsilon(0.02));  // a stop
      }
    }
  }
}

TEST_CASE("it loses more of a bounce the less a step resolves it", "[dead_zone_spring]") {
  constexpr double kStep = 1e-2;
  const auto bounced = [&](double ratio) {
    // wherever within a step it meets the edge, it comes back with some 1 / ratio of its speed
    double sum = 0;
    for (int k = 0; k < 20; ++k) {
      Effects effects;
      effects.dead_zone_springs = {{.row = 0, .stiffness = ratio * kMass / (kStep * kStep), .half_width = (5 + (k + 0.01) / 20) * kStep * kSpeed}};
      Simulation simulation(slider(), {.step = kStep, .gravity = {0, 0, 0}}, effects);
      simulation.set_velocities(std::vector{kSpeed});
      run(simulation, 14);
      CHECK(simulation.energy().total() < kEnergy * (1 + 1e-9));
      CHECK(simulation.energy().total() + simulation.effect_work().taken() == Approx(kEnergy).epsilon(0.12));
      sum -= simulation.velocities()[0] / kSpeed / 20;
    }
    return sum;
  };
  CHECK(bounced(0.99) == Approx(1).epsilon(1e-9));
  CHECK(bounced(1.05) == Approx(0.935).epsilon(2e-3));
  CHECK(bounced(1.5) == Approx(0.588).epsilon(2e-3));
  CHECK(bounced(3) == Approx(0.270).epsilon(4e-3));
  CHECK(bounced(100) == Approx(0.010).epsilon(0.05));
}

TEST_CASE("its damping acts beyond the zone alone, only pushes back, and takes what is lost", "[dead_zone_spring]") {
  constexpr double kDamping = 12;
  Effects effects = between_springs();
  effects.dead_zone_springs[0].damping = kDamping;
  const auto bounced = [&](double step) {
    Simulation simulation = released(step, effects);
    run(simulation, static_cast<int>(std::lround(0.02 / step)));
    CHECK(simulation.velocities()[0] == Approx(kSpeed).epsilon(1e-12));  // not there yet
    run(simulation, static_cast<int>(std::lround(0.24 / step)));
    CHECK(simulation.energy().springs == 0);
    CHECK(simulation.energy().total() + simulation.effect_work().of<DeadZoneSpring>() == Approx(kEnergy).epsilon(1e-6));
    CHECK(simulation.passive_gifts().empty());
    return -simulation.velocities()[0];
  };
  // the oscillator lets go where c v = -k m: after 2 atan(sqrt(1 - z^2) / z) / w_d of its own time, z its damping ratio
  const double w = std::sqrt(kStiffness / kMass), z = kDamping / (2 * kMass * w), turned = std::sqrt(1 - z * z);
  const double when = 2 * std::atan2(turned, z) / (w * turned);
  const double exact = kSpeed * std::exp(-z * w * when);
  const double coarse = std::abs(bounced(1e-3) - exact), fine = std::abs(bounced(2.5e-4) - exact);
  CHECK(coarse < 3e-3 * exact);
  CHECK(fine < 0.5 * coarse);

  // pulled away faster than it follows it lets go, and does not hold
  effects.dead_zone_springs[0].damping = 1e6;
  Simulation stuck(slider(), {.step = 1e-3, .gravity = {-100, 0, 0}}, effects);
  stuck.set_positions(std::vector{kRest + 2 * kHalfWidth});
  run(stuck, 10);
  const double fallen = kRest + 2 * kHalfWidth - stuck.positions()[0];
  CHECK(fallen == Approx(0.5 * 100 * 0.01 * 0.01).epsilon(1e-9));
}

TEST_CASE("a damped one has no place in steps back in time, and none in explicit methods", "[dead_zone_spring]") {
  Effects effects = between_springs();
  const auto model = std::make_shared<const Model>(slider());
  CHECK_NOTHROW(Simulation(model, {.step = 1e-3, .order = 4}, effects));
  effects.dead_zone_springs[0].damping = 1;
  using Catch::Matchers::Contains;
  CHECK_THROWS_WITH(Simulation(model, {.step = 1e-3, .order = 4}, effects), Contains("the scene has dead_zone_spring"));
  CHECK_THROWS_WITH(Baseline(model, Scheme::rk4, {.step = 1e-3}, effects), Contains("damping beyond a dead zone"));
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

TEST_CASE("a chain whose play is damped moves as the plain simulator has it", "[dead_zone_spring]") {
  const Model model = chain(4);
  Effects effects;
  for (Index row = 0; row < 4; ++row) effects.dead_zone_springs.push_back({.row = row, .stiffness = 2, .half_width = 0.05 + 0.02 * row, .damping = 0.2});
  reference::PlainScene plain(model, effects, {0, 0, -9.81});
  plain.advance(0.5, 20'000);
  const std::vector<double> exact(plain.q.data(), plain.q.data() + plain.q.size());
  double own[2];
  for (int halving = 0; halving < 2; ++halving) {
    const int steps = 500 << halving;
    Simulation simulation(model, {.step = 0.5 / steps}, effects);
    const double before = simulation.energy().total();
    run(simulation, steps);
    own[halving] = distance(simulation.positions(), exact);
    CHECK(simulation.effect_work().of<DeadZoneSpring>() > 0.01);
    CHECK(simulation.energy().total() + simulation.effect_work().taken() == Approx(before).margin(3e-4 / (1 << halving)));
  }
  INFO("errors " << own[0] << ", " << own[1]);
  CHECK(own[0] < 1e-5);
  CHECK(own[0] / own[1] > 1.5);  // the damping jumps at the edges
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
  const std::vector<DeadZoneSpring> read = scene_with("{stiffness: 3, half_width: 0.1, rest: -0.2, damping: 0.5}").effects.dead_zone_springs;
  REQUIRE(read.size() == 1);
  CHECK(read[0].row == 1);
  CHECK(read[0].stiffness == 3);
  CHECK(read[0].half_width == 0.1);
  CHECK(read[0].rest == -0.2);
  CHECK(read[0].damping == 0.5);
  CHECK(scene_with("{stiffness: 3, half_width: 0.1}").effects.dead_zone_springs[0].rest == 0);
  using Catch::Matchers::Contains;
  CHECK_THROWS_WITH(scene_with("{stiffness: 3}"), Contains("scene.yaml:3: effects.dead_zone_spring.joint2 has no half_width"));
  CHECK_THROWS_WITH(scene_with("{stiffness: 3, half_width: -1}"), Contains("zero or more"));
  CHECK_THROWS_WITH(scene_with("{stiffness: 3, half_with: 1}"), Contains("did you mean") && Contains("half_width"));
}

}  // namespace linden::dead_zone_spring_test
