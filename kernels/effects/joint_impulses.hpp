// kernels/effects/joint_impulses.hpp
// What the effects of joints amount to within a step, summed row by row: impulses affine in the displacement.
//
//   an effect gives a joint the impulse    J = -(o + g delta) / h
//   a share s of it at the beginning       h r += s (o + g delta),    d += s g
//   the rest at the end of the step        h p -= (1 - s) (o + g delta)
//   held joints                            d = infinity: Delta = 0, the residual of the row is the impulse that holds it
//
// s = 1/2 is the midpoint rule where o + g delta is taken at the middle of the step: second order, symmetric in time, and a linear
// spring keeps its energy however stiff it is. What takes energy away must also do so where a step is far longer than its time
// constant: with s = 1/2 a velocity would then only change its sign from step to step. `begin_share` goes over to s = 1, backward Euler,
// from where the impulse of a step is as large as the inertia it acts on.
//
// Work: what acts at the beginning meets the velocities before it and after it, what acts at the end those of this step and the next. An
// impulse with share s therefore works along  work_displacement = delta - (s - 1/2) (delta - before),  before = displacement of the step
// before: summed over steps this is the kinetic energy it gives, an impact's too.
//
// reads   target nv as momentum_target_map left it (plain_target), delta nv
// writes  momentum_target nv; p nv
// cost    one multiplication and two additions a row and evaluation
// source  theta methods: Hairer, Wanner, Solving Ordinary Differential Equations II, IV.3
#pragma once

#include <algorithm>
#include <limits>

#include "kernels/values/joints.hpp"

namespace linden {

#define LINDEN_JOINT_IMPULSES_FIELDS(FIELD)                                                            \
  FIELD(Scalar, plain_target, 1, velocities, "h (p + h/2 Q): target of the residual without effects")  \
  FIELD(Scalar, offset, 1, velocities, "o, share of the beginning [kg m^2, kg m]")                     \
  FIELD(Scalar, gain, 1, velocities, "g, share of the beginning")                                      \
  FIELD(Scalar, end_offset, 1, velocities, "o, what p gets at the end")                                \
  FIELD(Scalar, end_gain, 1, velocities, "g, likewise")                                                \
  FIELD(Scalar, stiffness, 1, velocities, "what d grows by; infinite where a joint is held")

template <class Scalar>
struct JointImpulses {
  LINDEN_FIELDS(LINDEN_JOINT_IMPULSES_FIELDS)
};

/// s for an effect whose impulse over a step is `ratio` times what stops the joint.
LINDEN_INLINE double begin_share(double ratio) { return std::max(0.5, 1 - 0.5 / ratio); }

template <class S>
void clear(JointImpulses<S>& sum) {
  for (Field<S>* field : {&sum.offset, &sum.gain, &sum.end_offset, &sum.end_gain, &sum.stiffness}) {
    std::fill(field->flat().begin(), field->flat().end(), S(0.0));
  }
}

/// J = -(o + g delta) / h on one row, shares of it at the beginning and at the end.
template <class S>
LINDEN_INLINE void add_impulse(JointImpulses<S>& sum, Index row, const S& begin, const S& end, const S& o, const S& g) {
  sum.offset(row) = sum.offset(row) + begin * o;
  sum.gain(row) = sum.gain(row) + begin * g;
  sum.stiffness(row) = sum.stiffness(row) + begin * g;
  sum.end_offset(row) = sum.end_offset(row) - end * o;
  sum.end_gain(row) = sum.end_gain(row) - end * g;
}
template <class S>
LINDEN_INLINE void add_impulse(JointImpulses<S>& sum, Index row, double share, const S& o, const S& g) {
  add_impulse(sum, row, as<S>(share), as<S>(1 - share), o, g);
}

template <class S, class Mask>
LINDEN_INLINE void hold(JointImpulses<S>& sum, Index row, const Mask& held) {
  sum.stiffness(row) = select(held, as<S>(std::numeric_limits<double>::infinity()), sum.stiffness(row));
}

/// The target of an evaluation at `delta`.
template <class S>
void joint_impulses_map(const JointImpulses<S>& sum, const Field<S>& delta, Field<S>& target) {
  for (Index row = 0; row < target.rows(); ++row) target(row) = sum.plain_target(row) - (sum.offset(row) + sum.gain(row) * delta(row));
}

/// Displacement that an impulse works along; share: a number, or one of each instance.
template <class Share, class S>
LINDEN_INLINE S work_displacement(const Share& share, const S& delta, const S& before) {
  return delta - as<S>(share - Share(0.5)) * (delta - before);
}

/// The smaller of two numbers of one sign, else zero: of an impulse, what lasted from step to step, without what an impact gave.
template <class S>
LINDEN_INLINE S persistent(const S& a, const S& b) {
  using std::abs;
  using std::min;
  const S zero(0.0);
  return select(a * b > zero, select(a > zero, min(a, b), -min(-a, -b)), zero);
}

/// What p gets at the end of the step.
template <class S>
void joint_impulses_end_map(const JointImpulses<S>& sum, const S& h, const Field<S>& delta, Field<S>& end) {
  const S rate = S(1.0) / h;
  for (Index row = 0; row < end.rows(); ++row) end(row) = rate * (sum.end_offset(row) + sum.end_gain(row) * delta(row));
}

}  // namespace linden
