// Compiled with effects and without; CMakeLists.txt says which: LINDEN_ACTING is true or false.
#include "engine/solve/tree_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/guess/first_guess.hpp"
#include "engine/solve/convergence.hpp"
#include "engine/solve/diagnosis.hpp"
#include "kernels/tree/largest_turn.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"

namespace linden {
namespace {

constexpr int kMaxBacktracks = 10;

/// Only a residual within this factor of the tolerance is looked at for bare rounding: the look costs a tenth of a correction.
constexpr double kNearTolerance = 1e4;

/// Revisions of effects' states in one solve: a pile of joints that stick and slide at once takes some ten.
constexpr int kMostRevisions = 20, kLastRevision = 60;

/// From then on they are made one by one.
constexpr int kBulkRevisions = 5;

/// Where they do not settle: speeds up to which friction is made smooth, one after the other [m/s, rad/s].
constexpr double kSoftCreeps[] = {1e-2, 1e-3, 1e-4, 1e-5};
constexpr int kMostSoftCorrections = 40;

/// A correction is cut where the slope at its end is steeper than this share of that at its beginning, the other way.
constexpr double kSteepest = 0.5;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

template <bool kEffects>
TreeStepper<kEffects>::TreeStepper(const Model& model, const Options& options, const EffectPlan& plan)
    : model_(model),
      options_(options),
      max_iterations_(options.max_iterations > 0 ? options.max_iterations : options.solver == Solver::newton ? 50 : 1000),
      has_stages_(options.order != 2),
      sweeps_(model, options, plan),
      work_(sweeps_.work()),
      effects_(sweeps_.effects()),
      blows_(sweeps_, model.tree.shape.velocities) {
  check(options);
  last_good_.allocate(model.tree.shape);
  before_.allocate(model.tree.shape.velocities);
  if constexpr (kEffects) {
    before_innovation_.allocate(model.tree.shape.velocities);
    keep(last_good_);  // no step allocates
  }
}

template <bool kEffects>
StepReport TreeStepper<kEffects>::step(State<double>& state, int& history, double time, double h, bool another) {
  StepReport report;
  time_ = time;
  clear_account();
  bool changes = false;  // before a solve fails: parts of the step are taken, or a start is struck at its limits
  if constexpr (kEffects) {
    changes = effects_.plan().bounces || (state.last_step(0) == 0 && !effects_.plan().effects.limits.empty());
  }
  if (changes) keep(state);
  const int history_before = history;
  report.status = advance(state, history, h, another, report);
  if (report.ok()) return report;
  // The whole step failed: two halves, each split again if need be, from the state as it was.
  if (changes) {
    restore(state);
  } else {
    keep(state);
  }
  history = 0;
  report.substeps = report.blows = 0;
  if (halves(state, history, h, 1, report)) {
    report.status = StepStatus::converged;
    report.slot = 0;
    return report;
  }
  report.residual = failed_residual_;
  restore(state);
  history = history_before;
  return report;
}

/// The state at the beginning of the step, and what effects keep beside it.
template <bool kEffects>
void TreeStepper<kEffects>::keep(const State<double>& state) {
  last_good_ = state;
  if constexpr (kEffects) {
    last_memory_.clear();
    for (const std::span<double> numbers : effects_.memory()) last_memory_.insert(last_memory_.end(), numbers.begin(), numbers.end());
  }
}

template <bool kEffects>
void TreeStepper<kEffects>::restore(State<double>& state) {
  state = last_good_;
  clear_account();
  if constexpr (kEffects) {
    auto next = last_memory_.begin();
    for (const std::span<double> numbers : effects_.memory()) {
      std::copy_n(next, numbers.size(), numbers.begin());
      next += static_cast<std::ptrdiff_t>(numbers.size());
    }
  }
  sweeps_.refresh(state.q);
}

template <bool kEffects>
StepStatus TreeStepper<kEffects>::advance(State<double>& state, int& history, double h, bool another, StepReport& report) {
  if constexpr (kEffects) {
    if (state.last_step(0) == 0) strike(state, h, false, report);
    if (effects_.plan().bounces) return advance_with_blows(state, history, h, report);
  }
  const StepStatus status = solve(state, history, h, report);
  if (status == StepStatus::converged) finish(state, history, h, another, report);
  return status;
}

/// A step in parts, from one blow on a limit to the next.
template <bool kEffects>
StepStatus TreeStepper<kEffects>::advance_with_blows(State<double>& state, int& history, double h, StepReport& report)
  requires kEffects
{
  constexpr double kNothingLeft = 1e-12;
  double left = h;
  for (int blows = 0; left > kNothingLeft * h; ++blows) {
    passable_ = blows < kMostBlows;
    StepStatus status = solve(state, history, left, report);
    if (status != StepStatus::converged) return status;
    double part = left;
    if (passable_ && blows_.passed(state) > 0) part = time_of_blow(state, left, report);
    if (part == 0) {
      // no such time is found: the joint stops at its limit
      passable_ = false;
      status = solve(state, 0, left, report);
      if (status != StepStatus::converged) return status;
      part = left;
    }
    finish(state, history, part, false, report);
    if (part < left || blows > 0) history = 0;
    left -= part;
  }
  return StepStatus::converged;
}

/// When within h a joint that bounces meets its limit first; the step to there is the solution found last. 0: not found.
template <bool kEffects>
double TreeStepper<kEffects>::time_of_blow(State<double>& state, double h, StepReport& report)
  requires kEffects
{
  constexpr int kMostTrials = 40;
  constexpr double kMet = 1e-13;  // [rad, m]
  double late = h, passed_late = blows_.passed(state);
  std::ranges::fill(work_.delta.flat(), 0.0);
  double early = 0, passed_early = blows_.passed(state);
  double t = h, passed = passed_late;
  for (int trial = 0, side = 0; trial < kMostTrials; ++trial) {
    t = (early * passed_late - late * passed_early) / (passed_late - passed_early);
    if (!(t > early && t < late)) break;
    if (solve(state, 0, t, report) != StepStatus::converged) return 0;
    passed = blows_.passed(state);
    if (std::abs(passed) <= kMet) return t;
    if (passed > 0) {
      late = t;
      passed_late = passed;
      if (side > 0) passed_early /= 2;
      side = 1;
    } else {
      early = t;
      passed_early = passed;
      if (side < 0) passed_late /= 2;
      side = -1;
    }
  }
  return std::abs(passed) <= 0.1 * kAtLimit && t > 0 && t <= h ? t : 0;
}

/// Blows at a state, the last step of which was one of h. Afterwards the displacement of that step is the one that the velocity after the
/// blows would have made of it: what works along the mean of both finds it there. Returns whether there was one.
template <bool kEffects>
bool TreeStepper<kEffects>::strike(State<double>& state, double h, bool arrived, StepReport& report)
  requires kEffects
{
  if (effects_.plan().effects.limits.empty() || !blows_.met(state)) return false;
  const int before = report.blows;
  account_.work.of<JointLimit>() += blows_.strike(state, arrived, report.blows);
  if (report.blows == before) return false;
  for (Index row = 0; row < before_.rows(); ++row) state.history(row, 0) = h * blows_.velocity()(row);
  state.last_step(0) = h;
  return true;
}

template <bool kEffects>
bool TreeStepper<kEffects>::halves(State<double>& state, int& history, double h, int depth, StepReport& report) {
  if (depth > options_.max_splits) return false;
  for (int half = 0; half < 2; ++half) {
    report.status = advance(state, history, h / 2, false, report);
    if (report.ok()) {
      report.substeps += 1;
    } else if (!halves(state, history, h / 2, depth + 1, report)) {
      return false;
    }
    history = 0;
  }
  return true;
}

template <bool kEffects>
bool TreeStepper<kEffects>::converged(const Evaluated& now, double norm, double h) const {
  if (options_.stop == StopTest::absolute) return std::sqrt(now.plain) <= options_.tolerance * std::abs(h);
  return 0.5 * norm <= options_.tolerance * options_.tolerance * now.scale || norm <= enough_;
}

/// h^2 x kinetic energy that gravity gives in a step to what is at rest.
template <bool kEffects>
double TreeStepper<kEffects>::fall(double h) const {
  const auto& g = options_.gravity;
  return 0.5 * sweeps_.constants().subtree_mass(0) * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * h * h * h * h;
}

template <bool kEffects>
void TreeStepper<kEffects>::begin_effects(const State<double>& state, double h)
  requires kEffects
{
  if (effects_.plan().joints) std::ranges::copy(work_.momentum_target.flat(), effects_.plain_target().flat().begin());
  if (state.last_step(0) != 0) {
    know_before(state, h);
  } else {
    sweeps_.velocity_of(state.p, before_);
    for (double& value : before_.flat()) value *= h;
  }
  effects_.begin({time_}, h, state.q, before_, state.last_step(0) != 0, passable_, work_.delta);
  sweeps_.begin(fall(h));
}

/// before_: displacement of the step before; of a step of its own length, had it been as long as this one.
template <bool kEffects>
void TreeStepper<kEffects>::know_before(const State<double>& state, double h) {
  if (has_stages_) return;  // it is there since that step ended
  const double longer = h / state.last_step(0);
  for (Index row = 0; row < before_.rows(); ++row) before_(row) = longer * state.history(row, 0);
}

template <bool kEffects>
std::span<double> TreeStepper<kEffects>::servo_targets() {
  if constexpr (kEffects) return effects_.servo_targets().flat();
  return {};
}

template <bool kEffects>
std::span<double> TreeStepper<kEffects>::friction_forces() {
  if constexpr (kEffects) return effects_.friction_forces().flat();
  return {};
}

template <bool kEffects>
void TreeStepper<kEffects>::set_gain([[maybe_unused]] Index k, [[maybe_unused]] double factor) {
  if constexpr (kEffects) effects_.set_gain(k, factor);
}

template <bool kEffects>
void TreeStepper<kEffects>::set_ground_friction([[maybe_unused]] double coefficient) {
  if constexpr (kEffects) effects_.ground_friction() = coefficient;
}

template <bool kEffects>
void TreeStepper<kEffects>::clear_account() {
  account_ = {};
  if constexpr (kEffects) {
    if (impulses_.kept()) impulses_.clear();
  }
}

template <bool kEffects>
void TreeStepper<kEffects>::keep_impulses() {
  if constexpr (kEffects) impulses_.allocate(effects_.plan(), model_.tree.shape);
}

template <bool kEffects>
const StepImpulses& TreeStepper<kEffects>::impulses() const {
  static const StepImpulses none;
  if constexpr (kEffects) return impulses_.sum();
  return none;
}

template <bool kEffects>
EffectMemory TreeStepper<kEffects>::effect_memory() {
  if constexpr (kEffects) return {effects_.excess_before().flat(), effects_.reading().flat(), effects_.bend().flat()};
  return {};
}

template <bool kEffects>
void TreeStepper<kEffects>::set_kept([[maybe_unused]] Index k, [[maybe_unused]] double number) {
  if constexpr (kEffects) effects_.set_kept(k, number);
}

template <bool kEffects>
double TreeStepper<kEffects>::kept([[maybe_unused]] Index k) const {
  if constexpr (kEffects) return effects_.kept(k);
  return 0;
}

template <bool kEffects>
std::vector<std::span<double>> TreeStepper<kEffects>::memory() {
  std::vector<std::span<double>> kept;
  if constexpr (kEffects) {
    const auto of_effects = effects_.memory();
    kept.assign(of_effects.begin(), of_effects.end());
  }
  if (has_stages_) kept.push_back(before_.flat());
  if (sweeps_.holds()) {
    const auto factor = sweeps_.factor_memory();
    kept.insert(kept.end(), {held_.numbers(), factor[0], factor[1], factor[2]});
  }
  return kept;
}

/// Whether the state of an effect changed; work_.delta then says what the motion is to be.
template <bool kEffects>
bool TreeStepper<kEffects>::revise_effects(const Revision<bool>& revision)
  requires kEffects
{
  if (!effects_.revise(sweeps_.left(), revision, work_.delta)) return false;
  spread_mimics<double>(sweeps_.mimics(), work_.delta);  // of a coordinate that comes to hold its leader's row was set
  displacement_map(model_.tree, work_.motion, work_.delta);
  return true;
}

template <bool kEffects>
StepStatus TreeStepper<kEffects>::solve(State<double>& state, int history, double h, StepReport& report) {
  const StepStatus status = find_root(state, history, h, report);
  if (status != StepStatus::converged) return status;
  displacement_map(model_.tree, work_.motion, work_.delta);
  if (gains_energy(state, history, h, report)) {
    sweeps_.complete();
    report.slot = fastest_body(model_, sweeps_.constants(), work_);
    return StepStatus::gains_energy;
  }
  return StepStatus::converged;
}

/// Whether the solution is another root than the motion's; see convergence.hpp. Nothing is known of the step before the first.
template <bool kEffects>
bool TreeStepper<kEffects>::gains_energy(const State<double>& state, int history, double h, StepReport& report) {
  if (least_w_ > kFreeCosine || state.last_step(0) == 0) return false;
  if (history > 0 && options_.guess == FirstGuess::extrapolation) {
    const Extrapolation guess = extrapolation(state.history, history);
    const double corrected = largest_turn(model_.tree, sweeps_.constants(), work_.delta,
                                          [&](Index row) { return extrapolated(guess, state.history, row); });
    if (corrected < kFreeCorrection) return false;
  }
  if (!kEffects) know_before(state, h);
  const EnergyStep energy = sweeps_.energy_step(before_, has_stages_ ? state.last_step(0) : h, h, report);
  return energy.now - energy.before - energy.work > kMostGain * std::max(energy.now, energy.before);
}

/// Leads to the states that sudden revisions went round in circles about, by friction that is smooth at first and then ever less so;
/// `whole`: until that has converged.
///
/// With smooth friction the solution of the step minimises a function, convex but for the coupling of friction to the load it goes with,
/// whose gradient is the residual; each correction is cut to where it falls no further. Its slope along a correction is r.(A^-1 r_before),
/// the sum of u (d^-1 u_before): known from the passes.
template <bool kEffects>
void TreeStepper<kEffects>::approach_softly(Evaluated& now, double& norm, double h, bool whole, StepReport& report)
  requires kEffects
{
  for (const double creep : kSoftCreeps) {
    const bool to_the_end = whole && creep == std::end(kSoftCreeps)[-1];
    displacement_map(model_.tree, work_.motion, work_.delta);
    effects_.soften(creep, work_.delta);
    spread_mimics<double>(sweeps_.mimics(), work_.delta);
    now = sweeps_.evaluate(true, report);
    norm = now.norm;
    for (int k = 0; k < kMostSoftCorrections; ++k) {
      if (!now.usable() || !std::isfinite(norm)) return;
      const bool settled = 0.5 * norm <= kSettled * kSettled * now.scale;
      if (revise_effects({.near = settled, .solved = false, .late = false, .last = false})) {
        now = sweeps_.evaluate(true, report);
        norm = now.norm;
        continue;
      }
      if (to_the_end ? converged(now, norm, h) || sweeps_.at_rounding_floor(now, norm, fall(h), kFloorEpsilons) : settled) break;
      std::ranges::copy(work_.innovation.flat(), before_innovation_.flat().begin());
      const double slope_before = sweeps_.slope_at_begin();
      now = sweeps_.solve_and_correct(report);
      double taken = 1;
      for (int cut = 0; cut < kMaxBacktracks; ++cut) {
        double share = 0.5;
        if (now.usable()) {
          norm = now.norm;
          const double slope = sweeps_.slope_at_end(before_innovation_);
          if (slope > -kSteepest * slope_before) break;
          share = std::clamp(slope_before / (slope_before - slope), 0.1, 0.9);
        }
        now = sweeps_.correct(taken * (share - 1), report);
        taken *= share;
      }
      if (now.usable()) {
        sweeps_.factor_again(now, report);
        norm = now.norm;
      }
    }
  }
}

template <bool kEffects>
Evaluated TreeStepper<kEffects>::first_evaluation(State<double>& state, int history, double h, bool& fresh, StepReport& report) {
  sweeps_.start(state.q);
  fresh = history == 0 || !sweeps_.holds() || !held_.serves(options_.tolerance);
  if (to_end_ != 0) {
    const Extrapolation guess = extrapolation_after(work_.delta, state.history, history);
    return sweeps_.arrive_and_evaluate(std::exchange(to_end_, 0.0), state, guess, h, fresh, report);
  }
  if (!kEffects && options_.guess == FirstGuess::extrapolation && history > 0 && sweeps_.mimics().empty()) {
    // of each part of the tree when its turn comes
    return sweeps_.evaluate_from(state, extrapolation(state.history, history), h, fresh, report);
  }
  momentum_target_map(model_.tree, h, state.p, work_.force, work_.momentum_target);
  first_guess(options_.guess, model_, state, history, h, sweeps_);
  if constexpr (kEffects) begin_effects(state, h);
  spread_mimics<double>(sweeps_.mimics(), work_.delta);  // corrections keep ties, so the guess must
  return sweeps_.evaluate(fresh, report);
}

template <bool kEffects>
StepStatus TreeStepper<kEffects>::find_root(State<double>& state, int history, double h, StepReport& report) {
  const int factors_before = report.factorisations;
  bool fresh;  // the factor belongs to the current displacement
  Evaluated now = first_evaluation(state, history, h, fresh, report);
  if (!now.usable()) {
    // no displacement at all is always within the range of log
    for (double& value : work_.delta.flat()) value = 0;
    if constexpr (kEffects) {
      if (effects_.plan().joints) effects_.put_motions(work_.delta);
      spread_mimics<double>(sweeps_.mimics(), work_.delta);
    }
    now = sweeps_.evaluate(true, report);
    fresh = true;
  }
  const bool held = !fresh;  // until the first correction has been made, at the least
  double norm = now.norm;
  held_.begin(std::sqrt(0.5 * norm / now.scale), fresh);
  enough_ = options_.reduction * options_.reduction * std::min(norm, 2 * kRoughGuess * kRoughGuess * now.scale);
  StepStatus trouble = StepStatus::not_converged;  // of the last correction that had to be cut short

  bool at_floor = false;
  const auto end = [&](StepStatus status) {
    const double relative = now.scale > 0 ? std::sqrt(0.5 * norm / now.scale) : std::sqrt(norm);
    if (status == StepStatus::converged) {
      held_.end(relative, at_floor, !held || report.factorisations > factors_before);
      least_w_ = now.least_w;
      mean_kinetic_ = now.energy / (h * h);
      report.residual = std::max(report.residual, relative);
    } else {
      held_.drop();
      failed_residual_ = relative;
    }
    if (status == StepStatus::not_converged) report.slot = largest_residual(model_, work_, sweeps_.yields());
    return status;
  };
  const auto try_out = [&](const Evaluated& tried) {
    now = tried;
    if (now.usable()) return now.norm;
    trouble = now.least_w > 0 ? StepStatus::not_finite : StepStatus::past_pi;
    sweeps_.complete();
    report.slot = worst_displacement(model_, work_);
    return kInfinity;
  };

  // the evaluation and factor for other states of effects, where they changed
  int revisions = 0;
  const auto revised = [&]([[maybe_unused]] bool near, [[maybe_unused]] bool solved) {
    if constexpr (kEffects) {
      const bool revises = effects_.plan().revises;
      if (revises && sweeps_.has_slopes() && (revisions == kBulkRevisions || revisions == kMostRevisions)) {
        // at first only to find the states; where they still do not settle the step stays with friction smooth below the least creep
        const bool whole = revisions == kMostRevisions;
        approach_softly(now, norm, h, whole, report);
        if (!whole) effects_.harden();
        displacement_map(model_.tree, work_.motion, work_.delta);
      } else {
        if (!revises || !now.usable() || !std::isfinite(norm) || revisions == kLastRevision) return false;
        const bool late = revisions >= kBulkRevisions, last = revisions >= 2 * kBulkRevisions;
        if (!revise_effects({.near = near, .solved = solved, .late = late, .last = last})) return false;
        report.iterations += 1;
      }
      revisions += 1;
      now = sweeps_.evaluate(true, report);
      norm = now.norm;
      return fresh = true;
    }
    return false;
  };

  for (int iteration = 0;; ++iteration) {
    if (!std::isfinite(norm) || !now.usable()) {
      sweeps_.complete();
      report.slot = worst_displacement(model_, work_);
      return end(StepStatus::not_finite);
    }
    const bool done = at_floor || converged(now, norm, h);
    if (revised(done || 0.5 * norm <= kSettled * kSettled * now.scale, done)) {
      at_floor = false;
      continue;
    }
    if (done && revisions < kLastRevision) {
      report.at_rounding_floor |= at_floor;
      return end(StepStatus::converged);
    }
    if (iteration >= max_iterations_ || done) return end(StepStatus::not_converged);

    const double before = norm;
    double taken = 1;
    norm = try_out(sweeps_.solve_and_correct(report));
    if (revised(false, false)) continue;
    const bool slow = norm > kSlowProgress * kSlowProgress * before;
    const bool close = norm <= kNearTolerance * kNearTolerance * options_.tolerance * options_.tolerance * now.scale;
    at_floor = (slow && sweeps_.at_rounding_floor(now, norm, fall(h), kFloorEpsilons)) ||
               (close && !converged(now, norm, h) && sweeps_.at_rounding_floor(now, norm, fall(h), kBareRounding));
    if (held && iteration == 0) held_.corrected(std::sqrt(norm / before), at_floor);
    if (at_floor) continue;
    for (int cut = 0; !(norm < before) && cut < kMaxBacktracks; ++cut) {
      taken /= 2;
      norm = try_out(sweeps_.correct(-taken, report));
      report.backtracks += 1;
    }
    if (!(norm < before)) {
      norm = try_out(sweeps_.correct(-taken, report));  // back to where this iteration began
      if (sweeps_.at_rounding_floor(now, norm, fall(h), kFloorEpsilons)) {
        at_floor = true;
        continue;
      }
      if (fresh || options_.solver == Solver::riqn) return end(trouble);
    }
    fresh = false;
    // a held factor that another correction like this would not be enough with has been held for too long
    const bool stale = held && iteration == 0 && 0.5 * norm * (norm / before) > options_.tolerance * options_.tolerance * now.scale;
    if ((slow || stale) && options_.solver == Solver::newton) {
      sweeps_.factor_again(now, report);
      norm = now.norm;
      fresh = true;
    }
  }
}

/// The new state, from a displacement that solves the step.
template <bool kEffects>
void TreeStepper<kEffects>::finish(State<double>& state, int& history, double h, bool another, [[maybe_unused]] StepReport& report) {
  EffectAccount part;
  if constexpr (kEffects) {
    part = effects_.account(sweeps_.left(), work_.delta, before_, state.last_step(0) == h);
    if (impulses_.kept()) {
      impulses_.add(effects_, model_, h, state.q, work_.placement, work_.motion, work_.delta, sweeps_.left());
    }
    if (effects_.plan().joints) effects_.end_joints(work_.delta, work_.motion, sweeps_.left(), work_.increment);
    if (effects_.plan().bodies) effects_.end_bodies(work_.placement, work_.displacement, work_.impulse);
  }
  history = std::min(history + 1, kHistory);
  const bool known = !has_stages_ && state.last_step(0) != 0;
  state.last_step(0) = h;
  if (!kEffects && another && sweeps_.can_go_on() && options_.guess == FirstGuess::extrapolation) {
    to_end_ = h;
    return;
  }
  sweeps_.arrive(h, state);
  if constexpr (kEffects) {
    part.work.of<Ground>() -= effects_.ground_stored();
    part.kinetic = mean_kinetic_;
    account_.add(part);
    time_ += h;
    for (Index row = 0; effects_.plan().joints && row < state.p.rows(); ++row) state.p(row) += work_.increment(row);
  }
  fold_mimics(sweeps_.mimics(), state.p);
  if (has_stages_) std::ranges::copy(work_.delta.flat(), before_.flat().begin());
  if constexpr (kEffects) {
    sweeps_.end_reading(before_, known);
    if (strike(state, h, true, report)) history = 1;
  }
}

template <bool kEffects>
void TreeStepper<kEffects>::forget() {
  held_ = {};
  if constexpr (kEffects) effects_.forget();
}

template <bool kEffects>
void TreeStepper<kEffects>::read_velocity(const State<double>& state, Field<double>& v) {
  sweeps_.read_velocity(state.p, v);
  within_bend(state, v);
}

template <bool kEffects>
void TreeStepper<kEffects>::within_bend(const State<double>& state, Field<double>& v) const {
  if constexpr (kEffects) {
    if (state.last_step(0) == 0) return;
    for (Index row = 0; row < v.rows(); ++row) v(row) = effects_.within_bend(row, v(row), state.history(row, 0) / state.last_step(0));
  }
}

template <bool kEffects>
Energy TreeStepper<kEffects>::energy_of(const State<double>& state, Field<double>& rate) {
  const Field<double>& read = sweeps_.read_velocity(state.p, rate);
  double kinetic = 0;
  for (Index row = 0; row < rate.rows(); ++row) kinetic += 0.5 * read(row) * rate(row);
  within_bend(state, rate);
  if constexpr (kEffects) {
    const double ground = effects_.ground_potential();
    return {kinetic, sweeps_.potential(), sweeps_.effect_potential() - ground, ground};
  }
  return {kinetic, sweeps_.potential()};
}

template <bool kEffects>
Wrench<double> TreeStepper<kEffects>::total_momentum(const State<double>& state, Field<double>& rate) {
  sweeps_.read_velocity(state.p, rate);
  sweeps_.momentum_of(rate, work_.increment);
  return load<Wrench, double>(work_.impulse, 0);
}

template <>
std::unique_ptr<Stepper> make_tree_stepper<LINDEN_ACTING>(const Model& model, const Options& options, const EffectPlan& plan) {
  return std::make_unique<TreeStepper<LINDEN_ACTING>>(model, options, plan);
}

}  // namespace linden
