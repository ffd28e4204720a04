// kernels/tree/displacement_down.hpp
// How far every body moves in the step, root to leaves.
//
//   dT_i = X_i^-1 dT_lambda(i) X_i  M_i        (19) in displacement form
//
// Nothing is formed as (something near I) minus I: dT is a quaternion near identity and a shift, so log dT keeps its relative
// accuracy however small the step. With dT_lambda = (w, v; p) and X = (R, s)
//
//   X^-1 dT_lambda X = (w, R^T v;  R^T (p + 2 v x (w s + v x s)))
//
// reads   placement 12 x n at q^k, motion 7 x n
// writes  displacement 7 x n (quaternion x y z w, shift [m]; body frame)
// slots   [begin, end) in order, begin = 1 first: a caller may take a large tree in parts that stay in cache
// returns the least w of any body: where it is not positive a body turned by pi or more, which log cannot represent
// cost    one pass; bodies of one level are independent and fill the lanes where there are enough of them: a binary tree of 1,023 takes
//         3.5 ns a body so, one by one 6.5 (EPYC Zen 5, AVX-512)
// source  the paper, (19)
#pragma once

#include <algorithm>

#include "kernels/values/body_lanes.hpp"
#include "kernels/values/joints.hpp"

namespace linden {

/// dT of a body from its parent's, the placement and the motion of its joint.
template <JointKind Kind, class S>
LINDEN_INLINE Displacement<S> moved(Joint<Kind>, const Displacement<S>& parent, const Placement<S>& X, const Displacement<S>& M) {
  const Vec3<S>& v = parent.r.v;
  const Vec3<S> shift = parent.p + S(2.0) * cross(v, parent.r.w * X.p + cross(v, X.p));
  const Displacement<S> carried{{transpose_times(X.R, v), parent.r.w}, transpose_times(X.R, shift)};
  if constexpr (Kind == JointKind::screw) {
    // M turns about z and shifts along z
    const S c = M.r.w, s = M.r.v.z, w = carried.r.w;
    const Vec3<S>& u = carried.r.v;
    const Vec3<S> axis{S(2.0) * (u.x * u.z + w * u.y), S(2.0) * (u.y * u.z - w * u.x), S(1.0) - S(2.0) * (u.x * u.x + u.y * u.y)};
    return {{{u.x * c + u.y * s, u.y * c - u.x * s, u.z * c + w * s}, w * c - u.z * s}, carried.p + M.p.z * axis};
  } else {
    return carried * M;
  }
}

template <class S>
S displacement_down(const Tree& tree, const Field<S, 12>& placement, const Field<S, 7>& motion, Slots slots, Field<S, 7>& displacement) {
  using std::min;
  const S zero(0.0), one(1.0);
  if (slots.begin == 1) store(displacement, 0, Displacement<S>{{{zero, zero, zero}, one}, {zero, zero, zero}});
  S least = one;
  const auto one_by_one = [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    auto D = load<Displacement, S>(displacement, slots.row_of_parent(part.begin - 1));  // of the body before, often the parent
    for (Index i = part.begin; i < part.end; ++i) {
      const auto M = load<Displacement, S>(motion, slots.row(i));
      const Index parent = tree.parent(i);
      if (parent != i - 1) D = load<Displacement, S>(displacement, slots.row_of_parent(parent));
      D = moved(joint, D, load<Placement, S>(placement, slots.row(i)), M);
      store(displacement, slots.row(i), D);
      least = min(least, min(D.r.w, M.r.w));
    }
  };
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (std::is_same_v<S, double>) {
      const auto many = [&](auto bodies, Index i) LINDEN_INLINE_LAMBDA {
        const auto M = gather<Displacement>(bodies, motion, slots.row(i));
        const auto above = gather_at<Displacement>(bodies, displacement, rows_of_parents(tree, slots, i).data());
        const auto next = moved(joint, above, gather<Placement>(bodies, placement, slots.row(i)), M);
        scatter(bodies, displacement, slots.row(i), next);
        least = min(least, least_of(bodies, min(next.r.w, M.r.w)));
      };
      for_same_level_down(tree, part, many, [&](Slots few) LINDEN_INLINE_LAMBDA { one_by_one(joint, few); });
    } else {
      one_by_one(joint, part);
    }
  });
  return least;
}

template <class S>
S displacement_down(const Tree& tree, const Field<S, 12>& placement, const Field<S, 7>& motion, Field<S, 7>& displacement) {
  return displacement_down(tree, placement, motion, all_slots(tree), displacement);
}

}  // namespace linden
