// kernels/tree/placement_map.hpp
// Placement of every body in its parent at the positions q.
//
//   X_i = X_tree,i exp(S_i q_i)
//
// reads   tree_placement 12 x n, screw 2 x n, q nq [rad, m, unit quaternion]
// writes  placement 12 x n (child -> parent; rotation row by row, shift [m])
// cost    one sine and cosine a screw; a body in every lane
// source  the paper, (18); Featherstone, Rigid Body Dynamics Algorithms, 4.4
#pragma once

#include "kernels/values/body_lanes.hpp"
#include "kernels/values/joints.hpp"
#include "kernels/values/sincos.hpp"

namespace linden {

/// X of a screw joint at q.
template <class S>
LINDEN_INLINE Placement<S> placed(const Placement<S>& tree_placement, const Screw<S>& screw, const S& q) {
  const Placement<S>& X = tree_placement;
  const SinCos<S> angle = sin_cos(screw.r * q);
  const S s = angle.sin, c = angle.cos, shift = screw.t * q;
  const auto turn = [&](const Vec3<S>& r) LINDEN_INLINE_LAMBDA { return Vec3<S>{c * r.x + s * r.y, c * r.y - s * r.x, r.z}; };
  const Vec3<S> axis{X.R.x.z, X.R.y.z, X.R.z.z};
  return {{turn(X.R.x), turn(X.R.y), turn(X.R.z)}, X.p + shift * axis};
}

/// X of the body in slot i.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Placement<S> placed(Joint<Kind>, const BodyConstants<Element>& constants, Index i, Index row, const Field<S>& q) {
  const auto X = load<Placement, S>(constants.tree_placement, i);
  if constexpr (Kind == JointKind::screw) {
    return placed(X, load_screw<S>(constants, i), q(row));
  } else if constexpr (Kind == JointKind::ball) {
    return {X.R * rotation(Quaternion<S>{load3<S>(q, row), q(row + 3)}), X.p};
  } else {
    return {X.R * rotation(Quaternion<S>{load3<S>(q, row + 3), q(row + 6)}), X.p + X.R * load3<S>(q, row)};
  }
}

template <class S, class Element>
void placement_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& q, Slots slots,
                   Field<S, 12>& placement) {
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw) {
      const Index shift = tree.first_q(part.begin) - part.begin;
      for_bodies<S>(part.begin, part.end, [&](auto bodies, Index i) {
        const auto X = gather<Placement>(bodies, constants.tree_placement, i);
        scatter(bodies, placement, slots.row(i), placed(X, gather<Screw>(bodies, constants.screw, i), gather_row(bodies, q, i + shift)));
      });
    } else {
      for (Index i = part.begin; i < part.end; ++i) store(placement, slots.row(i), placed(joint, constants, i, tree.first_q(i), q));
    }
  });
}

template <class S, class Element>
void placement_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& q, Field<S, 12>& placement) {
  placement_map(tree, constants, q, all_slots(tree), placement);
}

}  // namespace linden
