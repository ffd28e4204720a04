// kernels/effects/limits.hpp
// Limits of joints: unilateral constraints on the displacement of the step.
//
//   open    (mode = 0)      lowest <= delta <= highest
//   closed  (mode = 1, -1)  delta = highest or lowest exactly, as long as the limit has to push
//
//   highest = max(upper - q^k, 0)     or, after an impact with restitution e:  -e delta_in, delta_in the step before it
//   -h v <= lowest, highest <= h v    with a limit v of velocity
//
// No penalty: a closed joint is taken out of the solve, as one that friction holds. A joint never passes its limit by more than the
// solver's rounding; one that starts beyond it may come back but go no further. The step that meets the limit ends on it; the one
// after gives back e times the displacement of the step before (Newton's law of impact), which a batch remembers in single precision.
//
// units   [rad, m]; e without
// energy  takes -impulse x worked / h
// cost    some 8 operations an entry and evaluation
// source  Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988)
#pragma once

#include <span>

#include "kernels/effects/friction.hpp"

namespace linden {

template <class S>
struct Limits {
  std::span<const JointLimit> entries;
  Field<S> lowest, highest;  // displacements of each that its limits leave [rad, m]
  Field<S> mode;             // of each
};

/// Impacts slower than this many times h^2 do not bounce, or a joint at rest on its limit would hum [rad/s^2, m/s^2].
inline constexpr double kStillAcceleration = 50;

/// What is left of that room at no more than the limit of velocity, either way.
template <class S>
LINDEN_INLINE void narrow_by_velocity(const JointLimit& limit, const S& h, S& lowest, S& highest) {
  using std::max;
  using std::min;
  const S reach = h * as<S>(limit.velocity);
  highest = max(min(highest, reach), -reach);
  lowest = min(max(lowest, -reach), reach);
}

/// Room for the displacement, and the modes that its first guess suggests, moved into the limits. past(row, k): displacement k steps
/// before, where two are `known`.
template <class S, class Past, class Mask>
void begin_limits(Limits<S>& limits, const Field<Index>& q_row, const S& h, const Field<S>& q, const Past& past, const Mask& known,
                  Field<S>& delta) {
  using std::max;
  using std::min;
  const S zero(0.0), one(1.0), slack = as<S>(1e-9);
  const S slow = h * h * as<S>(kStillAcceleration);
  for (Index k = 0; k < limits.mode.rows(); ++k) {
    const JointLimit& limit = limits.entries[static_cast<std::size_t>(k)];
    const S up = as<S>(limit.upper) - q(q_row(limit.row)), down = as<S>(limit.lower) - q(q_row(limit.row));
    S highest = max(up, zero), lowest = min(down, zero);
    if (limit.restitution > 0) {
      const S last = past(limit.row, 1), before_last = past(limit.row, 2);
      const S rise = max(last, before_last), fall = min(last, before_last);
      highest = select(known && up < slack && rise > slow, as<S>(-limit.restitution) * rise, highest);
      lowest = select(known && down > -slack && fall < -slow, as<S>(-limit.restitution) * fall, lowest);
    }
    narrow_by_velocity(limit, h, lowest, highest);
    limits.highest(k) = highest;
    limits.lowest(k) = lowest;
    S& d = delta(limit.row);
    // a joint that rested on its limit rests on
    const auto rests = known && past(limit.row, 1) == zero;
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

/// As revise_friction: joints that pass a limit are put on it; where `settled`, those that it would have to pull are let go. All at once
/// is quick but may go round in circles; `one_by_one` the last of the settled alone changes, which never does (Murty's rule: Note on a
/// Bard-type scheme for solving the complementarity problem (1974)).
template <class S, class Mask>
auto revise_limits(Limits<S>& limits, const Field<S>& residual, const Mask& settled, const Mask& one_by_one, Field<S>& delta) {
  const S zero(0.0), one(1.0);
  auto changed = zero > one;
  for (Index k = limits.mode.rows() - 1; k >= 0; --k) {
    const Index row = limits.entries[static_cast<std::size_t>(k)].row;
    S& d = delta(row);
    const S& mode = limits.mode(k);
    const auto open = mode == zero;
    // a residual above zero is taken away by a smaller delta: the joint leaves an upper limit by itself
    const auto may = !(one_by_one && (changed || !settled));
    const auto leaves = may && !open && settled && mode * residual(row) > zero;
    const auto above = may && open && d > limits.highest(k), below = may && open && d < limits.lowest(k);
    d = select(above, limits.highest(k), select(below, limits.lowest(k), d));
    changed = changed || leaves || above || below;
    limits.mode(k) = select(leaves, zero, select(above, one, select(below, -one, mode)));
  }
  return changed;
}

/// What the limits took in a step [J].
template <class S>
S limit_loss(const Limits<S>& limits, const S& h, const Field<S>& residual, const Field<S>& delta, const Field<S>& before) {
  S sum(0.0);
  for (Index k = 0; k < limits.mode.rows(); ++k) {
    const Index row = limits.entries[static_cast<std::size_t>(k)].row;
    sum = sum - select(limits.mode(k) != S(0.0), residual(row) * worked(1, delta(row), before(row)), S(0.0));
  }
  return sum / (h * h);
}

}  // namespace linden
