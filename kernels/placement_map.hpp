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

namespace linden {

template <class S, class Element>
void placement_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& q, Field<S, 12>& placement) {
  using std::cos;
  using std::sin;
  down(tree, [&](auto joint, Index i) {
    const auto X = load<Placement, S>(constants.tree_placement, i);
    const Index row = tree.first_q(i);
    if constexpr (joint == JointKind::screw) {
      const Screw<S> screw = load_screw<S>(constants, i);
      const S angle = screw.r * q(row), shift = screw.t * q(row);
      const S c = cos(angle), s = sin(angle);
      const auto turn = [&](const Vec3<S>& r) { return Vec3<S>{c * r.x + s * r.y, c * r.y - s * r.x, r.z}; };
      const Vec3<S> axis{X.R.x.z, X.R.y.z, X.R.z.z};
      store(placement, i, Placement<S>{{turn(X.R.x), turn(X.R.y), turn(X.R.z)}, X.p + shift * axis});
    } else if constexpr (joint == JointKind::ball) {
      const Quaternion<S> turn{load3<S>(q, row), q(row + 3)};
      store(placement, i, Placement<S>{X.R * rotation(turn), X.p});
    } else {
      const Quaternion<S> turn{load3<S>(q, row + 3), q(row + 6)};
      store(placement, i, Placement<S>{X.R * rotation(turn), X.p + X.R * load3<S>(q, row)});
    }
  });
}

}  // namespace linden
