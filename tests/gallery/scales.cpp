// Small, large, far away, fast, wound up: with relative accuracy as at ordinary scale.
#include <cmath>
#include <numbers>

#include "models/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

Model leg(double length, double mass) {
  return hinged_chain("leg", 4, length, [&](Index) { return rod(mass, length); });
}

/// Angles of a leg of another size after `steps` steps, its gravity, masses and step so scaled that its motion is that of a leg of
/// 1 m and 1 kg, step for step: t ~ sqrt(length). The ordinary leg is compared with one whose start is another by an epsilon, which says
/// how much rounding grows in that time.
void scaled_leg(Report& report, double length, double mass) {
  const auto steps = report.pick<std::int64_t>(200, 2000, 20'000);
  const double h = 1e-3 * std::sqrt(length);
  const auto ends = [&](double size, double weight, double step, double nudge) {
    Scenario swinging = scenario(leg(size, weight), {.step = step, .tolerance = 1e-14}, steps);
    swinging.start = random_state(*swinging.model, 1, 0.5);
    for (double& v : swinging.start.velocities) v *= 1e-3 / step;
    swinging.start.positions[0] += nudge;
    Simulation simulation = simulation_of(swinging);
    const RunRecord record = run(simulation, steps, static_cast<int>(steps));
    if (!record.failure.empty()) report.note(record.failure);
    std::vector<double> q(simulation.positions().begin(), simulation.positions().end());
    q.push_back(record.energy_error / record.drift.scale());
    return q;
  };
  const auto distance = [](const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0;
    for (std::size_t k = 0; k + 1 < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
    return most;
  };
  const std::vector<double> ordinary = ends(1, 1, 1e-3, 0), nudged = ends(1, 1, 1e-3, 64 * kEpsilon), scaled = ends(length, mass, h, 0);
  const double growth = distance(ordinary, nudged) / (64 * kEpsilon);
  const double walk = std::sqrt(static_cast<double>(steps));
  report.at_most("angles off an ordinary leg's [rad]", distance(scaled, ordinary), 10 * kEpsilon * growth * walk,
                 "similarity: nothing but rounding, ten epsilons a step, as a random walk, grown as nearby motions part");
  report.note(fmt::format("{} steps of {:.1e} s; nearby motions part by a factor of {:.0f}; energy error {:.1e}, ordinary {:.1e}", steps, h,
                          growth, scaled.back(), ordinary.back()));
}

}  // namespace

std::vector<Case> scale_cases() {
  return {
      {"insect-leg", "1e-9 kg, 1e-4 m: moments of 1e-17 kg m^2", [](Report& r) { scaled_leg(r, 1e-4, 1e-9); }, ""},
      {"crane", "1e6 kg, 1e3 m: moments of 1e12 kg m^2", [](Report& r) { scaled_leg(r, 1e3, 1e6); }, ""},
  };
}

}  // namespace linden
