// kernels/queries/motion_between_map.hpp
// The motion of every joint from one configuration to another: what motion_map makes of a displacement, found from both ends of it.
//
//   M_i = exp(S_i q_i)^-1 exp(S_i q'_i)
//
// Of the two quaternions that stand for a turn the one with w >= 0 is taken, the shorter way round.
//
// reads   screw 2 x n, from nq, to nq
// writes  motion 7 x n (quaternion x y z w, shift [m])
// range   turns by less than pi
#pragma once

#include "kernels/tree/motion_map.hpp"

namespace linden {

template <class S>
LINDEN_INLINE Quaternion<S> turn_between(const Quaternion<S>& from, const Quaternion<S>& to) {
  const Quaternion<S> turn = Quaternion<S>{-from.v, from.w} * to;
  const S sign = select(turn.w < S(0.0), S(-1.0), S(1.0));
  return {sign * turn.v, sign * turn.w};
}

template <class S, class Element>
void motion_between_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& from, const Field<S>& to,
                        Field<S, 7>& motion) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  down(tree, [&](auto joint, Index i) {
    const Index row = tree.first_q(i);
    if constexpr (joint == JointKind::screw) {
      store(motion, i, screw_motion(load_screw<S>(constants, i), to(row) - from(row)));
    } else {
      const Index turn = joint == JointKind::free ? row + 3 : row;
      const Quaternion<S> before{load3<S>(from, turn), from(turn + 3)}, after{load3<S>(to, turn), to(turn + 3)};
      const Quaternion<S> back{-before.v, before.w};
      const Vec3<S> shift = joint == JointKind::free ? rotate(back, load3<S>(to, row) - load3<S>(from, row)) : zero;
      store(motion, i, Displacement<S>{turn_between(before, after), shift});
    }
  });
}

}  // namespace linden
