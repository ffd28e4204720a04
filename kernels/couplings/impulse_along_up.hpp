// First half of a solve for an impulse that few joints feel: those, and all joints above them.
//
//   u_i = r_i - S_i^T b_i,    b_parent += Ad_{X_i^-1}^T (b_i + gain_i u_i)                                       (impulse_pass_up)
//
// With gain_up and the placements of the beginning this is what is left of a column G^T when the joints below have yielded. The second half of
// a solve, read from the leaves to the root, has the same form: with gain_down and the placements of the end it is what a row J becomes for
// which  J A^-1 r = y.(d^-1 u),  y the row and u what is left of r. So J A^-1 G^T takes two sweeps over a path and no tree solve.
//
// reads   screw 2 x n, placements, gain 6 x nv, given(joint, k): r of joint slots[k]
// writes  take(joint, k, u) for each of them; bias 6 x n, of their rows alone and that of `top`
// slots   leaves first; each joint's parent is there too, or is `top`, 0: the world
// met     met(slot) before the joint of a body is gone through, when all that comes to its bias from below has come
// R       S, or several impulses in lanes (row_lanes.hpp)
// source  see impulse_pass_up.hpp; Featherstone, Rigid Body Dynamics Algorithms, 8.5 (loops within a tree's solve)
#pragma once

#include <span>

#include "kernels/couplings/row_lanes.hpp"
#include "kernels/tree/impulse_pass_up.hpp"

namespace linden {

template <class R, class S, class Element, class PlacementOf, class Met, class Given, class Take>
void impulse_along_up(const Tree& tree, const BodyConstants<Element>& constants, const PlacementOf& placement_of, const Field<S, 6>& gain,
                      std::span<const Index> slots, Index top, const Met& met, const Given& given, const Take& take, Field<R, 6>& bias) {
  const Vec3<R> zero{R(0.0), R(0.0), R(0.0)};
  for (const Index i : slots) store(bias, i, Wrench<R>{zero, zero});
  store(bias, top, Wrench<R>{zero, zero});
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const Index i = slots[k];
    met(i);
    with_joint(tree.kind(i), [&](auto joint) {
      const auto b = load<Wrench, R>(bias, i);
      const Wrench<R> u = given(joint, k) - project(joint, constants, i, b);
      take(joint, k, u);
      const Index parent = tree.parent(i), row = tree.first_v(i);
      if (parent == 0) return;
      const auto gained = [&](Index n) { return spread<R>(load<Wrench, S>(gain, row + n)); };
      Wrench<R> passed = b + u;
      if constexpr (joint == JointKind::screw) passed = b + u.n.x * gained(0);
      if constexpr (joint == JointKind::ball) passed = b + u.n.x * gained(0) + u.n.y * gained(1) + u.n.z * gained(2);
      store(bias, parent, load<Wrench, R>(bias, parent) + to_parent(spread<R>(placement_of(joint, i)), passed));
    });
  }
}

}  // namespace linden
