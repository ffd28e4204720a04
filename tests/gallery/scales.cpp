// Small, large, far away, fast, wound up: with relative accuracy as at ordinary scale.
#include <cmath>
#include <numbers>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

constexpr double kTolerance = 1e-14;  // of the solves: what each step may be off

/// Where a scenario leads, and how nearby motions part from it: what rounding may do to it.
struct Ended {
  std::vector<double> q;
  double energy_error;  // over the largest kinetic energy
};

Ended end_of(Report& report, const Scenario& scenario, double nudge = 0) {
  Scenario nudged = scenario;
  for (double& v : nudged.start.velocities) v *= 1 + nudge;
  Simulation simulation = simulation_of(nudged);
  const RunRecord record = run(simulation, scenario.steps, static_cast<int>(scenario.steps));
  if (!record.failure.empty()) report.note(record.failure);
  return {{simulation.positions().begin(), simulation.positions().end()}, record.energy_error / record.drift.scale()};
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

/// What a relative change of the speeds at the start makes at the end [rad].
double growth_of(Report& report, const Scenario& scenario, const Ended& end) {
  const double nudge = 1e-10;
  return std::max(1.0, largest_difference(end_of(report, scenario, nudge).q, end.q) / nudge);
}

double walk(std::int64_t steps) { return std::sqrt(static_cast<double>(steps)); }

Scenario leg(double length, double mass, double step, std::int64_t steps) {
  Scenario swinging = scenario(hinged_chain("leg", 4, length, [&](Index) { return rod(mass, length); }),
                               {.step = step, .tolerance = kTolerance}, steps);
  swinging.start = random_state(*swinging.model, 1, 0.5);
  for (double& v : swinging.start.velocities) v *= 1e-3 / step;
  return swinging;
}

/// A leg of another size, its masses and step so scaled that it moves as a leg of 1 m and 1 kg, step for step: t ~ sqrt(length).
void scaled_leg(Report& report, double length, double mass) {
  const auto steps = report.pick<std::int64_t>(200, 2000, 5000);
  const double h = 1e-3 * std::sqrt(length);
  const Scenario ordinary = leg(1, 1, 1e-3, steps);
  const Ended end = end_of(report, ordinary), scaled = end_of(report, leg(length, mass, h, steps));
  const double growth = growth_of(report, ordinary, end);
  report.at_most("angles off an ordinary leg's [rad]", largest_difference(scaled.q, end.q), kTolerance * growth * walk(steps),
                 "similarity: the solver's 1e-14 a step as a random walk, grown as nearby motions part");
  report.note(
      fmt::format("{} steps of {:.1e} s; speeds off by 1e-10 lead {:.1e} rad off; energy error {:.1e}, at ordinary scale {:.1e}",
                  steps, h, 1e-10 * growth, scaled.energy_error, end.energy_error));
}

/// A falling, moving humanoid a thousand kilometres away from the world's origin on every axis.
void far_away(Report& report) {
  const auto steps = report.pick<std::int64_t>(100, 1000, 20'000);
  Scenario near = scenario(humanoids(1), {.step = 1e-3, .tolerance = kTolerance}, steps);
  near.start = random_state(*near.model, 1, 0.5);
  Scenario far = near;
  const double distance = 1e6;
  for (std::size_t k = 0; k < 3; ++k) far.start.positions[k] += distance;
  const Ended end = end_of(report, near);
  Ended moved = end_of(report, far);
  const double growth = growth_of(report, near, end);
  for (std::size_t k = 0; k < 3; ++k) moved.q[k] -= distance;
  const double place = largest_difference({moved.q.begin(), moved.q.begin() + 3}, {end.q.begin(), end.q.begin() + 3});
  for (std::size_t k = 0; k < 3; ++k) moved.q[k] = end.q[k];
  report.at_most("angles off those of a robot at the origin [rad]", largest_difference(moved.q, end.q),
                 kTolerance * growth * walk(steps), "the solver's 1e-14 a step as a random walk, grown as nearby motions part");
  report.at_most("place off [m]", place, kEpsilon * distance * walk(steps), "places have an epsilon of 1e6 m each step");
}

/// The same tumbling a thousand times as fast with a step a thousandth as long.
void fast_body(Report& report) {
  const auto steps = report.pick<std::int64_t>(1000, 20'000, 1'000'000);
  const auto body = [&](double speed) {
    Scenario spinning = scenario(one_body(JointType::ball, {1, Eigen::Vector3d::Zero(), moments(0.01, 0.02, 0.03)}),
                                 {.step = 0.1 / speed, .gravity = {0, 0, 0}, .tolerance = kTolerance}, steps);
    spinning.start = {{0, 0, 0, 1}, {0.6 * speed, 0.1 * speed, 0.79 * speed}};
    spinning.every = 10;
    return spinning;
  };
  const Scenario slow = body(10), fast = body(1e4);
  const Ended end = end_of(report, slow), other = end_of(report, fast);
  // a spinning body parts from its neighbours linearly in time, by the turns it makes
  report.at_most("orientation off that at 10 rad/s", largest_difference(other.q, end.q),
                 kTolerance * walk(steps) * 0.1 * static_cast<double>(steps),
                 "similarity: a random walk of the speed, the solver's 1e-14 a step, times the angle turned through");
  const RunRecord record = run(fast);
  promise_conservation(report, record, steps, report.form() != Form::quick);
  run_beside(report, fast, record.drift.scale());
}

/// Joints at 100,000 turns, of which the unit in the last place is 1.2e-10 rad.
void wound_up(Report& report) {
  const auto steps = report.pick<std::int64_t>(200, 2000, 5000);
  const double wound = 2 * std::numbers::pi * 1e5;
  const Scenario plain = leg(1, 1, 1e-3, steps);
  Scenario wound_leg = plain;
  for (double& q : wound_leg.start.positions) q += wound;
  const Ended end = end_of(report, plain);
  Ended other = end_of(report, wound_leg);
  // what rounding does to an angle grows as a nearby angle does
  constexpr double kNudge = 1e-9;
  Scenario nudged = plain;
  for (double& q : nudged.start.positions) q += kNudge;
  const double growth = std::max(1.0, largest_difference(end_of(report, nudged).q, end.q) / kNudge);
  for (double& q : other.q) q -= wound;
  report.at_most("angles off those without the turns [rad]", largest_difference(other.q, end.q),
                 kEpsilon * wound * growth * walk(steps),
                 "a number near 628,318 has that many epsilons: rounding of the angle itself, as a random walk");
  report.note(fmt::format("angles off by 1e-9 lead {:.1e} rad off; energy error {:.1e}, without the turns {:.1e}", kNudge * growth,
                          other.energy_error, end.energy_error));
}

}  // namespace

std::vector<Case> scale_cases() {
  return {
      {"insect-leg", "1e-9 kg, 1e-4 m: moments of 1e-17 kg m^2", [](Report& r) { scaled_leg(r, 1e-4, 1e-9); }, ""},
      {"crane", "1e6 kg, 1e3 m: moments of 1e12 kg m^2", [](Report& r) { scaled_leg(r, 1e3, 1e6); }, ""},
      {"far-away", "a robot 1e6 m from the world's origin", far_away, ""},
      {"fast-body", "a free asymmetric body at 1e4 rad/s", fast_body, ""},
      {"wound-up", "joints wound up by 100,000 turns", wound_up, ""},
  };
}

}  // namespace linden
