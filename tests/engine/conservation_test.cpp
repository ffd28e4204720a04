// Energy and momentum over long runs.
#include <cmath>

#include "engine/drift.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::conservation_test {
namespace {

double largest_energy_error(double h, double duration) {
  Simulation simulation(chain(10), {.step = h});
  const double start = simulation.energy().total();
  double largest = 0;
  for (int k = 0; k < std::lround(duration / h); ++k) {
    run(simulation, 1);
    largest = std::max(largest, std::abs(simulation.energy().total() - start));
  }
  return largest;
}

TEST_CASE("the ten-link chain on which first-order engines blow up keeps its energy") {
  CHECK(largest_energy_error(1e-3, 10) < 2.6e-3 * kTenLinkFall);
  CHECK(largest_energy_error(4e-3, 10) < 8e-2 * kTenLinkFall);
}

TEST_CASE("the energy of the ten-link chain shows no slope over 100,000 steps") {
  Simulation simulation(chain(10), {.step = 1e-3});
  constexpr int steps = 100'000;
  EnergyDrift drift(steps + 1);
  drift.add(0, simulation.energy());
  for (int k = 0; k < steps; ++k) {
    run(simulation, 1);
    drift.add(simulation.time(), simulation.energy());
  }
  CHECK(std::abs(drift.slope()) < 4 * drift.slope_error());
  // and where the noise is so small that even a visible slope would be harmless, say so
  CHECK(std::abs(drift.slope()) * simulation.time() < 2e-4 * kTenLinkFall);
}

TEST_CASE("a floating humanoid without gravity keeps its momentum over 100,000 steps") {
  Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating), {.step = 1e-3, .gravity = {0, 0, 0}});
  random_start(simulation, 2, 0.5);
  const Momentum start = simulation.momentum();
  const double energy = simulation.energy().total();
  double angular = 0, linear = 0, largest = 0;
  const auto norm = [](const std::array<double, 3>& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); };
  for (int look = 0; look < 100; ++look) {
    run(simulation, 1000);
    const Momentum now = simulation.momentum();
    for (std::size_t k = 0; k < 3; ++k) {
      angular = std::max(angular, std::abs(now.angular[k] - start.angular[k]));
      linear = std::max(linear, std::abs(now.linear[k] - start.linear[k]));
    }
    largest = std::max(largest, std::abs(simulation.energy().total() - energy));
  }
  CHECK(linear < 1e-10 * norm(start.linear));
  CHECK(angular < 1e-10 * norm(start.angular));
  CHECK(largest < 1e-3 * energy);
}

TEST_CASE("momentum is kept to rounding whatever the solver's tolerance") {
  for (const double tolerance : {1e-3, 1e-6}) {
    Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating),
                          {.step = 1e-3, .gravity = {0, 0, 0}, .tolerance = tolerance});
    random_start(simulation, 2, 0.5);
    const Momentum start = simulation.momentum();
    run(simulation, 1000);
    const Momentum now = simulation.momentum();
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(now.linear[k] == Approx(start.linear[k]).epsilon(1e-12).margin(1e-11));
      CHECK(now.angular[k] == Approx(start.angular[k]).epsilon(1e-12).margin(1e-11));
    }
  }
}

}  // namespace
}  // namespace linden::conservation_test
