// Compiled with effects and without; CMakeLists.txt says which: LINDEN_ACTING is true or false.
#include "engine/solve/tree_solve.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/solve/diagnosis.hpp"
#include "engine/sweeps/tree_kernels.hpp"

namespace linden {
namespace {

/// Updates of states in one solve: a pile of joints that stick and slide at once takes some ten before they are led by smooth friction.
constexpr int kFirstContinuation = 5, kLastContinuation = 20, kMostUpdates = 60;

constexpr int kMostCuts = 10;

/// Speeds up to which friction is made smooth, one after the other [m/s, rad/s].
constexpr double kSmoothSpeeds[] = {1e-2, 1e-3, 1e-4, 1e-5};
constexpr int kMostSmoothCorrections = 40;

/// A correction is cut where the slope at its end is steeper than this share of that at its beginning, the other way.
constexpr double kSteepest = 0.5;

Policy policy_for(const Options& options, bool has_slopes) {
  const bool newton = options.solver == Solver::newton;
  Policy policy{.most_corrections = options.max_iterations > 0 ? options.max_iterations : newton ? 50 : 1000};
  policy.most_cuts = kMostCuts;
  policy.refactors = newton;
  policy.one_state_at_a_time = kFirstContinuation;
  policy.one_limit_at_a_time = 2 * kFirstContinuation;
  policy.most_updates = kMostUpdates;
  if (has_slopes) {
    policy.first_continuation = kFirstContinuation;
    policy.last_continuation = kLastContinuation;
  }
  return policy;
}

}  // namespace

template <bool kEffects>
TreeSolve<kEffects>::TreeSolve(const Model& model, const Options& options, TreeSweeps<kEffects>& sweeps)
    : model_(model), options_(options), policy_(policy_for(options, sweeps.has_slopes())), sweeps_(sweeps), work_(sweeps.work()) {
  if constexpr (kEffects) innovation_before_.allocate(model.tree.shape.velocities);
}

template <bool kEffects>
StepStatus TreeSolve<kEffects>::run(Evaluated<double> now, Factor factor, double h, StepReport& report) {
  const bool fresh = factor == Factor::fresh;
  const int factors_before = report.factorisations;
  report_ = &report;
  h_ = h;
  holds_ = !fresh;
  trouble_ = StepStatus::not_converged;
  held_.begin(std::sqrt(0.5 * now.norm / now.scale), fresh);
  enough_ = options_.reduction * options_.reduction * std::min(now.norm, 2 * kRoughGuess * kRoughGuess * now.scale);
  Solve solve(*this, policy_);
  const Solved<double> solved = solve.run(1, now, fresh ? 1 : 0);
  now = solve.now();
  const double relative = now.scale > 0 ? std::sqrt(0.5 * now.norm / now.scale) : std::sqrt(now.norm);
  if (solved.done == 0) {
    held_.drop();
    failed_residual_ = status_ == StepStatus::opens ? sweeps_.widest_gap() : relative;
    return status_;
  }
  const bool at_floor = solve.seen().at_floor;
  report.at_rounding_floor |= at_floor;
  report.residual = std::max(report.residual, relative);
  held_.end(relative, at_floor, fresh || report.factorisations > factors_before);
  least_w_ = now.least_w;
  mean_kinetic_ = now.energy / (h * h);
  return StepStatus::converged;
}

/// A displacement that would open a coupling is none, nor one in which rows that give way work as they cannot.
template <bool kEffects>
Lanes TreeSolve<kEffects>::refused(Lanes solved, const Evaluated<double>& now) {
  if (solved == 0) return 0;
  if (sweeps_.widest_gap() > kMostOpen) {
    status_ = StepStatus::opens;
  } else if (sweeps_.strays(kMostStray, h_, now)) {
    status_ = StepStatus::gains_energy;
    report_->slot = fastest_body(model_, sweeps_.constants(), work_);
  } else {
    return 0;
  }
  return 1;
}

template <bool kEffects>
void TreeSolve<kEffects>::give_up(const Seen& seen) {
  status_ = !seen.usable ? StepStatus::not_finite : seen.taken_back ? trouble_ : StepStatus::not_converged;
  if (!seen.usable) {
    sweeps_.complete();
    report_->slot = worst_displacement(model_, work_);
  }
  if (status_ == StepStatus::not_converged) report_->slot = largest_residual(model_, work_, sweeps_.yields());
}

template <bool kEffects>
Evaluated<double> TreeSolve<kEffects>::evaluate(Lanes, Lanes corrected, int) {
  return corrected != 0 ? tried(sweeps_.solve_and_correct(*report_)) : sweeps_.evaluate(Factor::fresh, *report_);
}

/// Why a correction cannot stand, where it cannot.
template <bool kEffects>
Evaluated<double> TreeSolve<kEffects>::tried(const Evaluated<double>& now) {
  if (!usable(now)) {
    trouble_ = now.least_w > 0 ? StepStatus::not_finite : StepStatus::past_pi;
    sweeps_.complete();
    report_->slot = worst_displacement(model_, work_);
  }
  return now;
}

template <bool kEffects>
Evaluated<double> TreeSolve<kEffects>::cut(double share) {
  report_->backtracks += 1;
  return tried(sweeps_.correct(-share, *report_));
}

template <bool kEffects>
Lanes TreeSolve<kEffects>::converged(const Evaluated<double>& now) const {
  if (options_.stop == StopTest::absolute) return std::sqrt(now.plain) <= options_.tolerance * std::abs(h_) ? 1 : 0;
  // a light link moves far by what is little beside the energy of the whole
  const bool solved = within(now.norm, options_.tolerance * options_.tolerance, now.scale) && sweeps_.is_closed(options_.tolerance);
  return solved || now.norm <= enough_ ? 1 : 0;
}

template <bool kEffects>
Lanes TreeSolve<kEffects>::close(const Evaluated<double>& now) const {
  return now.norm <= kNearTolerance * kNearTolerance * options_.tolerance * options_.tolerance * now.scale ? 1 : 0;
}

template <bool kEffects>
void TreeSolve<kEffects>::first_correction(double norm, double before, bool at_floor) {
  if (holds_) held_.corrected(std::sqrt(norm / before), at_floor);
}

template <bool kEffects>
bool TreeSolve<kEffects>::stale(const Evaluated<double>& now, double before) const {
  // another correction like this would not be enough
  return holds_ && 0.5 * now.norm * (now.norm / before) > options_.tolerance * options_.tolerance * now.scale;
}

template <bool kEffects>
bool TreeSolve<kEffects>::has_states() const {
  if constexpr (kEffects) return sweeps_.effects().plan().settles();
  return false;
}

/// Whether a state changed; work_.delta then says what the motion is to be.
template <bool kEffects>
bool TreeSolve<kEffects>::changes_states([[maybe_unused]] const StateUpdate<bool>& update) {
  if constexpr (kEffects) {
    if (!sweeps_.effects().update_states(sweeps_.joint_residual(), update, work_.delta)) return false;
    spread_mimics<double>(sweeps_.mimics(), work_.delta);  // where a coordinate comes to hold, its leader's row was set
    displacement_map(model_.tree, work_.motion, work_.delta);
    return true;
  }
  return false;
}

template <bool kEffects>
Lanes TreeSolve<kEffects>::update_states(const StateUpdate<bool>& update) {
  if (!changes_states(update)) return 0;
  report_->iterations += 1;
  return 1;
}

/// Leads to the states that sudden updates went round in circles about, by friction that is smooth at first and then ever less so. The first
/// time only to find the states; `whole`: until the step with friction smooth below the least speed has converged, which then stands.
///
/// With smooth friction the solution of the step minimises a function, convex but for the coupling of friction to the load it goes with,
/// whose gradient is the residual; each correction is cut to where it falls no further. Its slope along a correction is r.(A^-1 r_before),
/// the sum of u (d^-1 u_before): known from the passes.
template <bool kEffects>
void TreeSolve<kEffects>::continuation([[maybe_unused]] Evaluated<double>& now, [[maybe_unused]] bool whole) {
  if constexpr (kEffects) {
    auto& effects = sweeps_.effects();
    const auto follow = [&](double speed) {
      const bool to_the_end = whole && speed == std::end(kSmoothSpeeds)[-1];
      displacement_map(model_.tree, work_.motion, work_.delta);
      effects.regularize(speed, work_.delta);
      spread_mimics<double>(sweeps_.mimics(), work_.delta);
      now = sweeps_.evaluate(Factor::fresh, *report_);
      for (int k = 0; k < kMostSmoothCorrections; ++k) {
        if (!usable(now)) return false;
        const bool near = within(now.norm, kSettled * kSettled, now.scale);
        if (changes_states({.near = near, .solved = false, .late = false, .last = false})) {
          now = sweeps_.evaluate(Factor::fresh, *report_);
          continue;
        }
        if (to_the_end ? converged(now) != 0 || at_floor(now, kFloorEpsilons) != 0 : near) break;
        std::ranges::copy(work_.innovation.flat(), innovation_before_.flat().begin());
        line_search(now, sweeps_.slope_at_begin());
        if (usable(now)) sweeps_.factor_again(now, *report_);
      }
      return true;
    };
    for (const double speed : kSmoothSpeeds) {
      if (!follow(speed)) break;
    }
    if (!whole) effects.end_regularization();
    displacement_map(model_.tree, work_.motion, work_.delta);
  }
}

/// A correction, cut to where the residual along it is no longer steep the other way.
template <bool kEffects>
void TreeSolve<kEffects>::line_search(Evaluated<double>& now, double slope_before) {
  now = sweeps_.solve_and_correct(*report_);
  double taken = 1;
  for (int cut = 0; cut < kMostCuts; ++cut) {
    double share = 0.5;
    if (usable(now)) {
      const double slope = sweeps_.slope_at_end(innovation_before_);
      if (slope > -kSteepest * slope_before) return;
      share = std::clamp(slope_before / (slope_before - slope), 0.1, 0.9);
    }
    now = sweeps_.correct(taken * (share - 1), *report_);
    taken *= share;
  }
}

template class TreeSolve<LINDEN_ACTING>;

}  // namespace linden
