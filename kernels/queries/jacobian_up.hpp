// kernels/queries/jacobian_up.hpp
// The Jacobian of a frame that a body carries, from the body up to the root.
//
//   J_i = Ad_{E^-1 T_i} S_i         columns of the joints above or at the body; zero elsewhere
//
// J v is the twist of the body as seen from the frame E: E = T of the body, or of a link in it, gives the link's frame; its origin with the
// world's directions gives the velocity of that place in the world; E = 1 the spatial velocity.
//
// reads   screw 2 x n, pose 12 x n
// writes  jacobian 6 x nv, row by row: angular, linear
// cost    one adjoint a joint on the path, and 6 nv numbers to clear
// source  Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, 3.4
#pragma once

#include <algorithm>

#include "kernels/queries/mass_matrix_up.hpp"

namespace linden {

/// T^-1 E
template <class S>
LINDEN_INLINE Placement<S> seen_from(const Placement<S>& T, const Placement<S>& E) {
  const Mat3<S> back = transpose(T.R);
  return {back * E.R, back * (E.p - T.p)};
}

template <class S, class Element>
void jacobian_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& pose, Index slot, const Placement<S>& frame,
                 S* jacobian) {
  const Index nv = tree.shape.velocities;
  std::fill(jacobian, jacobian + 6 * static_cast<std::size_t>(nv), S(0.0));
  for (Index i = slot; i != 0; i = tree.parent(i)) {
    const Placement<S> E = seen_from(load<Placement, S>(pose, i), frame);
    with_joint(tree.kind(i), [&](auto joint) {
      for (Index k = 0; k < velocity_count(joint); ++k) {
        S column[6];
        to_child(E, joint_column<joint.value, S>(joint, constants, i, k)).to(column);
        for (Index row = 0; row < 6; ++row) jacobian[row * nv + tree.first_v(i) + k] = column[row];
      }
    });
  }
}

}  // namespace linden
