#include "engine/step_pilot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/drift.hpp"

namespace linden {
namespace {

constexpr int kPilotSteps = 2000, kFewest = 200;
constexpr int kBegin = 50;  // steps in which the length is still found
constexpr double kNothingToWin = 2, kJump = 0.3, kMostJumps = 0.1;

constexpr int kTrials = 8;
constexpr double kLongest = 2;              // mean variable steps
constexpr double kPart = 0.2;              // of the accuracy that is kept over the stretch
constexpr std::int64_t kMostFixed = 20000;  // steps of one trial

/// Band of H + taken - given over the largest kinetic energy, of fixed steps of h from the same state; infinite where one fails.
double band_of_fixed(const Simulation& from, const std::vector<double>& velocities, double h, double duration) {
  Options options = from.options();
  options.vary = false;
  options.step = h;
  Simulation fixed(std::shared_ptr<const Model>(std::shared_ptr<void>(), &from.model()), options, from.effects());
  fixed.set_positions(from.positions());
  fixed.set_velocities(velocities);
  EnergyDrift drift;
  const auto look = [&] { drift.add(fixed.time(), fixed.energy(), fixed.effect_work().taken(), fixed.effect_work().given()); };
  look();
  for (std::int64_t k = 0; k < kMostFixed && fixed.time() < duration; ++k) {
    if (!fixed.step().ok()) return HUGE_VAL;
    look();
  }
  return drift.scale() > 0 ? drift.band() / drift.scale() : 0;
}

}  // namespace

StepPilot pilot(Simulation& simulation, double duration) {
  const std::string begin = simulation.checkpoint();
  const double end = simulation.time() + duration, from = simulation.time();
  std::vector<double> lengths;
  bool ok = true;
  for (int k = 0; k < kPilotSteps && ok && simulation.time() < end; ++k) {
    ok = simulation.step().ok();
    if (ok && k >= kBegin) lengths.push_back(simulation.last_step());
  }
  const double span = simulation.time() - from;
  simulation.restore(begin);
  if (!ok) return {true, 0, "a trial step failed"};
  if (lengths.size() < kFewest) return {true, 0, "too few steps to compare"};

  double sum = 0;
  std::size_t jumps = 0;
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    sum += lengths[k];
    if (k > 0 && std::abs(std::log(lengths[k] / lengths[k - 1])) > kJump) ++jumps;
  }
  const double mean = sum / static_cast<double>(lengths.size()), jumping = static_cast<double>(jumps) / static_cast<double>(lengths.size());
  const auto shortest = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 100);
  std::ranges::nth_element(lengths, shortest);
  const double ratio = mean / *shortest;
  if (ratio >= kNothingToWin && jumping <= kMostJumps) {
    return {true, 0, fmt::format("the mean step of a trial is {:.2g} times the one that 1 % are shorter than", ratio)};
  }
  const double asked = kPart * *simulation.options().accuracy, order = simulation.options().order;
  const std::vector<double> velocities = simulation.velocities();
  double h = *shortest, best = 0, tried = 0;
  const double longest = std::min(kLongest * mean, 100 * simulation.options().step);
  for (int trial = 0; trial < kTrials; ++trial) {
    const double band = band_of_fixed(simulation, velocities, h, span);
    if (band <= asked) best = std::max(best, h);
    tried = h;
    h = std::min(h * std::clamp(std::pow(0.8 * asked / std::max(band, 1e-300), 1 / order), 0.3, 1.5), longest);
    if (best > 0 && h <= 1.1 * best) break;
  }
  h = best > 0 ? best : tried;
  h = duration / std::ceil(duration / h);
  const std::string why = jumping > kMostJumps ? fmt::format("{:.0f} % of trial steps differ by more than a third from the one before", 100 * jumping)
                                               : fmt::format("the mean step of a trial is but {:.2g} times the one that 1 % are shorter than", ratio);
  return {false, h, why};
}

}  // namespace linden
