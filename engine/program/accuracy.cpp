#include "engine/program/accuracy.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "engine/compose/composition.hpp"
#include "engine/program/accuracy_mover.hpp"

namespace linden {
namespace {

using Clock = std::chrono::steady_clock;
using Kind = AccuracyMethod::Kind;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr int kLargest = 16, kLadder = 7;  // largest step in steps of the options, steps of the ladder
constexpr double kTolerances[] = {1e-6, 1e-8, 1e-10, 1e-12};
constexpr double kReferenceTolerance = 1e-13, kSettledGap = 1e-12;
/// Smallest steps of the reference in steps of the options: on chaotic motions half a step more gains no more than a moment.
constexpr double kSmallest = 1.0 / 8, kSmallestOfRk4 = 1.0 / 32;
/// Of order 2 against itself, which gains a factor of two to four a halving. What is sudden leaves little below its own tolerance.
constexpr double kSmallestAlone = 1.0 / 64, kAloneTolerance = 1e-11, kJudgedAlone = 1e-3;
constexpr double kReferenceShare = 0.22;  // of the budget, for each of the two
constexpr double kShort = 0.03;           // CPU seconds below which a run is timed again

constexpr AccuracyMethod kOrder2{Kind::composed, 2}, kOrder6{Kind::composed, 6}, kOrder8{Kind::composed, 8}, kRk4{Kind::rk4, 4},
    kEuler{Kind::semi_implicit_euler, 1};

/// Those that know what the scene's effects and couplings do.
std::vector<AccuracyMethod> methods_for(const Model& model, const Effects& effects) {
  std::vector<AccuracyMethod> methods{kOrder2};
  if (irreversible(effects).empty()) methods.insert(methods.end(), {{Kind::composed, 4}, kOrder6, kOrder8});
  if (sudden(effects).empty() && model.couplings.empty()) methods.insert(methods.end(), {kRk4, kEuler});
  return methods;
}

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// What is looked at in a run: the clock alone; places; or energies as well, as often as a run looks at them.
enum class Watch { time, places, energy };

/// A run of whole samples, `every` seconds apart.
struct Motion {
  std::vector<std::vector<double>> positions;  // of the samples that were to be kept, from time 0 on
  std::int64_t samples = 0;                    // that were reached, that at time 0 not counted
  EnergyDrift energy;
  std::optional<MomentumDrift> momentum;
  double seconds = 0;
  std::int64_t steps = 0, evaluations = 0, split_steps = 0;
  std::string failure;
  bool stopped = false;
};

class AccuracyMeasurement {
 public:
  AccuracyMeasurement(const AccuracySetup& setup, const std::function<bool(double)>& go_on)
      : setup_(setup), go_on_(go_on), begin_(Clock::now()), methods_(methods_for(*setup.model, setup.effects)),
        reversible_(irreversible(setup.effects).empty()) {
    figures_.asked = setup.duration;
    every_ = kLargest * setup.options.step;
    while (every_ > setup.duration / 4 && every_ > setup.options.step) every_ /= 2;
  }

  AccuracyFigures figures() && {
    fit_duration();
    find_reference();
    if (figures_.reference.failure.empty()) {
      ladder();
      others();
    }
    figures_.interrupted = interrupted_;
    return std::move(figures_);
  }

  AccuracyRow energy(const AccuracyMethod& method, double step, double tolerance, double kinetic) {
    every_ = std::max(1.0, std::round(every_ / step)) * step;
    figures_.duration = every_ * std::max(1.0, std::round(setup_.duration / every_));
    figures_.reference.kinetic = kinetic;
    judged_ = -1;
    return row(method, step, tolerance);
  }

 private:
  static bool none(std::int64_t) { return false; }
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  bool going(double until) {
    interrupted_ = interrupted_ || !go_on_(elapsed());
    return !interrupted_ && elapsed() < until;
  }

  std::int64_t samples() const { return std::llround(figures_.duration / every_); }

  /// The duration, cut where the least that is worth doing would not fit the budget.
  void fit_duration() {
    const double h = setup_.options.step;
    // sub-steps of the reference, and of all methods down to the step of the options, in units of the duration over that step; each once to
    // look at and once or more to time
    constexpr double reference = 17, rows = 3.5 * 39;
    const Motion pilot =
        run(kOrder2, h, setup_.options.tolerance, 0.02 * setup_.budget, 8, Watch::time, none);
    // where not one step was taken in the time for it, the least there is
    const double fits = pilot.steps > 0 ? 0.7 * setup_.budget * h * static_cast<double>(pilot.steps) / (pilot.seconds * (reference + rows)) : 0;
    const double duration = std::min(setup_.duration, fits);
    figures_.duration = every_ * std::max(1.0, std::floor(duration / every_ * (1 + 1e-9)));
  }

  template <class Keep>
  Motion run(const AccuracyMethod& method, double step, double tolerance, double until, std::int64_t count, Watch watch, const Keep& keep) {
    Motion motion;
    const std::unique_ptr<Mover> mover = mover_of(setup_, method, step, tolerance);
    const auto chunk = std::llround(every_ / step);
    const std::int64_t stride = watch == Watch::energy ? std::min<std::int64_t>(energy_stride(count * chunk), chunk) : chunk;
    motion.energy = EnergyDrift(count * chunk / stride + 1);
    const auto look = [&] {
      if (watch == Watch::time) return;
      const Energy energy = mover->energy();
      const double time = static_cast<double>(motion.steps) * step;
      // what effects took is still part of the account; who does not count it has none
      const Energy account{energy.kinetic, energy.potential + (reversible_ ? 0 : mover->gone())};
      motion.energy.add(time, account);
      if (motion.momentum) motion.momentum->add(time, *mover->momentum(), energy);
    };
    const auto keep_place = [&] {
      if (keep(motion.samples)) motion.positions.emplace_back(mover->positions().begin(), mover->positions().end());
    };
    if (const auto first = mover->momentum(); first && !act_from_outside(setup_.effects)) {
      motion.momentum = MomentumDrift::of(*setup_.model, setup_.options.gravity, 0, mover->positions(), *first);
    }
    look();
    keep_place();
    while (motion.samples < count) {
      if (!going(until)) {
        motion.stopped = true;
        break;
      }
      const double begin = cpu_seconds();
      bool fine = true;
      for (std::int64_t k = 1; k <= chunk && fine; ++k) {
        fine = mover->step();
        motion.steps += fine ? 1 : 0;
        if (fine && (k % stride == 0 || k == chunk)) look();
      }
      motion.seconds += cpu_seconds() - begin;
      if (!fine) {
        motion.failure = mover->failure();
        break;
      }
      motion.samples += 1;
      keep_place();
    }
    motion.evaluations = mover->evaluations();
    motion.split_steps = mover->split_steps();
    return motion;
  }

  /// Largest difference of a coordinate.
  double gap(const std::vector<double>& a, const std::vector<double>& b) const {
    double largest = 0;
    const Tree& tree = setup_.model->tree;
    for (Index i = 1; i < tree.shape.slots; ++i) {
      const auto at = static_cast<std::size_t>(tree.first_q(i));
      const auto plain = [&](std::size_t first, std::size_t count, double factor, double sign) {
        for (std::size_t k = first; k < first + count; ++k) largest = std::max(largest, factor * std::abs(a[k] - sign * b[k]));
      };
      const auto turn = [&](std::size_t first) {
        double along = 0;
        for (std::size_t k = first; k < first + 4; ++k) along += a[k] * b[k];
        plain(first, 4, 2, along < 0 ? -1 : 1);  // q and -q are the same orientation
      };
      switch (tree.kind(i)) {
        case JointKind::screw: plain(at, 1, 1, 1); break;
        case JointKind::ball: turn(at); break;
        case JointKind::free: plain(at, 3, 1, 1); turn(at + 3);
      }
    }
    return std::isfinite(largest) ? largest : std::numeric_limits<double>::infinity();
  }

  /// Samples up to which two motions agree, and how far they part over all.
  struct Agreement {
    std::int64_t judged = 0;
    double gap = 0, gap_at_end = 0;
  };
  Agreement agreement(const Motion& a, const Motion& b, double judged = kJudged) const {
    Agreement result;
    const std::size_t both = std::min(a.positions.size(), b.positions.size());
    for (std::size_t k = 0; k < both; ++k) {
      result.gap_at_end = std::max(result.gap_at_end, gap(a.positions[k], b.positions[k]));
      if (result.gap_at_end > judged) continue;
      result.judged = static_cast<std::int64_t>(k);
      result.gap = result.gap_at_end;
    }
    if (static_cast<std::int64_t>(both) <= samples()) result.gap_at_end = std::numeric_limits<double>::infinity();
    return result;
  }

  /// The motion of order 2 with its leading error taken away by that of twice the step: of order 4, and independent of RK4.
  Motion extrapolated(Motion fine, const Motion& coarse) const {
    const std::size_t both = std::min(fine.positions.size(), coarse.positions.size());
    for (std::size_t k = 0; k < both; ++k) {
      for (std::size_t row = 0; row < fine.positions[k].size(); ++row) {
        fine.positions[k][row] += (fine.positions[k][row] - coarse.positions[k][row]) / 3;
      }
    }
    fine.positions.resize(both);
    return fine;
  }

  Motion reference_run(const AccuracyMethod& method, double step, double until) {
    const auto all = [](std::int64_t) { return true; };
    Motion motion = run(method, step, kReferenceTolerance, until, samples(), Watch::places, all);
    if (method != kOrder2 || motion.stopped || !motion.failure.empty()) return motion;
    Motion coarse = run(method, 2 * step, kReferenceTolerance, until, samples(), Watch::places, all);
    if (coarse.stopped || !coarse.failure.empty()) return coarse;
    return extrapolated(std::move(motion), coarse);
  }

  /// Halves the step until the motion changes no more against `other` (null: against itself) or the time is up. Nothing where no
  /// run got through.
  std::optional<Motion> refined(const AccuracyMethod& method, double& step, double smallest, double until, const Motion* other) {
    std::optional<Motion> best;
    Agreement last;
    double taken = 0;
    for (double h = step; h > 0.99 * smallest; h /= 2) {
      const double begin = elapsed();
      if (best && begin + 2.2 * taken > until) break;
      Motion motion = reference_run(method, h, until);
      taken = elapsed() - begin;
      if (motion.stopped) break;
      const bool reached = motion.failure.empty();
      if (!reached && begin + 2.2 * taken > until) break;
      if (!reached) continue;
      const Motion* against = other != nullptr ? other : best ? &*best : nullptr;
      const bool first = !best;
      if (against == nullptr) {
        best = std::move(motion);
        step = h;
        continue;
      }
      const Agreement now = agreement(motion, *against);
      // an agreement that grows no further is rounding's, or chaos'
      const bool better = first || last.gap_at_end == 0 || now.gap_at_end < 0.5 * last.gap_at_end || now.judged > last.judged;
      if (better || other == nullptr) {
        best = std::move(motion);
        step = h;
      }
      const bool settled = now.gap_at_end < kSettledGap;
      const bool stuck = !better && now.judged <= last.judged;
      last = now;
      if (settled || stuck) break;
    }
    return best;
  }

  void find_reference() {
    AccuracyReference& reference = figures_.reference;
    const double h = setup_.options.step;
    const bool has_rk4 = std::ranges::find(methods_, kRk4) != methods_.end();
    if (!has_rk4 && !reversible_) return find_reference_alone();
    reference.method = reversible_ ? kOrder8 : kOrder2;
    reference.other = has_rk4 ? kRk4 : kOrder6;
    reference.step = reversible_ ? std::min(4 * h, every_) : std::min(h, every_ / 2);
    reference.other_step = h;
    const double smallest = reversible_ ? kSmallest : kSmallestOfRk4;
    std::optional<Motion> ours =
        refined(reference.method, reference.step, smallest * h, elapsed() + kReferenceShare * setup_.budget, nullptr);
    if (!ours) {
      reference.failure = fmt::format("no run of {} came to its end", name(reference.method));
      return;
    }
    const std::optional<Motion> theirs =
        refined(reference.other, reference.other_step, (has_rk4 ? kSmallestOfRk4 : kSmallest) * h, elapsed() + kReferenceShare * setup_.budget, &*ours);
    if (!theirs) {
      reference.failure = fmt::format("no run of {} came to its end", name(reference.other));
      return;
    }
    const Agreement found = agreement(*ours, *theirs);
    judge(std::move(*ours), found, kAgreed);
  }

  /// Where no other method knows the effects: order 2 against itself at twice the step.
  void find_reference_alone() {
    AccuracyReference& reference = figures_.reference;
    const double until = elapsed() + 2 * kReferenceShare * setup_.budget;
    reference.method = reference.other = kOrder2;
    std::optional<Motion> last, before;
    double taken = 0;
    for (double h = std::min(setup_.options.step, every_); h > 0.99 * kSmallestAlone * setup_.options.step; h /= 2) {
      const double begin = elapsed();
      if (before && begin + 2.2 * taken > until) break;
      Motion motion = run(kOrder2, h, kAloneTolerance, until, samples(), Watch::places, [](std::int64_t) { return true; });
      taken = elapsed() - begin;
      if (motion.stopped) break;
      if (!motion.failure.empty()) continue;
      before = std::move(last);
      last = std::move(motion);
      reference.other_step = reference.step;
      reference.step = h;
    }
    if (!before) {
      reference.failure = "no two runs of order 2 came to their end";
      return;
    }
    const Agreement found = agreement(*last, *before, kJudgedAlone);
    judge(std::move(*last), found, kJudgedAlone);
  }

  void judge(Motion ours, const Agreement& found, double agreed) {
    AccuracyReference& reference = figures_.reference;
    reference.gap_at_end = found.gap_at_end;
    const bool over_all = found.gap_at_end <= agreed;
    judged_ = over_all ? samples() : found.judged;
    reference.gap = over_all ? found.gap_at_end : found.gap;
    reference.horizon = static_cast<double>(judged_) * every_;
    reference.kinetic = ours.energy.scale();
    figures_.moves = is_motion(*setup_.model, reference.kinetic);
    if (judged_ == 0) {
      reference.failure = fmt::format("{} and {} part within {:.3g} s, at the smallest steps that the time allowed", name(reference.method),
                                      name(reference.other), every_);
      return;
    }
    truth_ = std::move(ours.positions[static_cast<std::size_t>(judged_)]);
  }

  /// 0 stands for the method's own.
  static double shown(const AccuracyMethod& method, double tolerance) {
    return tolerance == 0 && method.kind == Kind::composed ? default_tolerance(method.order) : tolerance;
  }

  AccuracyRow row(const AccuracyMethod& method, double step, double tolerance) {
    AccuracyRow result;
    result.method = method;
    result.step = step;
    result.tolerance = shown(method, tolerance);
    const auto keep = [&](std::int64_t sample) { return sample == judged_; };
    const Motion motion = run(method, step, tolerance, setup_.budget, samples(), Watch::energy, keep);
    result.left_out = motion.stopped;
    result.failure = motion.failure;
    result.error = motion.positions.empty() ? kUnknown : std::max(figures_.reference.gap, gap(motion.positions[0], truth_));
    const double scale = figures_.reference.kinetic > 0 ? figures_.reference.kinetic : 1;
    result.band = motion.energy.band() / scale;
    result.slope = motion.energy.slope() / scale;
    result.slope_error = motion.energy.slope_error() / scale;
    result.momentum = motion.momentum ? std::max(motion.momentum->linear(), motion.momentum->angular()) : kUnknown;
    result.steps = motion.steps;
    result.evaluations = motion.evaluations;
    result.split_steps = motion.split_steps;
    result.seconds = motion.seconds;
    if (!result.done()) return result;
    for (int k = 0; k == 0 || (k < 3 && result.seconds < kShort && going(setup_.budget)); ++k) {
      const Motion timed = run(method, step, tolerance, setup_.budget, samples(), Watch::time, none);
      if (!timed.stopped) result.seconds = k == 0 ? timed.seconds : std::min(result.seconds, timed.seconds);
      result.left_out = result.left_out || (k == 0 && timed.stopped);
    }
    return result;
  }

  /// Appends a row, or where it took `before` seconds at twice the step and would not fit, what was left out.
  void add(const AccuracyMethod& method, double step, double tolerance, double& before, bool of_ladder) {
    const double begin = elapsed();
    AccuracyRow found;
    if (begin + 2 * before < setup_.budget && going(setup_.budget)) {
      found = row(method, step, tolerance);
    } else {
      found.method = method;
      found.step = step;
      found.tolerance = shown(method, tolerance);
      found.left_out = true;
    }
    before = found.left_out ? setup_.budget : elapsed() - begin;
    found.of_ladder = of_ladder;
    if (!interrupted_) figures_.rows.push_back(std::move(found));
  }

  void ladder() {
    std::vector<double> before(methods_.size(), 0.0);
    double step = every_;
    for (int k = 0; k < kLadder; ++k, step /= 2) {
      for (std::size_t m = 0; m < methods_.size(); ++m) {
        add(methods_[m], step, 0, before[m], true);
      }
    }
    std::ranges::stable_sort(figures_.rows, {},
                             [&](const AccuracyRow& one) { return std::ranges::find(methods_, one.method) - methods_.begin(); });
  }

  void others() {
    double before = 0;
    const double step = std::min(every_, setup_.options.step);
    for (const AccuracyMethod& method : methods_) {
      if (method.kind != Kind::composed || (method.order != 2 && method.order != 6)) continue;
      for (const double tolerance : kTolerances) add(method, step, tolerance, before = 0, false);
    }
    add({Kind::single, 2}, step, 0, before = 0, false);
  }

  const AccuracySetup& setup_;
  const std::function<bool(double)>& go_on_;
  Clock::time_point begin_;
  std::vector<AccuracyMethod> methods_;
  bool reversible_;  // all effects are
  double every_;  // [s] between samples, the largest step
  bool interrupted_ = false;
  std::int64_t judged_ = 0;  // the sample at the horizon
  std::vector<double> truth_;
  AccuracyFigures figures_;
};

}  // namespace

std::string name(const AccuracyMethod& method) {
  switch (method.kind) {
    case Kind::rk4: return "RK4";
    case Kind::semi_implicit_euler: return "semi-implicit Euler";
    case Kind::single: return fmt::format("order {}, single", method.order);
    default: return fmt::format("order {}", method.order);
  }
}

AccuracyFigures measure_accuracy(const AccuracySetup& setup, const std::function<bool(double)>& go_on) {
  check(setup.options);
  return AccuracyMeasurement(setup, go_on).figures();
}

AccuracyRow measure_energy(const AccuracySetup& setup, const AccuracyMethod& method, double step, double tolerance,
                           double kinetic) {
  return AccuracyMeasurement(setup, [](double) { return true; }).energy(method, step, tolerance, kinetic);
}

}  // namespace linden
