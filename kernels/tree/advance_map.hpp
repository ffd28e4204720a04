// kernels/tree/advance_map.hpp
// Positions at the end of the step.
//
//   q_i <- q_i (+) M_i: a screw adds delta; ball and free joints multiply the motion on from the right
//
// One Newton step towards unit length keeps quaternions normalised to rounding for any number of steps.
//
// reads   motion 7 x n, delta nv [rad, m]
// writes  q nq
// cost    bodies are independent
#pragma once

#include "kernels/values/joints.hpp"

namespace linden {

/// q (3 - |q|^2) / 2: halves the digits of the error in |q|.
template <class S>
LINDEN_INLINE Quaternion<S> normalised(const Quaternion<S>& q) {
  const S scale = S(1.5) - S(0.5) * (dot(q.v, q.v) + q.w * q.w);
  return {scale * q.v, scale * q.w};
}

/// q of a joint after the motion M.
template <JointKind Kind, class S>
LINDEN_INLINE void advance(Joint<Kind>, Index row, const S& delta, const Displacement<S>& M, Field<S>& q) {
  if constexpr (Kind == JointKind::screw) {
    q(row) = q(row) + delta;
  } else {
    const Index turn = Kind == JointKind::free ? row + 3 : row;
    const Quaternion<S> before{load3<S>(q, turn), q(turn + 3)};
    if constexpr (Kind == JointKind::free) store3(q, row, load3<S>(q, row) + rotate(before, M.p));
    const Quaternion<S> after = normalised(before * M.r);
    store3(q, turn, after.v);
    q(turn + 3) = after.w;
  }
}

template <class S>
void advance_map(const Tree& tree, const Field<S, 7>& motion, const Field<S>& delta, Slots slots, Field<S>& q) {
  down(tree, slots, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    advance(joint, tree.first_q(i), delta(tree.first_v(i)), load<Displacement, S>(motion, slots.row(i)), q);
  });
}

template <class S>
void advance_map(const Tree& tree, const Field<S, 7>& motion, const Field<S>& delta, Field<S>& q) {
  advance_map(tree, motion, delta, all_slots(tree), q);
}

}  // namespace linden
