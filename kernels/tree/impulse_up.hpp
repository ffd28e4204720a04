// kernels/tree/impulse_up.hpp
// Impulses summed over subtrees and projected on the joints, leaves to root.
//
//   F_i = m_i + sum over children c of Ad_{X_c^-1}^T F_c        (21a)
//   out_i = S_i^T F_i                                           (22)
//
// The one upward sweep behind the residual (m = h mu at q^k), the new momentum (m = h nu at q^k+1), M(q) v (m = G V), the Coriolis
// force and the system's momentum (F of slot 0, about the world's origin).
//
// reads   screw 2 x n, placement 12 x n, impulse 6 x n holding m
// writes  impulse 6 x n holding F; projected nv
// cost    one pass; the bodies of one level are independent but for the sum into their parents
// source  the paper, Algorithm 2, lines 8 and 9
#pragma once

#include "kernels/values/joints.hpp"

namespace linden {

template <class S, class Element>
void impulse_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, Field<S, 6>& impulse,
                Field<S>& projected) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  store(impulse, 0, Wrench<S>{zero, zero});
  up(tree, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const auto F = load<Wrench, S>(impulse, i);
    store_joint(joint, projected, tree.first_v(i), project(joint, constants, i, F));
    const Index parent = tree.parent(i);
    store(impulse, parent, load<Wrench, S>(impulse, parent) + to_parent(load<Placement, S>(placement, i), F));
  });
}

}  // namespace linden
