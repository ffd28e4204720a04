// Chains: long ones, a folded one that falls, a whip.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "models/build/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

RunRecord from_horizontal(Report& report, Index links, std::int64_t steps, int every) {
  Scenario falling = scenario(chain(links), {.step = 1e-3}, steps);
  falling.every = every;
  const RunRecord record = run(falling);
  promise_conservation(report, record, steps, false);
  report.note(fmt::format("{} steps, turns of up to {:.2g} rad a step", steps, record.turn));
  run_beside(report, falling, record.drift.scale());
  return record;
}

/// At 1 ms a crack takes a step or two, and each moves the energy a little, up or down; at half the step cracks are resolved.
/// What the first tenth of the run does to the energy, as the order of the start turns into chaos, is no slope.
void fifty_links(Report& report) {
  from_horizontal(report, 50, report.pick(1000, 20'000, 200'000), report.pick(1, 2, 10));
  if (report.form() == Form::quick) return;
  const auto steps = report.pick<std::int64_t>(0, 60'000, 600'000);
  Simulation simulation(chain(50), {.step = 5e-4});
  const RunRecord first = run(simulation, steps / 10, 10), rest = run(simulation, steps, 10);
  report.at_most("at 0.5 ms: steps that failed", static_cast<double>(steps / 10 - first.steps + steps - rest.steps), 0,
                 "every step has a solution");
  promise_no_slope(report, rest);
}

template <class Mass>
Model planar_chain(const std::string& name, Index links, double length, const Mass& mass) {
  return hinged_chain(name, links, length, [&](Index i) { return rod(mass(i), length, 0.1); }, Hinges::parallel);
}

/// Angles of a planar chain whose first half goes along `direction` [rad, from x towards -z], whose middle link lies across, and
/// whose second half comes back.
std::vector<double> folded(Index links, double direction) {
  std::vector<double> q(static_cast<std::size_t>(links), 0.0);
  q[0] = direction;
  q[static_cast<std::size_t>(links / 2)] = -0.5 * std::numbers::pi;
  q[static_cast<std::size_t>(links / 2 + 1)] = -0.5 * std::numbers::pi;
  return q;
}

/// Height of the end of a planar chain, from the angles of its hinges.
double tip_height(std::span<const double> q, double length) {
  double angle = 0, height = 0;
  for (const double turn : q) {
    angle += turn;
    height -= length * std::sin(angle);
  }
  return height;
}

/// A chain held at one end, folded in the middle, its other end let go beside the first. The half that falls pulls at the fold
/// and is pulled by it. With the energy kept and no width at the fold the end reaches the bottom in 0.847213 of the time of a
/// free fall:
///
///   t = sqrt(L / g) integral_0^1 sqrt((1 - s) / (s (2 - s))) ds = 0.847213 sqrt(2 L / g)
///
/// source  Calkin, March, The dynamics of a falling chain: I, American Journal of Physics 57 (1989)
void folded_chain(Report& report) {
  const auto links = report.pick<Index>(40, 100, 400);
  const double total = 2, length = total / links, g = 9.81, h = report.pick(2e-4, 1e-4, 2.5e-5);
  const double fall_time = std::sqrt(2 * total / g);
  Scenario falling = scenario(planar_chain("folded chain", links, length, [&](Index) { return 1.0 / links; }), {.step = h}, 0);
  falling.start.positions = folded(links, 0.5 * std::numbers::pi);
  Simulation simulation = simulation_of(falling);
  const double top = tip_height(simulation.positions(), length);
  double lead = 0, arrival = std::nan(""), before = top;
  double error = 0;
  const double energy = simulation.energy().total();
  while (simulation.time() < fall_time && std::isnan(arrival)) {
    const StepReport step = simulation.step();
    if (!step.ok()) {
      report.note(simulation.describe(step));
      break;
    }
    const double height = tip_height(simulation.positions(), length), time = simulation.time();
    lead = std::max(lead, top - 0.5 * g * time * time - height);
    error = std::max(error, std::abs(simulation.energy().total() - energy));
    if (height > before) arrival = time - h;  // it turns back up
    before = height;
  }
  const double share = arrival / fall_time;
  report.at_least("lead of the tip over a free fall [m]", lead, 0.1 * total, "Calkin, March: the end falls faster than g");
  report.at_most("|time of the fall / free fall - 0.8472|", std::abs(share - 0.847213), 2.0 / links,
                 "closed form of a chain of no width; ours is a link wide at the fold");
  report.note(
      fmt::format("{} links: {:.4f} of a free fall; energy error {:.1e} of the fall", links, share, error / (g * total / 4)));
}

/// A straight whip whose end half is thrown back along itself: the moving part gets shorter and lighter and keeps the energy.
void whip(Report& report) {
  const Index links = 30;
  const double length = 0.1, taper = 0.8, speed = 5;
  const auto steps = report.pick<std::int64_t>(1000, 10'000, 40'000);
  const double h = report.pick(2e-4, 1e-4, 2.5e-5);
  Scenario cracking = scenario(planar_chain("whip", links, length, [&](Index i) { return std::pow(taper, i); }),
                               {.step = h, .gravity = {0, 0, 0}}, steps);
  cracking.start.positions = folded(links, 0);
  cracking.start.velocities.assign(static_cast<std::size_t>(links), 0.0);
  cracking.start.velocities[static_cast<std::size_t>(links / 2)] = speed / length;
  cracking.start.velocities[static_cast<std::size_t>(links / 2 + 1)] = -speed / length;
  const RunRecord record = run(cracking);
  promise_conservation(report, record, steps, false);
  report.note(fmt::format("turns of up to {:.2g} rad a step", record.turn));
  run_beside(report, cracking, record.drift.scale());
}

}  // namespace

std::vector<Case> chain_cases() {
  const std::string swinging = "swings from horizontal, h = 1 ms: ";
  return {
      {"chain-50", swinging + "a wave runs down and the end cracks like a whip", fifty_links, ""},
      {"chain-100", swinging + "the crack of a longer one, at the end of more joints",
       [](Report& report) { from_horizontal(report, 100, report.pick(500, 2000, 100'000), report.pick(1, 1, 10)); }, ""},
      {"chain-1000", swinging + "sums over 1,000 joints",
       [](Report& report) { from_horizontal(report, 1000, report.pick(20, 300, 13'000), report.pick(1, 1, 10)); },
       "At 1 ms until the end cracks for the second time, 13.9 s after the start: there the last link turns at 4,000 rad/s, and "
       "steps are split, then "
       "refused. The first crack, at 4.5 s and 300 rad/s, passes. Longer chains crack faster still: 0.2 ms gets through the "
       "second with 1 % of "
       "the energy."},
      {"chain-10000", swinging + "the tension of a kilometre of chain in every joint",
       [](Report& report) { from_horizontal(report, 10'000, report.pick(3, 50, 2000), report.pick(1, 5, 10)); }, ""},
      {"chain-100000", swinging + "rounding of sums over 10 km",
       [](Report& report) { from_horizontal(report, 100'000, report.pick(1, 5, 200), report.pick(1, 1, 10)); }, ""},
      {"folded-chain", "let go at one end: the tip falls faster than g and is stopped by a jerk", folded_chain, ""},
      {"whip", "links that taper by 0.8 each, 650 to 1, cracked: all energy ends in the last grams", whip, ""},
  };
}

}  // namespace linden
