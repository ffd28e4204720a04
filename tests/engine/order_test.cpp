// The one-step map is of second order from the first step on, and its own inverse when momenta are flipped.
#include <cmath>

#include "tests/engine/scenes.hpp"

namespace linden::order_test {
namespace {

std::vector<double> end_of(const Model& model, double h, double duration, double spread) {
  Simulation simulation(model, {.step = h, .tolerance = 1e-13});
  random_start(simulation, 3, spread);
  run(simulation, static_cast<int>(std::lround(duration / h)));
  return {simulation.positions().begin(), simulation.positions().end()};
}

/// Least-squares slope of log error over log step.
double measured_order(const Model& model, double duration, double spread, const std::vector<double>& steps) {
  const std::vector<double> fine = end_of(model, steps.back() / 16, duration, spread);
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(steps.size());
  for (const double h : steps) {
    const double x = std::log(h), y = std::log(distance(end_of(model, h, duration, spread), fine));
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

TEST_CASE("the error falls with the square of the step, from the first step on") {
  const std::vector<double> steps{4e-3, 2e-3, 1e-3, 5e-4};
  for (const Model& model : {chain(5), ball_chain(3), random_tree({.bodies = 8, .seed = 4}),
                             load_urdf(model_file("humanoid.urdf"), Base::floating), load_urdf(model_file("hand.urdf"))}) {
    CAPTURE(model.names.model);
    CHECK(measured_order(model, 0.2, 0.2, steps) == Approx(2).margin(0.1));
    // one to eight steps: a first-order start would show as slope 1
    CHECK(measured_order(model, 4e-3, 0.2, {4e-3, 2e-3, 1e-3, 5e-4}) == Approx(2).margin(0.1));
  }
}

TEST_CASE("a run taken back with flipped momenta returns to where it began, to rounding") {
  for (const Model& model : {chain(10), ball_chain(5), random_tree({.bodies = 12, .seed = 9}),
                             load_urdf(model_file("humanoid.urdf"), Base::floating)}) {
    CAPTURE(model.names.model);
    Simulation simulation(model, {.step = 1e-3, .tolerance = 1e-14});
    random_start(simulation, 5, 0.3);
    const std::vector<double> start(simulation.positions().begin(), simulation.positions().end());
    run(simulation, 200);
    CHECK(distance(simulation.positions(), start) > 1e-3);
    std::vector<double> back = simulation.velocities();
    for (double& rate : back) rate = -rate;
    simulation.set_velocities(back);
    run(simulation, 200);
    CHECK(distance(simulation.positions(), start) < 1e-10);
  }
}

}  // namespace
}  // namespace linden::order_test
