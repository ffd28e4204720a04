// Compiled with effects and without; CMakeLists.txt says which: LINDEN_ACTING is true or false.
#include "engine/solve/tree_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/guess/first_guess.hpp"
#include "engine/solve/diagnosis.hpp"
#include "engine/sweeps/tree_kernels.hpp"

namespace linden {

template <bool kEffects>
TreeStepper<kEffects>::TreeStepper(const Model& model, const Options& options, const EffectPlan& plan)
    : model_(model),
      options_(options),
      has_stages_(options.order != 2),
      sweeps_(model, options, plan),
      work_(sweeps_.work()),
      effects_(sweeps_.effects()),
      solve_(model, options_, sweeps_),
      blows_(sweeps_, model.tree.shape.velocities) {
  check(options);
  last_good_.allocate(model.tree.shape);
  before_.allocate(model.tree.shape.velocities);
  if constexpr (kEffects) {
    keep(last_good_);  // no step allocates
  }
}

template <bool kEffects>
StepReport TreeStepper<kEffects>::step(State<double>& state, int& history, double time, double h, Then then) {
  const StepReport report = whole_step(state, history, time, h, then);
#ifdef LINDEN_POISON
  if (!unfinished_) sweeps_.poison_scratch();
#endif
  return report;
}

template <bool kEffects>
StepReport TreeStepper<kEffects>::whole_step(State<double>& state, int& history, double time, double h, Then then) {
  StepReport report;
  time_ = time;
  if (history > 0 && !has_stages_ && state.last_step(0) != h) change_length(state, h);
  clear_account();
  bool changes = false;  // before a solve fails: parts of the step are taken, or a start is struck at its limits
  if constexpr (kEffects) {
    changes = effects_.plan().bounces || (state.last_step(0) == 0 && !effects_.plan().effects.limits.empty());
  }
  if (changes) keep(state);
  const int history_before = history;
  report.status = advance(state, history, h, then, report);
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
  report.residual = solve_.failed_residual();
  if (cannot_follow(state)) {
    report.status = StepStatus::opens;
    report.residual = sweeps_.widest_gap();
  }
  if (!model_.couplings.empty()) report.coupling = sweeps_.widest_coupling();
  restore(state);
  history = history_before;
  return report;
}

/// What is known of steps before, brought to the length of this one. What effects keep of their own is of the one before as it was.
template <bool kEffects>
void TreeStepper<kEffects>::change_length(State<double>& state, double h) {
  const double times = h / state.last_step(0);
  for (double& displacement : state.history.flat()) displacement *= times;
  sweeps_.change_length(times);
  state.last_step(0) = h;
  is_new_length_ = true;
}

template <bool kEffects>
void TreeStepper<kEffects>::mean_twists(const State<double>& state, Field<double, 6>& twist) {
  sweeps_.mean_twists(state.history, state.last_step(0), twist);
}

template <bool kEffects>
void TreeStepper<kEffects>::twists_of(const Field<double>& v, Field<double, 6>& twist) {
  sweeps_.twists_of(v, twist);
}

/// Whether nothing closes the couplings where the part of the step that was tried last, from this state, leads joints whose motion is given.
template <bool kEffects>
bool TreeStepper<kEffects>::cannot_follow(const State<double>& state) {
  if constexpr (kEffects) {
    if (model_.couplings.empty() || effects_.plan().effects.motions.empty()) return false;
    std::ranges::fill(work_.delta.flat(), 0.0);
    effects_.put_motions(work_.delta);
    Field<double> led = state.q;
    sweeps_.displace(led);
    return !sweeps_.assemble(led).closed;
  }
  return false;
}

/// The state at the beginning of the step, and what effects keep beside it.
template <bool kEffects>
void TreeStepper<kEffects>::keep(const State<double>& state) {
  last_good_ = state;
  if constexpr (kEffects) {
    last_memory_.clear();
    for (const std::span<double> numbers : effect_memory()) last_memory_.insert(last_memory_.end(), numbers.begin(), numbers.end());
  }
}

template <bool kEffects>
void TreeStepper<kEffects>::restore(State<double>& state) {
  state = last_good_;
  clear_account();
  if constexpr (kEffects) {
    auto next = last_memory_.begin();
    for (const std::span<double> numbers : effect_memory()) {
      std::copy_n(next, numbers.size(), numbers.begin());
      next += static_cast<std::ptrdiff_t>(numbers.size());
    }
  }
  sweeps_.refresh(state.q);
}

template <bool kEffects>
StepStatus TreeStepper<kEffects>::advance(State<double>& state, int& history, double h, Then then, StepReport& report) {
  if constexpr (kEffects) {
    if (state.last_step(0) == 0) strike(state, h, false, report);
    if (effects_.plan().bounces) return advance_with_blows(state, history, h, report);
  }
  const StepStatus status = solve(state, history, h, report);
  if (status == StepStatus::converged) finish(state, history, h, then, report);
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
    finish(state, history, part, Then::stop, report);
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
    report.status = advance(state, history, h / 2, Then::stop, report);
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
  sweeps_.begin_contacts(h, before_);
  effects_.begin({time_}, h, state.q, before_, state.last_step(0) != 0, passable_, work_.delta);
  sweeps_.begin(solve_.fall(h));
}

/// before_: displacement of the step before; of a step of its own length, had it been as long as this one.
template <bool kEffects>
void TreeStepper<kEffects>::know_before(const State<double>& state, double h) {
  if (has_stages_) return;  // it is there since that step ended
  const double longer = h / state.last_step(0);
  for (Index row = 0; row < before_.rows(); ++row) before_(row) = longer * state.history(row, 0);
}

template <bool kEffects>
EffectControls TreeStepper<kEffects>::controls() {
  if constexpr (kEffects) return EffectControls(effects_);
  return {};
}

/// What effects keep from step to step, on joints, on bodies and between bodies.
template <bool kEffects>
std::vector<std::span<double>> TreeStepper<kEffects>::effect_memory() {
  std::vector<std::span<double>> kept = controls().memory();
  if (sweeps_.has_contacts()) kept.push_back(sweeps_.contact_memory());
  return kept;
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
std::vector<std::span<double>> TreeStepper<kEffects>::memory() {
  std::vector<std::span<double>> kept = effect_memory();
  if (has_stages_) kept.push_back(before_.flat());
  if (sweeps_.reuses_factor()) {
    kept.push_back(solve_.held().numbers());
    const std::vector<std::span<double>> factor = sweeps_.factor_memory();
    kept.insert(kept.end(), factor.begin(), factor.end());
  }
  return kept;
}

template <bool kEffects>
StepStatus TreeStepper<kEffects>::solve(State<double>& state, int history, double h, StepReport& report) {
  Factor factor = solve_.factor_for(history);
  Evaluated<double> first = first_evaluation(state, history, h, factor, report);
  if (!usable(first)) {
    first = evaluation_at_rest(report);
    factor = Factor::fresh;
  }
  const StepStatus status = solve_.run(first, factor, h, report);
  if (status != StepStatus::converged) return status;
  displacement_map(model_.tree, work_.motion, work_.delta);
  if (gains_energy(state, history, h, report)) {
    sweeps_.complete();
    report.slot = fastest_body(model_, sweeps_.constants(), work_);
    return StepStatus::gains_energy;
  }
  return StepStatus::converged;
}

/// Whether the solution is another root than the motion's; see judge.hpp. Nothing is known of the step before the first.
template <bool kEffects>
bool TreeStepper<kEffects>::gains_energy(const State<double>& state, int history, double h, StepReport& report) {
  const NoOtherRoot& bounds = no_other_root(model_);
  if (solve_.least_w() > bounds.cosine || state.last_step(0) == 0) return false;
  if (history > 0 && options_.guess == FirstGuess::extrapolation) {
    const Extrapolation guess = extrapolation(state.history, history);
    const auto guessed = [&](Index row) { return extrapolated(guess, state.history, row); };
    if (may_be_another_root(bounds, model_.tree, sweeps_.constants(), 1, solve_.least_w(), work_.delta, guessed) == 0) return false;
  }
  if (!kEffects) know_before(state, h);
  const EnergyStep energy = sweeps_.energy_step(before_, has_stages_ ? state.last_step(0) : h, h, report);
  const double most = std::max(energy.now, energy.before);
  return energy.now - energy.before - energy.work > kMostGain * most || std::abs(energy.rigid_work) > kMostStray * most;
}

template <bool kEffects>
Evaluated<double> TreeStepper<kEffects>::first_evaluation(State<double>& state, int history, double h, Factor factor, StepReport& report) {
  sweeps_.start(state.q, h);
  if (history > 0 && sweeps_.guesses_multipliers()) sweeps_.guess_multipliers(extrapolation(state.history, history));
  if (unfinished_) {
    const double h_before = *unfinished_;
    unfinished_.reset();
    const Extrapolation guess = extrapolation_after(work_.delta, state.history, history);
    return sweeps_.arrive_and_evaluate(h_before, state, guess, h, factor, report);
  }
  if (!kEffects && options_.guess == FirstGuess::extrapolation && history > 0 && sweeps_.mimics().empty()) {
    // of each part of the tree when its turn comes
    return sweeps_.evaluate_from(state, extrapolation(state.history, history), h, factor, report);
  }
  momentum_target_map(model_.tree, h, state.p, work_.force, work_.momentum_target);
  sweeps_.change_step(h, work_.momentum_target);
  first_guess(options_.guess, model_, state, history, h, sweeps_);
  if constexpr (kEffects) begin_effects(state, h);
  spread_mimics<double>(sweeps_.mimics(), work_.delta);  // corrections keep ties, so the guess must
  return sweeps_.evaluate(factor, report);
}

/// No displacement at all is always within the range of log; what is given moves all the same.
template <bool kEffects>
Evaluated<double> TreeStepper<kEffects>::evaluation_at_rest(StepReport& report) {
  std::ranges::fill(work_.delta.flat(), 0.0);
  if constexpr (kEffects) {
    if (effects_.plan().joints) effects_.put_motions(work_.delta);
    spread_mimics<double>(sweeps_.mimics(), work_.delta);
  }
  return sweeps_.evaluate(Factor::fresh, report);
}

/// The new state, from a displacement that solves the step.
template <bool kEffects>
void TreeStepper<kEffects>::finish(State<double>& state, int& history, double h, Then then, [[maybe_unused]] StepReport& report) {
  EffectAccount part;
  if constexpr (kEffects) {
    part = effects_.account(sweeps_.joint_residual(), work_.delta, before_, state.last_step(0) == h && !is_new_length_);
    is_new_length_ = false;
    if (impulses_.kept()) {
      impulses_.add(effects_, model_, h, state.q, work_.placement, work_.motion, work_.delta, sweeps_.joint_residual());
    }
    if (effects_.plan().joints) {
      effects_.end_joints(work_.delta, work_.motion, Stopped::struck, sweeps_.joint_residual(), work_.end_impulse);
    }
    if (effects_.plan().bodies) effects_.end_bodies(work_.placement, work_.displacement, work_.impulse);
    sweeps_.end_contacts(h, before_, [&](Index slot, double taken, double freed) {
      part.work.of<PairContact>() += taken;
      part.freed += freed;
      part.least[kListOf<PairContact>].see(slot, taken);
    });
    if (impulses_.kept()) sweeps_.account_for_contacts(h, impulses_);
  }
  if (sweeps_.gives_way()) account_.work.couplings += sweeps_.end_couplings(h);
  history = std::min(history + 1, kHistory);
  const bool known = !has_stages_ && state.last_step(0) != 0;
  state.last_step(0) = h;
  if (!kEffects && then == Then::step && sweeps_.can_go_on() && options_.guess == FirstGuess::extrapolation) {
    unfinished_ = h;
    return;
  }
  sweeps_.remember_multipliers();
  sweeps_.arrive(h, state);
  if constexpr (kEffects) {
    part.work.of<Ground>() -= effects_.ground_stored();
    part.kinetic = solve_.mean_kinetic();
    account_.add(part);
    time_ += h;
    for (Index row = 0; effects_.plan().joints && row < state.p.rows(); ++row) state.p(row) += work_.end_impulse(row);
  }
  if (sweeps_.gives_way()) sweeps_.add_coupling_ends(h, state.p);
  fold_mimics(sweeps_.mimics(), state.p);
  if (has_stages_) std::ranges::copy(work_.delta.flat(), before_.flat().begin());
  if constexpr (kEffects) {
    sweeps_.end_reading(h, before_, known);
    if (strike(state, h, true, report)) history = 1;
  }
}

template <bool kEffects>
void TreeStepper<kEffects>::forget() {
  solve_.held() = {};
  is_new_length_ = false;
  sweeps_.forget_contacts();
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
  if constexpr (kEffects) {
    const double late = sweeps_.late_in_reading(rate), ground = effects_.ground_potential(), contact = sweeps_.contact_potential();
    within_bend(state, rate);
    return {kinetic, sweeps_.potential() + late, sweeps_.effect_potential() - ground - contact, ground, contact + late};
  }
  within_bend(state, rate);
  return {kinetic, sweeps_.potential(), sweeps_.effect_potential()};
}

template <bool kEffects>
Wrench<double> TreeStepper<kEffects>::total_momentum(const State<double>& state, Field<double>& rate) {
  sweeps_.read_velocity(state.p, rate);
  sweeps_.momentum_of(rate, work_.momentum);
  return load<Wrench, double>(work_.impulse, 0);
}

template <>
std::unique_ptr<Stepper> make_tree_stepper<LINDEN_ACTING>(const Model& model, const Options& options, const EffectPlan& plan) {
  return std::make_unique<TreeStepper<LINDEN_ACTING>>(model, options, plan);
}

}  // namespace linden
