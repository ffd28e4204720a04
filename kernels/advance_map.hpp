// kernels/advance_map.hpp
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

#include "kernels/joints.hpp"

namespace linden {

/// q (3 - |q|^2) / 2: halves the digits of the error in |q|.
template <class S>
LINDEN_INLINE Quaternion<S> normalised(const Quaternion<S>& q) {
  const S scale = S(1.5) - S(0.5) * (dot(q.v, q.v) + q.w * q.w);
  return {scale * q.v, scale * q.w};
}

template <class S>
void advance_map(const Tree& tree, const Field<S, 7>& motion, const Field<S>& delta, Field<S>& q) {
  down(tree, [&](auto joint, Index i) {
    const Index row = tree.first_q(i);
    if constexpr (joint == JointKind::screw) {
      q(row) = q(row) + delta(tree.first_v(i));
    } else {
      const auto M = load<Displacement, S>(motion, i);
      const Index turn = joint == JointKind::free ? row + 3 : row;
      const Quaternion<S> before{load3<S>(q, turn), q(turn + 3)};
      if constexpr (joint == JointKind::free) store3(q, row, load3<S>(q, row) + rotate(before, M.p));
      const Quaternion<S> after = normalised(before * M.r);
      store3(q, turn, after.v);
      q(turn + 3) = after.w;
    }
  });
}

}  // namespace linden
