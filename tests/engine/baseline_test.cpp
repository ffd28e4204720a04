// Semi-implicit Euler and RK4 as comparators: of their order on every kind of joint, and on the same motion as linden's own
// steps.
#include <cmath>

#include "engine/baseline/baseline.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/kernels/allocation_counter.hpp"
#include "tests/reference/plain_scene.hpp"

namespace linden::baseline_test {
namespace {

std::vector<double> end_of(const Model& model, Scheme scheme, double h, double duration, double spread,
                           const Effects& effects = {}) {
  const auto shared = std::make_shared<const Model>(model);
  Baseline baseline(shared, scheme, {.step = h}, effects);
  const InitialState start = random_state(model, 3, spread);
  baseline.set(start.positions, start.velocities);
  for (int k = 0; k < std::lround(duration / h); ++k) REQUIRE(baseline.step());
  return {baseline.positions().begin(), baseline.positions().end()};
}

/// By linden's own steps.
std::vector<double> exact(const Model& model, double duration, double spread, const Effects& effects = {}) {
  Simulation simulation(model, {.step = 1e-3, .order = 8, .tolerance = 1e-13}, effects);
  random_start(simulation, 3, spread);
  run(simulation, static_cast<int>(std::lround(duration / 1e-3)));
  return {simulation.positions().begin(), simulation.positions().end()};
}

TEST_CASE("RK4 is of fourth order and semi-implicit Euler of first, towards the motion that linden's steps converge to") {
  struct Case {
    Model model;
    double h, spread;  // h: where RK4's error is its own and not rounding
  };
  for (const Case& given :
       {Case{chain(5), 2e-3, 0.2}, Case{ball_chain(3), 2e-3, 0.2}, Case{random_tree({.bodies = 8, .seed = 4}), 16e-3, 0.2},
        Case{load_urdf(model_file("humanoid.urdf"), Base::floating), 16e-3, 6},
        Case{load_urdf(model_file("hand.urdf")), 16e-3, 2}}) {
    CAPTURE(given.model.names.model);
    const std::vector<double> end = exact(given.model, 0.192, given.spread);
    const auto error = [&](Scheme scheme, double h) {
      return distance(end_of(given.model, scheme, h, 0.192, given.spread), end);
    };
    CHECK(std::log2(error(Scheme::rk4, given.h) / error(Scheme::rk4, given.h / 2)) == Approx(4).margin(0.15));
    CHECK(error(Scheme::rk4, given.h / 2) < 1e-6);
    CHECK(std::log2(error(Scheme::semi_implicit_euler, 2e-4) / error(Scheme::semi_implicit_euler, 1e-4)) ==
          Approx(1).margin(0.1));
  }
}

TEST_CASE("baselines know rotors and springs") {
  const Model arm = load_urdf(model_file("arm.urdf"));
  Effects effects;
  effects.armature = armature_everywhere(arm, 0.05);
  for (const Armature& one : effects.armature) effects.springs.push_back({one.row, 40, 0.1});
  CHECK(distance(end_of(arm, Scheme::rk4, 1e-3, 0.192, 0.3, effects), exact(arm, 0.192, 0.3, effects)) < 1e-8);
  CHECK(distance(end_of(arm, Scheme::rk4, 1e-3, 0.192, 0.3), exact(arm, 0.192, 0.3, effects)) > 1e-3);
  const Model balls = ball_chain(3);
  Effects pulled;
  for (Index slot = 1; slot < balls.tree.shape.slots; ++slot) pulled.ball_springs.push_back({slot, 0.05});
  CHECK(distance(end_of(balls, Scheme::rk4, 5e-4, 0.192, 0.2, pulled), exact(balls, 0.192, 0.2, pulled)) < 1e-5);
}

TEST_CASE("baselines know what acts on bodies, in wind and over time, as the plain simulator does") {
  const Model model = random_tree({.bodies = 6, .seed = 4});
  const InitialState start = random_state(model, 3, 0.5);
  Effects effects;
  effects.wind = {0.5, -1, 0.3};
  effects.drag = {{.slot = 2, .linear = 0.2, .quadratic = 0.1}, {.slot = 5, .linear = 0.1}};
  effects.wrenches = {{.slot = 1, .point = {0.1, 0, 0.2}, .force = {1, 2, -1}, .moment = {0.1, 0, 0.2}, .scale = {{0, 0.2}, {0, 1}}},
                      {.slot = 5, .point = {0, 0.1, 0}, .force = {0.5, -1, 0.5}, .moment = {0, 0.05, 0}, .in_world = false}};
  const auto away = [&](const Effects& acting) {
    reference::PlainScene plain(model, acting, Options{}.gravity);
    plain.start(Eigen::Map<const Eigen::VectorXd>(start.positions.data(), static_cast<Eigen::Index>(start.positions.size())),
                Eigen::Map<const Eigen::VectorXd>(start.velocities.data(), static_cast<Eigen::Index>(start.velocities.size())));
    plain.advance(0.192, 400);
    return distance(end_of(model, Scheme::rk4, 1e-3, 0.192, 0.5, effects), std::vector<double>(plain.q.begin(), plain.q.end()));
  };
  CHECK(away(effects) < 1e-7);
  Effects fewer = effects;
  fewer.wind = {0, 0, 0};
  CHECK(away(fewer) > 1e-4);
  fewer = effects;
  fewer.wrenches[1].in_world = true;
  CHECK(away(fewer) > 1e-4);
}

TEST_CASE("energy and momentum of a baseline are those of the same state in a simulation") {
  const Model model = load_urdf(model_file("humanoid.urdf"), Base::floating);
  Simulation simulation(model);
  random_start(simulation, 1, 0.5);
  Baseline baseline(std::make_shared<const Model>(model), Scheme::rk4, {});
  baseline.set(simulation.positions(), simulation.velocities());
  CHECK(baseline.energy().kinetic == Approx(simulation.energy().kinetic).epsilon(1e-12));
  CHECK(baseline.energy().potential == Approx(simulation.energy().potential).epsilon(1e-12));
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(baseline.momentum().angular[k] == Approx(simulation.momentum().angular[k]).epsilon(1e-11).margin(1e-11));
    CHECK(baseline.momentum().linear[k] == Approx(simulation.momentum().linear[k]).epsilon(1e-11).margin(1e-11));
  }
}

TEST_CASE("semi-implicit Euler blows up on the ten-link chain, and the step that is not finite leaves the last good state") {
  Baseline baseline(std::make_shared<const Model>(chain(10)), Scheme::semi_implicit_euler, {.step = 1e-3});
  const AllocationCounter counter;
  int steps = 0;
  while (steps < 20'000 && baseline.step()) steps += 1;
  CHECK(counter.count() == 0);
  CHECK(steps < 20'000);
  CHECK(baseline.time() == Approx(1e-3 * steps));
  for (const double q : baseline.positions()) CHECK(std::isfinite(q));
}

TEST_CASE("what a baseline does not have is refused") {
  const auto arm = std::make_shared<const Model>(load_urdf(model_file("arm.urdf")));
  Effects effects;
  effects.friction = urdf_friction(*arm);
  REQUIRE(!effects.friction.empty());
  CHECK_THROWS_AS(Baseline(arm, Scheme::rk4, {}, effects), InputError);
  Effects ground;
  ground.ground = Ground{};
  CHECK_THROWS_WITH(Baseline(arm, Scheme::rk4, {}, ground), "RK4 has no forces that change suddenly; the scene has ground");
  Baseline baseline(arm, Scheme::rk4, {});
  CHECK_THROWS_WITH(baseline.set(std::vector<double>(3), std::vector<double>(3)), Catch::Contains("expected"));
}

}  // namespace
}  // namespace linden::baseline_test
