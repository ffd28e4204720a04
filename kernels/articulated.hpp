// kernels/articulated.hpp
// What the two factorisations (articulated_inertia_up: M; newton_factor_up: the exact Jacobian) share: taking a joint out of a
// 6 x 6 matrix and leaving the gains with which impulses pass the joint.
//
//   d = S^T A S,  gain_up = A S d^-1,  gain_down = (S^T A)^T d^-T,  what the parent feels: A - A S d^-1 S^T A
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.2, without the symmetry
#pragma once

#include "kernels/joints.hpp"
#include "kernels/small_matrix.hpp"

namespace linden {

/// Gains and inverse of one factorisation.
template <class S>
struct Gains {
  Field<S, 6>& up;       // nv rows: moment, force
  Field<S, 6>& down;     // nv rows: angular, linear
  Field<S>& inverse;     // nv x nv blocks
};

/// Row by row, as the 6 x 6 matrix it is.
template <class S>
LINDEN_INLINE std::array<S, 36> to_array(const Mat6<S>& A) {
  std::array<S, 36> a;
  const auto put = [&](std::size_t at, const Mat3<S>& block) {
    block.x.to(&a[at]);
    block.y.to(&a[at + 6]);
    block.z.to(&a[at + 12]);
  };
  put(0, A.aa);
  put(3, A.ab);
  put(18, A.ba);
  put(21, A.bb);
  return a;
}

/// Takes the joint of body i out of A, stores its gains. A free joint leaves nothing for its parent to feel.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Mat6<S> eliminate_joint(Joint<Kind>, const Tree& tree, const BodyConstants<Element>& constants, Index i, const Mat6<S>& A,
                        const Gains<S>& gains) {
  const Index row = tree.first_v(i), block = tree.first_block(i);
  const S zero(0.0), one(1.0);
  const Vec3<S> none{zero, zero, zero};
  if constexpr (Kind == JointKind::screw) {
    const Screw<S> screw = load_screw<S>(constants, i);
    const S r = screw.r, t = screw.t;
    const Wrench<S> U{{r * A.aa.x.z + t * A.ab.x.z, r * A.aa.y.z + t * A.ab.y.z, r * A.aa.z.z + t * A.ab.z.z},
                      {r * A.ba.x.z + t * A.bb.x.z, r * A.ba.y.z + t * A.bb.y.z, r * A.ba.z.z + t * A.bb.z.z}};
    const S inverse = one / (r * U.n.z + t * U.f.z);
    const Wrench<S> up = inverse * U;
    const Twist<S> W{r * A.aa.z + t * A.ba.z, r * A.ab.z + t * A.bb.z};  // rows of S^T A, as covectors of (w, v)
    store(gains.up, row, up);
    store(gains.down, row, inverse * W);
    gains.inverse(block) = inverse;
    return {A.aa - outer(up.n, W.w), A.ab - outer(up.n, W.v), A.ba - outer(up.f, W.w), A.bb - outer(up.f, W.v)};
  } else if constexpr (Kind == JointKind::ball) {
    std::array<S, 9> flat;
    A.aa.to(flat.data());
    invert<3>(flat);
    const auto inverse = Mat3<S>::from(flat.data());
    for (Index k = 0; k < 9; ++k) gains.inverse(block + k) = flat[static_cast<std::size_t>(k)];
    const Mat3<S> up = A.ba * inverse, down = inverse * A.ab;
    const Mat3<S> columns = transpose(up);
    store(gains.up, row, Wrench<S>{{one, zero, zero}, columns.x});
    store(gains.up, row + 1, Wrench<S>{{zero, one, zero}, columns.y});
    store(gains.up, row + 2, Wrench<S>{{zero, zero, one}, columns.z});
    store(gains.down, row, Twist<S>{{one, zero, zero}, down.x});
    store(gains.down, row + 1, Twist<S>{{zero, one, zero}, down.y});
    store(gains.down, row + 2, Twist<S>{{zero, zero, one}, down.z});
    const Mat3<S> nothing{none, none, none};
    return {nothing, nothing, nothing, A.bb - up * A.ab};
  } else {
    auto inverse = to_array(A);
    invert<6>(inverse);
    for (Index k = 0; k < 36; ++k) gains.inverse(block + k) = inverse[static_cast<std::size_t>(k)];
    // The gains are the identity: filled in for completeness, so that no row of them is ever left unwritten.
    for (int k = 0; k < 6; ++k) {
      for (int c = 0; c < 6; ++c) gains.up(row + k, c) = gains.down(row + k, c) = k == c ? one : zero;
    }
    const Mat3<S> nothing{none, none, none};
    return {nothing, nothing, nothing, nothing};
  }
}

/// Ad_{X^-1}^T A Ad_{X^-1}: A given in the child's frame, in the parent's.
template <class S>
LINDEN_INLINE Mat6<S> to_parent(const Placement<S>& X, const Mat6<S>& A) {
  const auto turned = [&](const Mat3<S>& block) { return times_transpose(X.R * block, X.R); };
  const Mat3<S> ba = turned(A.ba), bb = turned(A.bb);
  const Mat3<S> aa = turned(A.aa) + hat_times(X.p, ba), ab = turned(A.ab) + hat_times(X.p, bb);
  return {aa - times_hat(ab, X.p), ab, ba - times_hat(bb, X.p), bb};
}

}  // namespace linden
