// kernels/block/block_factor_up.hpp
// The Jacobian of a step, factored for a block of instances: lane = instance. Newton_factor_up's arithmetic, body by body.
//
// With the exact K, or with K to first order in the turn of a body: that takes 0.6 of the time and leaves its square of a correction. Asked
// in each body, not compiled twice: what comes after is the larger part.
//
// reads   screw 2 x n, inertia 10 x n, placement 12 x n, motion 7 x n (of a screw's only z, w and shift), turn 3 x n or displacement 7 x n
// writes  articulated 36 x n (the children's share of Pi), gains
// slots   all, or parts of them in the order of a way up
// source  see newton_factor_up.hpp
#pragma once

#include <cstdint>

#include "kernels/block/evaluate_down.hpp"
#include "kernels/tree/newton_factor_up.hpp"

namespace linden {

enum class Jacobian : std::uint8_t { first_order, exact };

template <class S, class Element, class Added = NothingAdded>
[[gnu::noinline]] void block_factor_up(const Tree& tree, const BodyConstants<Element>& constants, Slots slots, Workspace<S>& work,
                                       const Gains<S>& gains, Jacobian jacobian, const Added& added = {}) {
  up(tree, slots, [&](auto joint, Index i) {
    const auto G = load<Inertia, S>(constants.inertia, i);
    Mat6<S> A;
    if (jacobian == Jacobian::first_order) {
      A = pose_derivative_first_order(G, load<Vec3, S>(work.turn, i));
    } else {
      const Twist<S> twist = log(load<Displacement, S>(work.displacement, i));
      A = pose_derivative(G, twist, G * twist);
    }
    if constexpr (Added::to_bodies) A = A + Mat6<S>::from(added.body_stiffness.row(i));
    if (tree.is_leaf(i) == 0) A = A + Mat6<S>::from(work.articulated.row(i));
    A.to(work.articulated.row(i));
    spill_here();
    S reduced[36];
    eliminate_joint(joint, tree, constants, i, work.articulated.row(i), gains, reduced, added);
    spill_here();

    S* const above = work.articulated.row(tree.parent(i));
    if constexpr (joint != JointKind::free) {
      const auto X = load<Placement, S>(work.placement, i);
      const auto X_pose = after_motion(joint, X, load_motion(joint, work.motion, i));
      if (tree.is_last_child(i) != 0) {
        to_parent(X, X_pose, reduced, [&](int at, const S& value) LINDEN_INLINE_LAMBDA { above[at] = value; });
      } else {
        to_parent(X, X_pose, reduced, [&](int at, const S& value) LINDEN_INLINE_LAMBDA { above[at] = above[at] + value; });
      }
    } else if (tree.is_last_child(i) != 0) {
      for (int k = 0; k < 36; ++k) above[k] = S(0.0);
    }
    spill_here();
  });
}

template <class S, class Element, class Added = NothingAdded>
void block_factor_up(const Tree& tree, const BodyConstants<Element>& constants, Workspace<S>& work, const Gains<S>& gains, Jacobian jacobian,
                     const Added& added = {}) {
  block_factor_up(tree, constants, all_slots(tree), work, gains, jacobian, added);
}

}  // namespace linden
