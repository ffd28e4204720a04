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

/// A Ad_{M^-1} for the motion of a joint.
template <JointKind Kind, class S>
LINDEN_INLINE Mat6<S> before_motion(Joint<Kind>, const Displacement<S>& M, const Mat6<S>& A) {
  if constexpr (Kind == JointKind::screw) {
    // full angle from the half angle: a turn about z mixes the first two columns, a shift along z adds from b to a
    const S c = S(1.0) - S(2.0) * M.r.v.z * M.r.v.z, s = S(2.0) * M.r.v.z * M.r.w, t = M.p.z;
    const auto turn = [&](const Vec3<S>& row) { return Vec3<S>{c * row.x - s * row.y, s * row.x + c * row.y, row.z}; };
    const auto both = [&](const Vec3<S>& a, const Vec3<S>& b) {
      return Vec3<S>{a.x - t * b.y, a.y + t * b.x, a.z};
    };
    const auto columns = [&](const Mat3<S>& block) { return Mat3<S>{turn(block.x), turn(block.y), turn(block.z)}; };
    const Mat3<S> ab = columns(A.ab), bb = columns(A.bb), aa = columns(A.aa), ba = columns(A.ba);
    return {{both(aa.x, ab.x), both(aa.y, ab.y), both(aa.z, ab.z)}, ab,
            {both(ba.x, bb.x), both(ba.y, bb.y), both(ba.z, bb.z)}, bb};
  } else {
    // only ball joints come here, and what their parent feels is a force alone
    Mat6<S> moved = A;
    moved.bb = times_transpose(A.bb, rotation(M.r));
    return moved;
  }
}

template <class S, class Element>
void newton_factor_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                      const Field<S, 7>& motion, const Field<S, 6>& twist, const Field<S, 6>& body_momentum,
                      Field<S, 36>& articulated, const Gains<S>& gains) {
  pose_derivative_map(tree, constants, twist, body_momentum, articulated);
  up(tree, [&](auto joint, Index i) {
    const Mat6<S> felt = eliminate_joint(joint, tree, constants, i, load<Mat6, S>(articulated, i), gains);
    if constexpr (joint != JointKind::free) {
      const Mat6<S> before = before_motion(joint, load<Displacement, S>(motion, i), felt);
      const Index parent = tree.parent(i);
      store(articulated, parent, load<Mat6, S>(articulated, parent) + to_parent(load<Placement, S>(placement, i), before));
    }
  });
}

}  // namespace linden
