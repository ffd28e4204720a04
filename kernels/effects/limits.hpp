// kernels/effects/limits.hpp
// Limits of joints: unilateral constraints on the displacement of the step.
//
//   open    (mode = 0)      lowest <= delta <= highest
//   closed  (mode = 1, -1)  delta = highest or lowest exactly, as long as the limit has to push
//
//   highest = max(upper - q^k, 0),  lowest = min(lower - q^k, 0)
//   -h v <= lowest, highest <= h v    with a limit v of velocity
//
// No penalty: a closed joint is taken out of the solve, as one that friction holds. A joint never passes its limit by more than the
// solver's rounding; one that starts beyond it may come back but go no further. Without restitution the step that meets the limit ends
// on it, and the joint rests there.
//
// With restitution e > 0 a step may be `passable`: joints that bounce and are not at their limit yet go through it, so that the solver
// can find when the first of them meets it and strike there (engine/effects/blows.hpp):
//
//   v_n <- -e v_n,   p <- p - (1 + e) v_n / (M^-1)_nn  in the joint's row          Newton's law of impact
//
// units   [rad, m]; e without
// energy  takes -impulse x work_displacement / h; a blow 1/2 (1 - e^2) v_n^2 / (M^-1)_nn
// cost    some 8 operations an entry and evaluation
// source  Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988)
#pragma once

#include <limits>
#include <span>

#include "kernels/effects/friction.hpp"

namespace linden {

template <class S>
struct Limits {
  std::span<const JointLimit> entries;
  Field<S> lowest, highest;  // displacements of each that its limits leave [rad, m]
  Field<S> mode;             // of each
};

/// A joint this near to its limit is at it [rad, m].
inline constexpr double kAtLimit = 1e-9;

/// What bounces does so from this approach speed on; slower it comes to rest [rad/s, m/s].
inline constexpr double kLeastBounce = 1e-4;

/// What is left of that room at no more than the limit of velocity, either way.
template <class S>
LINDEN_INLINE void narrow_by_velocity(const JointLimit& limit, const S& h, S& lowest, S& highest) {
  using std::max;
  using std::min;
  const S reach = h * as<S>(limit.velocity);
  highest = max(min(highest, reach), -reach);
  lowest = min(max(lowest, -reach), reach);
}

/// Room for the displacement, and the modes that its first guess suggests, moved into the limits. before: displacement of the last step,
/// where that is `known`. passable: see above.
template <class S, class Mask>
void begin_limits(Limits<S>& limits, const Field<Index>& q_row, const S& h, const Field<S>& q, const Field<S>& before, const Mask& known,
                  bool passable, Field<S>& delta) {
  using std::max;
  using std::min;
  const S zero(0.0), one(1.0), slack = as<S>(kAtLimit);
  const S anywhere = as<S>(std::numeric_limits<double>::infinity());
  for (Index k = 0; k < limits.mode.rows(); ++k) {
    const JointLimit& limit = limits.entries[static_cast<std::size_t>(k)];
    const S up = as<S>(limit.upper) - q(q_row(limit.row)), down = as<S>(limit.lower) - q(q_row(limit.row));
    const bool through = passable && limit.restitution > 0;
    S highest = through ? select(up > slack, anywhere, max(up, zero)) : max(up, zero);
    S lowest = through ? select(down < -slack, -anywhere, min(down, zero)) : min(down, zero);
    narrow_by_velocity(limit, h, lowest, highest);
    limits.highest(k) = highest;
    limits.lowest(k) = lowest;
    S& d = delta(limit.row);
    // a joint that rested on its limit rests on
    const auto rests = known && before(limit.row) == zero;
    limits.mode(k) = select(d >= highest || (rests && up < slack), one, select(d <= lowest || (rests && down > -slack), -one, zero));
    d = select(limits.mode(k) == one, highest, select(limits.mode(k) == -one, lowest, d));
    d = min(max(d, lowest), highest);
  }
}

template <class S>
void hold_limits(const Limits<S>& limits, JointImpulses<S>& sum) {
  for (Index k = 0; k < limits.mode.rows(); ++k) {
    hold(sum, limits.entries[static_cast<std::size_t>(k)].row, limits.mode(k) != S(0.0));
  }
}

/// As update_friction: joints that pass a limit are put on it; where `settled`, those that it would have to pull are let go. All at once
/// is quick but may go round in circles; `one_switch_at_a_time` the last of the settled alone changes, which never does (Murty's rule: Note
/// on a Bard-type scheme for solving the complementarity problem (1974)).
template <class S, class Mask>
auto update_limits(Limits<S>& limits, const Field<S>& residual, const Mask& settled, const Mask& one_switch_at_a_time, Field<S>& delta) {
  const S zero(0.0), one(1.0);
  auto changed = zero > one;
  for (Index k = limits.mode.rows() - 1; k >= 0; --k) {
    const Index row = limits.entries[static_cast<std::size_t>(k)].row;
    S& d = delta(row);
    const S& mode = limits.mode(k);
    const auto open = mode == zero;
    // a residual above zero is taken away by a smaller delta: the joint leaves an upper limit by itself
    const auto may = !(one_switch_at_a_time && (changed || !settled));
    const auto leaves = may && !open && settled && mode * residual(row) > zero;
    const auto above = may && open && d > limits.highest(k), below = may && open && d < limits.lowest(k);
    d = select(above, limits.highest(k), select(below, limits.lowest(k), d));
    changed = changed || leaves || above || below;
    limits.mode(k) = select(leaves, zero, select(above, one, select(below, -one, mode)));
  }
  return changed;
}

/// In which instances a joint that bounces ends a step on its limit where it did not rest before: stopped by it, or come there by itself.
template <class S, class Mask>
auto stopped_bounces(const Limits<S>& limits, const Field<Index>& q_row, const Field<S>& q, const Field<S>& delta, const Field<S>& before,
                     const Mask& known) {
  using std::abs;
  const S zero(0.0), slack = as<S>(kAtLimit);
  auto stopped = zero > S(1.0);
  for (Index k = 0; k < limits.mode.rows(); ++k) {
    const JointLimit& limit = limits.entries[static_cast<std::size_t>(k)];
    if (limit.restitution == 0) continue;
    const S& d = delta(limit.row);
    const S to = q(q_row(limit.row)) + d;
    const auto at_limit = as<S>(limit.upper) - to <= slack || to - as<S>(limit.lower) <= slack;  // not only at its limit of velocity
    const auto rests = known && abs(before(limit.row)) <= slack && abs(d) <= slack;
    stopped = stopped || (at_limit && !rests);
  }
  return stopped;
}

/// What the limits took in a step, but for blows: each(row, loss [J]).
template <class S, class Each>
void limit_loss(const Limits<S>& limits, const S& h, const Field<S>& residual, const Field<S>& delta, const Field<S>& before, const Each& each) {
  for (Index k = 0; k < limits.mode.rows(); ++k) {
    const Index row = limits.entries[static_cast<std::size_t>(k)].row;
    each(row, select(limits.mode(k) != S(0.0), -residual(row) * work_displacement(1.0, delta(row), before(row)) / (h * h), S(0.0)));
  }
}

template <class S>
class LimitsLaw : public JointLaw<S, JointLimit> {
 public:
  static constexpr std::array sweeps{PartSweep{Part::begin, "begin_limits", "q, before, delta", "limits, delta"},
                                     PartSweep{Part::add, "hold_limits", "limits, joint impulses", "joint impulses"},
                                     PartSweep{Part::update_states, "update_limits", "residual, delta", "limits, delta"}};
  explicit LimitsLaw(const LawSetup& setup) : JointLaw<S, JointLimit>(setup) {
    limits_.entries = this->entries();
    for (Field<S>* field : {&limits_.lowest, &limits_.highest, &limits_.mode}) field->allocate(static_cast<Index>(this->entries().size()));
  }

  void begin(const StepView<S>& step, const StepStart<S>& start, Field<S>& delta) {
    begin_limits(limits_, step.q_row, step.h, step.q, start.before, start.known, start.passable, delta);
  }
  void add(const StepView<S>&, JointImpulses<S>& sum) const { hold_limits(limits_, sum); }
  /// Limits that do not settle soon are judged at the solution: nearby, what holds a light joint is lost in what the others still lack.
  MaskOf<S> update_states(const StepView<S>&, const StateUpdate<MaskOf<S>>& now, const S&, const Field<S>& residual, Field<S>& delta) {
    return update_limits(limits_, residual, now.solved || (now.near && !now.late), now.last, delta);
  }
  void account(const StepView<S>& step, const SolvedStep<S>& solved, const auto& book) const {
    limit_loss(limits_, step.h, solved.residual, solved.delta, solved.before, book);
  }

  const Limits<S>& limits() const { return limits_; }

 private:
  Limits<S> limits_;
};

}  // namespace linden
