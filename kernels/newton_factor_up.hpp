// kernels/newton_factor_up.hpp
// Factor of the exact Jacobian of the discrete Euler-Lagrange residual, leaves to root, O(n) for all joint kinds.
//
// With eta the change of a body's pose at k+1 (body frame), h delta mu_i = K_i eta_i, a matrix of the body alone. Momenta travel up
// through X^k, which the step does not change; pose changes travel down through X^k+1 = X^k M. Hence
//
//   Pi_i = K_i + sum over children c of Ad_{X_c^-1}^T (Pi_c - U_c d_c^-1 W_c^T) Ad_{M_c^-1} Ad_{X_c^-1}
//   U = Pi S,  W^T = S^T Pi,  d = S^T U
//
// reads   inertia 10 x n, screw 2 x n, placement 12 x n at q^k, motion 7 x n, twist 6 x n, body_momentum 6 x n
// writes  articulated 36 x n (Pi), gains
// cost    one map (K) and one pass, one division a screw
// source  derivative of Algorithm 2 of the paper with respect to q^k+1, arranged as Featherstone's ABI
#pragma once

#include "kernels/articulated.hpp"
#include "kernels/se3.hpp"

namespace linden {

/// K of every body.
template <class S, class Element>
void pose_derivative_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 6>& twist,
                         const Field<S, 6>& body_momentum, Field<S, 36>& articulated) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  const Mat3<S> none{zero, zero, zero};
  store(articulated, 0, Mat6<S>{none, none, none, none});
  for (Index i = 1; i < tree.shape.slots; ++i) {
    store(articulated, i,
          pose_derivative(load<Inertia, S>(constants.inertia, i), load<Twist, S>(twist, i), load<Wrench, S>(body_momentum, i)));
  }
}

template <class S, class Element>
void newton_factor_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                      const Field<S, 7>& motion, const Field<S, 6>& twist, const Field<S, 6>& body_momentum,
                      Field<S, 36>& articulated, const Gains<S>& gains) {
  pose_derivative_map(tree, constants, twist, body_momentum, articulated);
  up(tree, [&](auto joint, Index i) {
    S felt[36];
    eliminate_joint(joint, tree, constants, i, articulated.row(i), gains, felt);
    if constexpr (joint != JointKind::free) {
      const auto X = load<Placement, S>(placement, i);
      const auto X_pose = after_motion(joint, X, load<Displacement, S>(motion, i));
      S* const parent = articulated.row(tree.parent(i));
      to_parent(X, X_pose, felt, [&](int at, const S& value) LINDEN_INLINE_LAMBDA { parent[at] = parent[at] + value; });
    }
  });
}

}  // namespace linden
