// kernels/placement_map.hpp
// Placement of every body in its parent at the positions q.
//
//   X_i = X_tree,i exp(S_i q_i)
//
// reads   tree_placement 12 x n, screw 2 x n, q nq [rad, m, unit quaternion]
// writes  placement 12 x n (child -> parent; rotation row by row, shift [m])
// cost    one sine and cosine a screw; bodies are independent
// source  the paper, (18); Featherstone, Rigid Body Dynamics Algorithms, 4.4
#pragma once

#include "kernels/joints.hpp"
#include "kernels/sincos.hpp"

namespace linden {

/// X of the body in slot i.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Placement<S> placed(Joint<Kind>, const BodyConstants<Element>& constants, Index i, Index row, const Field<S>& q) {
  const auto X = load<Placement, S>(constants.tree_placement, i);
  if constexpr (Kind == JointKind::screw) {
    const Screw<S> screw = load_screw<S>(constants, i);
    const S shift = screw.t * q(row);
    const SinCos<S> angle = sin_cos(screw.r * q(row));
    const S s = angle.sin, c = angle.cos;
    const auto turn = [&](const Vec3<S>& r) { return Vec3<S>{c * r.x + s * r.y, c * r.y - s * r.x, r.z}; };
    const Vec3<S> axis{X.R.x.z, X.R.y.z, X.R.z.z};
    return {{turn(X.R.x), turn(X.R.y), turn(X.R.z)}, X.p + shift * axis};
  } else if constexpr (Kind == JointKind::ball) {
    return {X.R * rotation(Quaternion<S>{load3<S>(q, row), q(row + 3)}), X.p};
  } else {
    return {X.R * rotation(Quaternion<S>{load3<S>(q, row + 3), q(row + 6)}), X.p + X.R * load3<S>(q, row)};
  }
}

template <class S, class Element>
void placement_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& q, Field<S, 12>& placement) {
  down(tree, [&](auto joint, Index i) { store(placement, i, placed(joint, constants, i, tree.first_q(i), q)); });
}

}  // namespace linden
