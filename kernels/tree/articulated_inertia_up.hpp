// kernels/tree/articulated_inertia_up.hpp
// Factor of the mass matrix M(q): articulated-body inertias, leaves to root.
//
//   A_i = G_i + sum over children c of Ad_{X_c^-1}^T (A_c - U_c d_c^-1 U_c^T) Ad_{X_c^-1},   U = A S,  d = S^T U
//
// With impulse_pass_up and rate_down it applies M^-1 in O(n): the velocity of a momentum, and (times h) the inverse Jacobian of RIQN.
//
// reads   inertia 10 x n, screw 2 x n, placement 12 x n
// writes  articulated 36 x n (A), gains
// slots   all, or parts of them in the order of a way up
// cost    one pass, one division a screw; the bodies of one level are independent but for the sum into their parents
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.3 (ABI); the paper, 3.2
#pragma once

#include <array>

#include "kernels/tree/articulated.hpp"

namespace linden {

template <class S, class Element, int Room, class Added = NothingAdded>
void articulated_inertia_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, Slots slots,
                            Field<S, Room>& articulated, const Gains<S>& gains, const Added& added = {}) {
  for (Index i = 0; slots.end == tree.shape.slots && i < slots.end; ++i) {
    const auto G = load<Inertia, S>(constants.inertia, i);
    const Mat3<S> C = hat(G.mc);
    Mat6<S> A{G.rotational(), C, transpose(C), diagonal(G.m)};
    if constexpr (Added::to_bodies) A = A + Mat6<S>::from(added.body_stiffness.row(i));
    A.to(articulated.row(i));
  }
  up(tree, slots, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    S reduced[36];
    eliminate_joint(joint, tree, constants, i, articulated.row(i), gains, reduced, added);
    if constexpr (joint != JointKind::free) {
      const auto X = load<Placement, S>(placement, i);
      S* const parent = articulated.row(tree.parent(i));
      to_parent(X, X, reduced, [&](int at, const S& value) LINDEN_INLINE_LAMBDA { parent[at] = parent[at] + value; });
    }
  });
}

template <class S, class Element, int Room, class Added = NothingAdded>
void articulated_inertia_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                            Field<S, Room>& articulated, const Gains<S>& gains, const Added& added = {}) {
  articulated_inertia_up(tree, constants, placement, all_slots(tree), articulated, gains, added);
}

/// What a body feels beside its own inertia and that of bodies beyond: once those have been met, and it has not. felt: as Mat6 has it.
template <class S, int Room>
void add_inertia(Index i, const std::array<S, 36>& felt, Field<S, Room>& articulated) {
  S* const row = articulated.row(i);
  for (std::size_t k = 0; k < felt.size(); ++k) row[k] = row[k] + felt[k];
}

}  // namespace linden
