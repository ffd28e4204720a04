// kernels/motion_map.hpp
// The displacement of each joint over the step, as a group element near identity.
//
//   motion_map          M_i = exp(S_i delta_i)
//   correct_motion_map  M_i <- M_i exp(-s S_i Delta_i), delta of screws alike
//   displacement_map    delta_i = log M_i for ball and free joints (a screw's delta is kept as it goes)
//
// Newton's corrections of ball and free joints are multiplied on, so no chart and no derivative of one enters the solve. A correction
// taken back (s negative) returns to the same motion up to rounding: that is how the solver backtracks.
//
// reads   screw 2 x n, delta nv, increment nv [rad, m]
// writes  motion 7 x n (quaternion x y z w, shift [m]), delta nv
// range   turns by less than pi
// cost    two polynomials a screw; bodies are independent
#pragma once

#include "kernels/joints.hpp"
#include "kernels/se3.hpp"

namespace linden {

template <class S>
LINDEN_INLINE Displacement<S> screw_motion(const Screw<S>& screw, const S& delta) {
  const S zero(0.0);
  const S half = S(0.5) * screw.r * delta, square = half * half;
  return {{{zero, zero, half * sinc(square)}, S(1.0) - square * versine_over_square(square)}, {zero, zero, screw.t * delta}};
}

/// exp of the joint's rows of `delta`, times `factor`.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Displacement<S> joint_motion(Joint<Kind> joint, const BodyConstants<Element>& constants, Index i, Index row,
                             const Field<S>& delta, const S& factor) {
  if constexpr (Kind == JointKind::screw) {
    return screw_motion(load_screw<S>(constants, i), factor * delta(row));
  } else {
    const Wrench<S> rows = load_joint(joint, delta, row);
    return exp(Twist<S>{factor * rows.n, factor * rows.f});
  }
}

template <class S, class Element>
void motion_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& delta, Field<S, 7>& motion) {
  down(tree, [&](auto joint, Index i) {
    store(motion, i, joint_motion(joint, constants, i, tree.first_v(i), delta, S(1.0)));
  });
}

template <class S, class Element>
void correct_motion_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& increment, const S& factor,
                        Field<S>& delta, Field<S, 7>& motion) {
  down(tree, [&](auto joint, Index i) {
    const Index row = tree.first_v(i);
    if constexpr (joint == JointKind::screw) {
      delta(row) = delta(row) - factor * increment(row);
      store(motion, i, screw_motion(load_screw<S>(constants, i), delta(row)));
    } else {
      const auto M = load<Displacement, S>(motion, i);
      store(motion, i, M * joint_motion(joint, constants, i, row, increment, -factor));
    }
  });
}

template <class S>
void displacement_map(const Tree& tree, const Field<S, 7>& motion, Field<S>& delta) {
  down(tree, [&](auto joint, Index i) {
    if constexpr (joint != JointKind::screw) {
      const Twist<S> u = log(load<Displacement, S>(motion, i));
      store_joint(joint, delta, tree.first_v(i), Wrench<S>{u.w, u.v});
    }
  });
}

}  // namespace linden
