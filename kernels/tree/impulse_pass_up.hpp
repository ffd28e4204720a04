// kernels/tree/impulse_pass_up.hpp
// First half of a solve with a factored matrix: what of the impulses at the joints is left when the joints below yield.
//
//   u_i = r_i - S_i^T b_i,    b_parent += Ad_{X_i^-1}^T (b_i + gain_up_i u_i)
//
// reads   screw 2 x n, placement 12 x n, gains, residual nv
// writes  bias 6 x n (b), innovation nv (u)
// returns sum of |u.(d^-1 u)| = r.(A^-1 r) for a symmetric positive factor: the squared energy norm of r. The exact Jacobian differs
//         from h^-1 M by O(h), and far from the solution its d may even be negative, hence the absolute value
// slots   all, or parts of them in the order of a way up
// cost    one pass
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.3, pass 2, for impulses
#pragma once

#include "kernels/tree/articulated.hpp"

namespace linden {

/// d^-1 u
template <JointKind Kind, class S>
LINDEN_INLINE Wrench<S> apply_inverse(Joint<Kind>, const Field<S>& inverse, Index block, const Wrench<S>& u) {
  if constexpr (Kind == JointKind::screw) {
    return {{inverse(block) * u.n.x, S(0.0), S(0.0)}, u.f};
  } else {
    constexpr Index n = velocity_count(Kind);
    S in[6], out[6];
    u.to(in);
    u.to(out);
    for (Index r = 0; r < n; ++r) {
      out[r] = inverse(block + n * r) * in[0];
      for (Index c = 1; c < n; ++c) out[r] = out[r] + inverse(block + n * r + c) * in[c];
    }
    return Wrench<S>::from(out);
  }
}

/// d^-T y
template <JointKind Kind, class S, class R>
LINDEN_INLINE Wrench<R> apply_inverse_transposed(Joint<Kind>, const Field<S>& inverse, Index block, const Wrench<R>& y) {
  if constexpr (Kind == JointKind::screw) {
    return {{R(inverse(block)) * y.n.x, R(0.0), R(0.0)}, y.f};
  } else {
    constexpr Index n = velocity_count(Kind);
    R in[6], out[6];
    y.to(in);
    y.to(out);
    for (Index c = 0; c < n; ++c) {
      out[c] = R(inverse(block + c)) * in[0];
      for (Index r = 1; r < n; ++r) out[c] = out[c] + R(inverse(block + n * r + c)) * in[r];
    }
    return Wrench<R>::from(out);
  }
}

/// b + gain_up u, adding |u.(d^-1 u)| to `norm`.
template <JointKind Kind, class S>
LINDEN_INLINE Wrench<S> bias_to_parent(Joint<Kind> joint, const Tree& tree, const Gains<S>& gains, Index i, const Wrench<S>& b,
                                  const Wrench<S>& u, S& norm) {
  using std::abs;
  const Index row = tree.first_v(i);
  const Wrench<S> given = apply_inverse(joint, gains.inverse, tree.first_block(i), u);
  if constexpr (Kind == JointKind::screw) {
    norm = norm + abs(u.n.x * given.n.x);
    return b + u.n.x * load<Wrench, S>(gains.up, row);
  } else if constexpr (Kind == JointKind::ball) {
    norm = norm + abs(dot(u.n, given.n));
    return b + u.n.x * load<Wrench, S>(gains.up, row) + u.n.y * load<Wrench, S>(gains.up, row + 1) +
           u.n.z * load<Wrench, S>(gains.up, row + 2);
  } else {
    norm = norm + abs(dot(u.n, given.n) + dot(u.f, given.f));
    return b + u;
  }
}

/// Sum of |u.(d^-1 u)| by itself, of what is left of the impulses.
template <class S>
S energy_norm(const Tree& tree, const Field<S>& inverse, const Field<S>& innovation) {
  using std::abs;
  S norm(0.0);
  up(tree, [&](auto joint, Index i) {
    const Wrench<S> u = load_joint(joint, innovation, tree.first_v(i));
    const Wrench<S> given = apply_inverse(joint, inverse, tree.first_block(i), u);
    norm = norm + abs(dot(u.n, given.n) + dot(u.f, given.f));
  });
  return norm;
}

template <class S, class Element>
S impulse_pass_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains,
                  const Field<S>& residual, Slots slots, Field<S, 6>& bias, Field<S>& innovation) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  for (Index i = 0; slots.end == tree.shape.slots && i < slots.end; ++i) store(bias, i, Wrench<S>{zero, zero});
  S norm(0.0);
  up(tree, slots, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const Index row = tree.first_v(i);
    const auto b = load<Wrench, S>(bias, i);
    const Wrench<S> u = load_joint(joint, residual, row) - project(joint, constants, i, b);
    store_joint(joint, innovation, row, u);
    const Wrench<S> passed = bias_to_parent(joint, tree, gains, i, b, u, norm);
    const Index parent = tree.parent(i);
    store(bias, parent, load<Wrench, S>(bias, parent) + to_parent(load<Placement, S>(placement, i), passed));
  });
  return norm;
}

template <class S, class Element>
S impulse_pass_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains,
                  const Field<S>& residual, Field<S, 6>& bias, Field<S>& innovation) {
  return impulse_pass_up(tree, constants, placement, gains, residual, all_slots(tree), bias, innovation);
}

}  // namespace linden
