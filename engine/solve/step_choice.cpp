#include "engine/solve/step_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/compose/composition.hpp"
#include "kernels/values/spatial.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {
namespace {

constexpr double kLargestTheta = 0.15;   // h R stays below 0.3
constexpr double kLongestStep = 100;     // steps of Options::step
constexpr double kLongestTime = 1000;    // likewise: of 1/R in T*
constexpr double kMostGrowth = 2;        // from one step to the next
constexpr double kMostCarried = 2;       // of the density

constexpr double kFilter = 1.0 / 200, kGain = 2e-3, kMostChange = 0.03, kMostBeta = 0.2, kDecay = 29.0 / 30;
constexpr std::int64_t kSteeredFrom = 100;

constexpr double kLower = 0.7;
constexpr int kMostLowered = 10;
constexpr std::int64_t kBetweenLowered = 1000;

/// Energy band over theta^r.
double band_constant(int order) {
  switch (order) {
    case 2: return 4;
    case 4: return 0.4;
    case 6: return 0.75;
    default: return 1;
  }
}

int order_for(double accuracy) { return accuracy >= 1e-3 ? 2 : accuracy >= 1e-6 ? 4 : accuracy >= 1e-9 ? 6 : 8; }

bool can_go_back(const Model& model, const Effects& effects) {
  return irreversible(effects).empty() && std::ranges::none_of(model.couplings, [](const Coupling& one) { return damps(one); });
}

}  // namespace

Options with_accuracy(const Options& options, const Model& model, const Effects& effects) {
  Options chosen = options;
  if (!options.accuracy) return chosen;
  const bool usual = options.tolerance == default_tolerance(options.order);
  if (can_go_back(model, effects)) chosen.order = std::max(options.order, order_for(*options.accuracy));
  if (chosen.order != options.order && usual) use_default_tolerance(chosen);
  return chosen;
}

StepChoice::StepChoice(const Options& options, bool steers)
    : order_(options.order), every_(options.order == 2 ? 4 : 1), steers_(steers), accuracy_(*options.accuracy), step_(options.step) {
  begin();
}

void StepChoice::begin() {
  law_ = {};
  lengths_ = {.accuracy = accuracy_};
  // to so many digits that it is the same wherever pow is
  law_.theta = static_cast<float>(std::min(kLargestTheta, std::pow(accuracy_ / band_constant(order_), 1.0 / order_)));
}

void StepChoice::begin_energy() {
  law_.begun = false;
  law_.steered = 0;
  law_.beta = law_.change = law_.filtered = law_.variance = 0;
}

double StepChoice::wish() const {
  if (law_.density == 0) return std::numeric_limits<double>::infinity();
  const double grows = law_.density_before > 0 ? std::clamp(law_.density / law_.density_before, 1 / kMostCarried, kMostCarried) : 1;
  const double beta = law_.beta;
  return law_.theta * (1 + beta + 0.5 * beta * beta) / (law_.density * grows);
}

double StepChoice::next(double before) const {
  return law_.steps == 0 ? step_ : std::min({wish(), kLongestStep * step_, kMostGrowth * before});
}

void StepChoice::add(double h, const BodyConstants<double>& constants, const Field<double, 6>& before, const Field<double, 6>& now, double apart) {
  double kinetic = 0, accelerating = 0, turning = 0, fast = 0;
  const double rate = 1 / apart;
  for (Index i = 1; i < now.rows(); ++i) {
    const auto G = load<Inertia, double>(constants.inertia, i);
    const auto V = load<Twist, double>(now, i), past = load<Twist, double>(before, i);
    const Twist<double> A{rate * (V.w - past.w), rate * (V.v - past.v)};
    const Wrench<double> m = G * V, f = G * A;
    const double energy = 0.5 * (dot(m.n, V.w) + dot(m.f, V.v)), ww = dot(V.w, V.w), quick = ww * ww + dot(A.w, A.w);
    kinetic += energy;
    accelerating += 0.5 * (dot(f.n, A.w) + dot(f.f, A.v));
    turning += energy * ww;
    fast += quick * quick;
  }
  const double squared = std::sqrt(std::sqrt(fast));  // R^2
  const double longest = kLongestTime * kLongestTime * step_ * step_;
  const double time = squared * longest > 1 ? 1 / squared : longest;
  law_.most_energy = std::max(law_.most_energy, kinetic + accelerating * time);
  const double exchanged = law_.most_energy > 0 ? (accelerating + turning) / law_.most_energy : 0;
  law_.density_before = law_.density;
  law_.density = std::sqrt(exchanged + 0.25 * squared);
  law_.beta = std::clamp(kDecay * law_.beta + law_.change, -kMostBeta, kMostBeta);
  law_.steps += 1;
  lengths_.shortest = law_.steps == 1 ? h : std::min(lengths_.shortest, h);
  lengths_.longest = std::max(lengths_.longest, h);
  lengths_.sum += h;
}

void StepChoice::steer(double energy, double kinetic) {
  if (!law_.begun) {
    law_.begin = energy;
    law_.begun = true;
    law_.kinetic = std::max(law_.kinetic, kinetic);
    return;
  }
  law_.steered += every_;
  law_.kinetic = std::max(law_.kinetic, kinetic);
  const double e = energy - law_.begin, share = every_ * kFilter;
  law_.lowest = std::min(law_.lowest, e);
  law_.highest = std::max(law_.highest, e);
  law_.filtered += share * (e - law_.filtered);
  const double w = law_.filtered - e;
  law_.variance += share * (w * w - law_.variance);
  law_.change = 0;
  if (law_.steered < kSteeredFrom) return;
  if (steers_ && law_.variance > 0) {
    law_.change = -std::clamp(kGain * law_.filtered * w / (order_ * law_.variance), -kMostChange, kMostChange);
  }
  const bool waits = lengths_.lowered > 0 && law_.steps < law_.lowered_at + kBetweenLowered;
  if (std::abs(e) > (1 + lengths_.lowered) * accuracy_ * law_.kinetic && !waits && lengths_.lowered < kMostLowered) {
    law_.theta *= kLower;
    law_.lowered_at = law_.steps;
    lengths_.lowered += 1;
  }
}

StepLengths StepChoice::report() const {
  StepLengths report{.steps = law_.steps, .shortest = lengths_.shortest, .longest = lengths_.longest};
  if (law_.steps > 0) report.mean = lengths_.sum / static_cast<double>(law_.steps);
  report.retaken = lengths_.retaken;
  report.accuracy = accuracy_;
  if (law_.kinetic > 0) report.strayed = (law_.highest - law_.lowest) / law_.kinetic;
  report.lowered = lengths_.lowered;
  return report;
}

}  // namespace linden
