#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>

#include "engine/text.hpp"
#include "tests/gallery/scenario.hpp"
#if defined(LINDEN_WITH_MUJOCO) || defined(LINDEN_WITH_DART)
#include "bench/apart.hpp"
#include "bench/installed_peers.hpp"
#endif

namespace linden {

#if defined(LINDEN_WITH_MUJOCO) || defined(LINDEN_WITH_DART)
namespace {

/// Bodies beyond which the others, whose mass matrices have a row for each, are not asked.
constexpr Index kMostBodies = 1000;

/// Of their own, in steps times the square of bodies: an hour of theirs should not make an hour of ours.
constexpr double kMostWork = 1e8;

/// Energy this many times the scale is as good as none.
constexpr double kBlownUp = 1e3;

std::string found_by(const Contender& contender, const Scenario& scenario, double scale) {
  const double bodies = scenario.model->tree.bodies();
  const auto steps = std::min<std::int64_t>(scenario.steps, static_cast<std::int64_t>(kMostWork / (bodies * bodies)));
  const double h = scenario.options.step;
  const Robot robot{scenario.model->names.model, "", scenario.model, scenario.effects};
  const std::unique_ptr<Peer> peer = contender.make(robot, {.step = h, .gravity = -scenario.options.gravity[2]});
  Simulation simulation = simulation_of(scenario);
  const std::vector<double> v = simulation.velocities();
  peer->reset(0, {{simulation.positions().begin(), simulation.positions().end()}, v});
  const double start = peer->energy(0).total(), ours = simulation.energy().total();
  if (!(std::abs(start - ours) < 1e-6 * std::max(scale, std::abs(ours)))) {
    return fmt::format("another model: {:.6g} J at the start, linden {:.6g} J", start, ours);
  }
  double off = 0;
  for (std::int64_t k = 0; k < steps; k += scenario.every) {
    try {
      peer->step(static_cast<int>(std::min<std::int64_t>(scenario.every, steps - k)));
    } catch (const std::exception& error) {
      return fmt::format("{:.1e}, then at {:.3g} s: {}", off, static_cast<double>(k + scenario.every) * h, error.what());
    }
    const double now = std::abs(peer->energy(0).total() - start) / scale;
    if (!(now < kBlownUp)) return fmt::format("blown up at {:.3g} s", static_cast<double>(k + scenario.every) * h);
    off = std::max(off, now);
  }
  return steps < scenario.steps ? fmt::format("{:.1e} in {:.3g} s", off, static_cast<double>(steps) * h)
                                : fmt::format("{:.1e}", off);
}

}  // namespace

void run_beside(Report& report, const Scenario& scenario, double scale) {
  if (!report.peers() || scenario.model->tree.bodies() > kMostBodies) return;
  for (const Contender& contender : installed_peers()) {
    const std::string found = apart([&] { return found_by(contender, scenario, scale); });
    report.beside(contender.description, printable(found));
  }
}
#else
void run_beside(Report&, const Scenario&, double) {}
#endif

}  // namespace linden
