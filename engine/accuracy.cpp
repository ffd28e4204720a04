#include "engine/accuracy.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "engine/baseline.hpp"
#include "engine/batch.hpp"
#include "engine/composition.hpp"
#include "layout/input_error.hpp"

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
constexpr double kReferenceShare = 0.22;  // of the budget, for each of the two
constexpr double kShort = 0.03;           // CPU seconds below which a run is timed again

constexpr AccuracyMethod kMethods[] = {{Kind::composed, 2}, {Kind::composed, 4}, {Kind::composed, 6},
                                       {Kind::composed, 8}, {Kind::rk4, 4},      {Kind::semi_implicit_euler, 1}};

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Whoever moves the model.
class Mover {
 public:
  virtual ~Mover() = default;
  /// False where the step failed.
  virtual bool step() = 0;
  virtual Energy energy() = 0;
  virtual std::optional<Momentum> momentum() = 0;
  virtual std::span<const double> positions() = 0;
  virtual std::int64_t evaluations() const = 0;
  virtual std::int64_t split_steps() const { return 0; }
  virtual std::string failure() const = 0;
};

class ComposedMover final : public Mover {
 public:
  ComposedMover(const AccuracySetup& setup, const Options& options) : simulation_(setup.model, options, setup.effects) {
    if (!setup.start.positions.empty()) simulation_.set_positions(setup.start.positions);
    if (!setup.start.velocities.empty()) simulation_.set_velocities(setup.start.velocities);
  }
  bool step() override {
    const StepReport report = simulation_.step();
    evaluations_ += report.evaluations;
    split_ += report.substeps > 1 ? 1 : 0;
    if (!report.ok()) failure_ = simulation_.describe(report);
    return report.ok();
  }
  Energy energy() override { return simulation_.energy(); }
  std::optional<Momentum> momentum() override { return simulation_.momentum(); }
  std::span<const double> positions() override { return simulation_.positions(); }
  std::int64_t evaluations() const override { return evaluations_; }
  std::int64_t split_steps() const override { return split_; }
  std::string failure() const override { return fmt::format("at {:.4g} s: {}", simulation_.time(), failure_); }

 private:
  Simulation simulation_;
  std::int64_t evaluations_ = 0, split_ = 0;
  std::string failure_;
};

class BaselineMover final : public Mover {
 public:
  BaselineMover(const AccuracySetup& setup, Scheme scheme, const Options& options)
      : baseline_(setup.model, scheme, options, setup.effects) {
    ComposedMover start(setup, options);  // says what the scene's start is where it leaves something out
    std::vector<double> v = setup.start.velocities;
    if (v.empty()) v.resize(static_cast<std::size_t>(setup.model->tree.shape.velocities));
    baseline_.set(start.positions(), v);
  }
  bool step() override { return baseline_.step(); }
  Energy energy() override { return baseline_.energy(); }
  std::optional<Momentum> momentum() override { return baseline_.momentum(); }
  std::span<const double> positions() override { return baseline_.positions(); }
  std::int64_t evaluations() const override { return baseline_.evaluations(); }
  std::string failure() const override { return fmt::format("at {:.4g} s: the result is not finite", baseline_.time()); }

 private:
  Baseline baseline_;
};

class SingleMover final : public Mover {
 public:
  SingleMover(const AccuracySetup& setup, const Options& options) : batch_(setup.model, 1, batch_options(options)) {
    ComposedMover start(setup, options);
    std::vector<double> v = setup.start.velocities;
    if (v.empty()) v.resize(static_cast<std::size_t>(setup.model->tree.shape.velocities));
    batch_.reset(0, start.positions(), v);
    positions_.resize(start.positions().size());
  }
  bool step() override {
    batch_.step();
    return batch_.summary().frozen == 0;
  }
  Energy energy() override {
    const auto seen = batch_.observe();
    return {static_cast<double>(seen.energies()(0, 0)), static_cast<double>(seen.energies()(0, 1))};
  }
  std::optional<Momentum> momentum() override { return std::nullopt; }
  std::span<const double> positions() override {
    Eigen::Map<Eigen::VectorXd>(positions_.data(), static_cast<Eigen::Index>(positions_.size())) =
        batch_.positions().instance(0).cast<double>();
    return positions_;
  }
  std::int64_t evaluations() const override { return batch_.summary().evaluations; }
  std::string failure() const override { return batch_.describe(0); }

 private:
  static BatchOptions batch_options(const Options& options) {
    BatchOptions result;
    result.step = options.step;
    result.gravity = options.gravity;
    result.threads = 1;
    return result;
  }
  FloatBatch batch_;
  std::vector<double> positions_;
};

std::unique_ptr<Mover> mover_of(const AccuracySetup& setup, const AccuracyMethod& method, double step, double tolerance) {
  Options options = setup.options;
  options.step = step;
  options.order = method.kind == Kind::composed ? method.order : 2;
  if (tolerance > 0) options.tolerance = tolerance;
  switch (method.kind) {
    case Kind::rk4: return std::make_unique<BaselineMover>(setup, Scheme::rk4, options);
    case Kind::semi_implicit_euler: return std::make_unique<BaselineMover>(setup, Scheme::semi_implicit_euler, options);
    case Kind::single: return std::make_unique<SingleMover>(setup, options);
    default: return std::make_unique<ComposedMover>(setup, options);
  }
}

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

class Measurement {
 public:
  Measurement(const AccuracySetup& setup, const std::function<bool(double)>& go_on)
      : setup_(setup), go_on_(go_on), begin_(Clock::now()) {
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
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  bool going(double until) {
    interrupted_ = interrupted_ || !go_on_(elapsed());
    return !interrupted_ && elapsed() < until;
  }

  std::int64_t samples() const { return std::llround(figures_.duration / every_); }

  /// The duration, cut where the least that is worth doing would not fit the budget.
  void fit_duration() {
    const double h = setup_.options.step;
    // sub-steps of the reference, and of all methods down to the step of the options, in units of the duration over that step
    constexpr double reference = 17, rows = 2 * 37;
    const Motion pilot =
        run(kMethods[0], h, setup_.options.tolerance, 0.02 * setup_.budget, 8, [](std::int64_t) { return false; });
    const double each = pilot.steps > 0 ? pilot.seconds / static_cast<double>(pilot.steps) : 0;
    double duration = setup_.duration;
    if (each > 0) duration = std::min(duration, 0.7 * setup_.budget * h / (each * (reference + rows)));
    figures_.duration = every_ * std::max(1.0, std::floor(duration / every_ * (1 + 1e-9)));
  }

  template <class Keep>
  Motion run(const AccuracyMethod& method, double step, double tolerance, double until, std::int64_t count, const Keep& keep) {
    Motion motion;
    const std::unique_ptr<Mover> mover = mover_of(setup_, method, step, tolerance);
    const auto chunk = std::llround(every_ / step);
    motion.energy = EnergyDrift(count + 1);
    const auto look = [&] {
      const Energy energy = mover->energy();
      motion.energy.add(static_cast<double>(motion.samples) * every_, energy);
      if (motion.momentum) motion.momentum->add(static_cast<double>(motion.samples) * every_, *mover->momentum(), energy);
      if (keep(motion.samples)) motion.positions.emplace_back(mover->positions().begin(), mover->positions().end());
    };
    if (const auto first = mover->momentum()) {
      motion.momentum = MomentumDrift::of(*setup_.model, setup_.options.gravity, 0, mover->positions(), *first);
    }
    look();
    while (motion.samples < count) {
      if (!going(until)) {
        motion.stopped = true;
        break;
      }
      const double begin = cpu_seconds();
      bool fine = true;
      for (std::int64_t k = 0; k < chunk && fine; ++k) {
        fine = mover->step();
        motion.steps += fine ? 1 : 0;
      }
      motion.seconds += cpu_seconds() - begin;
      if (!fine) {
        motion.failure = mover->failure();
        break;
      }
      motion.samples += 1;
      look();
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
  Agreement agreement(const Motion& a, const Motion& b) const {
    Agreement result;
    const std::size_t both = std::min(a.positions.size(), b.positions.size());
    for (std::size_t k = 0; k < both; ++k) {
      result.gap_at_end = std::max(result.gap_at_end, gap(a.positions[k], b.positions[k]));
      if (result.gap_at_end > kJudged) continue;
      result.judged = static_cast<std::int64_t>(k);
      result.gap = result.gap_at_end;
    }
    if (static_cast<std::int64_t>(both) <= samples()) result.gap_at_end = std::numeric_limits<double>::infinity();
    return result;
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
      Motion motion = run(method, h, kReferenceTolerance, until, samples(), [](std::int64_t) { return true; });
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
    reference.step = std::min(4 * h, every_);
    reference.rk4_step = h;
    std::optional<Motion> ours =
        refined(kMethods[3], reference.step, kSmallest * h, elapsed() + kReferenceShare * setup_.budget, nullptr);
    if (!ours) {
      reference.failure = "no run of order 8 came to its end";
      return;
    }
    const std::optional<Motion> theirs =
        refined(kMethods[4], reference.rk4_step, kSmallestOfRk4 * h, elapsed() + kReferenceShare * setup_.budget, &*ours);
    if (!theirs) {
      reference.failure = "no run of RK4 came to its end";
      return;
    }
    const Agreement found = agreement(*ours, *theirs);
    reference.gap_at_end = found.gap_at_end;
    const bool agreed = found.gap_at_end <= kAgreed;
    judged_ = agreed ? samples() : found.judged;
    reference.gap = agreed ? found.gap_at_end : found.gap;
    reference.horizon = static_cast<double>(judged_) * every_;
    reference.kinetic = ours->energy.scale();
    if (judged_ == 0) {
      reference.failure =
          fmt::format("order 8 and RK4 part within {:.3g} s, at the smallest steps that the time allowed", every_);
      return;
    }
    truth_ = std::move(ours->positions[static_cast<std::size_t>(judged_)]);
  }

  AccuracyRow row(const AccuracyMethod& method, double step, double tolerance) {
    AccuracyRow result;
    result.method = method;
    result.step = step;
    result.tolerance = tolerance;
    const auto keep = [&](std::int64_t sample) { return sample == judged_; };
    const Motion motion = run(method, step, tolerance, setup_.budget, samples(), keep);
    result.left_out = motion.stopped;
    result.failure = motion.failure;
    result.error = motion.positions.empty() ? kUnknown : std::max(figures_.reference.gap, gap(motion.positions[0], truth_));
    const double scale = figures_.reference.kinetic > 0 ? figures_.reference.kinetic : 1;
    result.band = motion.energy.band() / scale;
    result.slope = motion.energy.slope() / scale;
    result.slope_error = motion.energy.slope_error() / scale;
    result.momentum = motion.momentum ? std::max(motion.momentum->linear(), motion.momentum->angular()) : kUnknown;
    result.seconds = motion.seconds;
    result.steps = motion.steps;
    result.evaluations = motion.evaluations;
    result.split_steps = motion.split_steps;
    if (!result.done()) return result;
    for (int again = 0; again < 2 && motion.seconds < kShort && going(setup_.budget); ++again) {
      const Motion repeated = run(method, step, tolerance, setup_.budget, samples(), keep);
      if (!repeated.stopped) result.seconds = std::min(result.seconds, repeated.seconds);
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
      found.tolerance = tolerance;
      found.left_out = true;
    }
    before = found.left_out ? setup_.budget : elapsed() - begin;
    found.of_ladder = of_ladder;
    if (!interrupted_) figures_.rows.push_back(std::move(found));
  }

  void ladder() {
    std::vector<double> before(std::size(kMethods), 0.0);
    double step = every_;
    for (int k = 0; k < kLadder; ++k, step /= 2) {
      for (std::size_t m = 0; m < std::size(kMethods); ++m) {
        const bool solves = kMethods[m].kind == Kind::composed;
        add(kMethods[m], step, solves ? default_tolerance(kMethods[m].order) : 0, before[m], true);
      }
    }
    std::ranges::stable_sort(figures_.rows, {}, [&](const AccuracyRow& one) {
      return std::ranges::find(kMethods, one.method) - std::begin(kMethods);
    });
  }

  void others() {
    double before = 0;
    const double step = std::min(every_, setup_.options.step);
    for (const int order : {2, 6}) {
      for (const double tolerance : kTolerances) add({Kind::composed, order}, step, tolerance, before = 0, false);
    }
    const bool plain = setup_.effects.armature.empty() && setup_.effects.springs.empty() && setup_.effects.ball_springs.empty();
    if (plain) add({Kind::single, 2}, step, 0, before = 0, false);
  }

  const AccuracySetup& setup_;
  const std::function<bool(double)>& go_on_;
  Clock::time_point begin_;
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
  if (const std::string refused = irreversible(setup.effects); !refused.empty()) {
    throw InputError(
        fmt::format("accuracy compares methods of which most know gravity, armature and springs alone; the scene has {}: leave "
                    "{} out to learn what its motion between contacts and losses takes",
                    refused, refused.find(',') == refused.npos ? "it" : "them"));
  }
  return Measurement(setup, go_on).figures();
}

AccuracyRow measure_energy(const AccuracySetup& setup, const AccuracyMethod& method, double step, double tolerance,
                           double kinetic) {
  return Measurement(setup, [](double) { return true; }).energy(method, step, tolerance, kinetic);
}

std::vector<AccuracyFit> accuracy_fits(const AccuracyFigures& figures) {
  constexpr double kCoarse = 0.01, kCoarseOfLowOrder = 0.1, kFloor = 1e-13, kFalls = 1.6;
  constexpr std::size_t kRows = 3;
  std::vector<AccuracyFit> fits;
  for (const AccuracyMethod& method : kMethods) {
    // as long as the error falls, from large steps to small; where it falls no more it is rounding's, and ten times that is near
    // it
    std::vector<const AccuracyRow*> rows;
    double floor = std::max(kFloor, figures.reference.gap);
    for (const AccuracyRow& row : figures.rows) {
      if (row.method != method || !row.of_ladder || !row.done()) continue;
      if (!(row.error < (method.order > 2 ? kCoarse : kCoarseOfLowOrder)) || row.split_steps > 0) {
        rows.clear();
        continue;
      }
      if (!rows.empty() && row.error * kFalls > rows.back()->error) {
        floor = std::max(floor, row.error);
        break;
      }
      rows.push_back(&row);
    }
    std::erase_if(rows, [&](const AccuracyRow* row) { return row->error < 10 * floor; });
    if (rows.size() > kRows) rows.erase(rows.begin(), rows.end() - kRows);
    AccuracyFit fit{method, kUnknown, 0, 0, static_cast<int>(rows.size())};
    LineFit line;
    for (const AccuracyRow* row : rows) line.add(std::log(row->step), std::log(row->error));
    if (rows.size() == kRows) fit = {method, line.slope(), rows.front()->step, rows.back()->step, fit.rows};
    fits.push_back(fit);
  }
  return fits;
}

const AccuracyRow* cheapest(const AccuracyFigures& figures, double AccuracyRow::*value, double target, bool ours) {
  const AccuracyRow* best = nullptr;
  for (const AccuracyRow& row : figures.rows) {
    if (!row.of_ladder || !row.done() || !(row.*value <= target) || (row.method.kind == Kind::composed) != ours) continue;
    if (best == nullptr || row.seconds < best->seconds) best = &row;
  }
  return best;
}

}  // namespace linden
