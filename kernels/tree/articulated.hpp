// kernels/tree/articulated.hpp
// What the two factorisations (articulated_inertia_up: M; newton_factor_up: the exact Jacobian) share: taking a joint out of a
// 6 x 6 matrix and leaving the gains with which impulses pass the joint.
//
//   d = S^T A S,  gain_up = A S d^-1,  gain_down = (S^T A)^T d^-T,  what the parent feels: A - A S d^-1 S^T A
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.2, without the symmetry
#pragma once

#include "kernels/values/body_lanes.hpp"
#include "kernels/values/joints.hpp"
#include "kernels/values/small_matrix.hpp"

namespace linden {

/// Gains and inverse of one factorisation.
template <class S>
struct Gains {
  Field<S, 6>& up;       // nv rows: moment, force
  Field<S, 6>& down;     // nv rows: angular, linear
  Field<S>& inverse;     // nv x nv blocks
};

/// What effects add to a factor: nothing, where a scene has none.
struct NothingAdded {
  static constexpr bool to_joints = false, to_bodies = false;
};

/// d grows by a number a row (infinite: the joint is held), the 6 x 6 matrix of a body by another.
template <class S, bool Joints, bool Bodies>
struct EffectsAdded {
  static constexpr bool to_joints = Joints, to_bodies = Bodies;
  const Field<S>& stiffness;
  const Field<S, 36>& body_stiffness;
};

/// Values before this line go through memory to those after it. A 6 x 6 matrix and two placements do not fit in 32 registers, and
/// left to themselves compilers keep all 36 numbers alive and spill them twice over: the factor of a block took 132 ns a body so,
/// and takes 95 in steps that each fit.
LINDEN_INLINE void spill_here() { asm volatile("" ::: "memory"); }

/// Where row k and column k of a 6 x 6 matrix stored as a Mat6 begin.
constexpr int row_start(int k) { return 18 * (k / 3) + 3 * (k % 3); }
constexpr int column_start(int k) { return 9 * (k / 3) + k % 3; }

/// Row: a covector of (w, v).
template <class S>
LINDEN_INLINE Twist<S> load_row(const S* row) {
  return {Vec3<S>::from(row), Vec3<S>::from(row + 9)};
}

template <class S>
LINDEN_INLINE void store_row(S* row, const Twist<S>& value) {
  value.w.to(row);
  value.v.to(row + 9);
}

template <class S>
LINDEN_INLINE Wrench<S> load_column(const S* column) {
  return {{column[0], column[3], column[6]}, {column[18], column[21], column[24]}};
}

/// Takes a screw out of A, 36 numbers stored as a Mat6, and stores its gains: of one body, or of several with a body in every lane.
template <class Bodies, class S, class Element, class Added>
LINDEN_INLINE void eliminate_screw(Bodies bodies, const Tree& tree, const BodyConstants<Element>& constants, Index i,
                                   const typename Bodies::Scalar* A, const Gains<S>& gains, typename Bodies::Scalar* reduced, const Added& added) {
  using B = typename Bodies::Scalar;
  const Index row = tree.first_v(i);
  const Screw<B> screw = gather<Screw>(bodies, constants.screw, i);
  const Wrench<B> U = screw.r * load_column(A + column_start(2)) + screw.t * load_column(A + column_start(5));
  B d = screw.r * U.n.z + screw.t * U.f.z;
  if constexpr (Added::to_joints) d = d + gather_row(bodies, added.stiffness, row);
  const B inverse = B(1.0) / d;
  const Wrench<B> up = inverse * U;
  const Twist<B> W = screw.r * load_row(A + row_start(2)) + screw.t * load_row(A + row_start(5));
  scatter(bodies, gains.up, row, up);
  scatter(bodies, gains.down, row, inverse * W);
  scatter_row(bodies, gains.inverse, tree.first_block(i), inverse);
  const auto downdate = [&](int at, const B& share) LINDEN_INLINE_LAMBDA { store_row(reduced + at, load_row(A + at) - share * W); };
  downdate(row_start(0), up.n.x);
  downdate(row_start(1), up.n.y);
  downdate(row_start(2), up.n.z);
  downdate(row_start(3), up.f.x);
  downdate(row_start(4), up.f.y);
  downdate(row_start(5), up.f.z);
}

/// Takes the joint of body i out of A, 36 numbers stored as a Mat6, and stores its gains. What is left for the parent to feel: of a free
/// joint nothing, of a ball joint that moves freely a force alone. Effects act on screws and ball joints.
template <JointKind Kind, class S, class Element, class Added>
LINDEN_INLINE void eliminate_joint(Joint<Kind>, const Tree& tree, const BodyConstants<Element>& constants, Index i, const S* A,
                                   const Gains<S>& gains, S* reduced, const Added& added) {
  const Index row = tree.first_v(i), block = tree.first_block(i);
  const S zero(0.0), one(1.0);
  if constexpr (Kind == JointKind::screw) {
    eliminate_screw(OneBody<S>{}, tree, constants, i, A, gains, reduced, added);
  } else if constexpr (Kind == JointKind::ball) {
    const auto M = Mat6<S>::from(A);
    std::array<S, 9> flat;
    M.aa.to(flat.data());
    if constexpr (Added::to_joints) {
      for (Index k = 0; k < 3; ++k) {
        S& d = flat[static_cast<std::size_t>(4 * k)];
        d = d + added.stiffness(row + k);
      }
    }
    invert<3>(flat);
    const auto inverse = Mat3<S>::from(flat.data());
    for (Index k = 0; k < 9; ++k) gains.inverse(block + k) = flat[static_cast<std::size_t>(k)];
    if constexpr (Added::to_joints) {
      const Mat3<S> up_n = M.aa * inverse, up_f = M.ba * inverse, down_w = inverse * M.aa, down_v = inverse * M.ab;
      const Mat3<S> n = transpose(up_n), f = transpose(up_f);
      store(gains.up, row, Wrench<S>{n.x, f.x});
      store(gains.up, row + 1, Wrench<S>{n.y, f.y});
      store(gains.up, row + 2, Wrench<S>{n.z, f.z});
      store(gains.down, row, Twist<S>{down_w.x, down_v.x});
      store(gains.down, row + 1, Twist<S>{down_w.y, down_v.y});
      store(gains.down, row + 2, Twist<S>{down_w.z, down_v.z});
      Mat6<S>{M.aa - up_n * M.aa, M.ab - up_n * M.ab, M.ba - up_f * M.aa, M.bb - up_f * M.ab}.to(reduced);
      return;
    }
    const Vec3<S> none{zero, zero, zero};
    const Mat3<S> up = M.ba * inverse, down = inverse * M.ab;
    const Mat3<S> columns = transpose(up);
    store(gains.up, row, Wrench<S>{{one, zero, zero}, columns.x});
    store(gains.up, row + 1, Wrench<S>{{zero, one, zero}, columns.y});
    store(gains.up, row + 2, Wrench<S>{{zero, zero, one}, columns.z});
    store(gains.down, row, Twist<S>{{one, zero, zero}, down.x});
    store(gains.down, row + 1, Twist<S>{{zero, one, zero}, down.y});
    store(gains.down, row + 2, Twist<S>{{zero, zero, one}, down.z});
    const Mat3<S> nothing{none, none, none};
    Mat6<S>{nothing, nothing, nothing, M.bb - up * M.ab}.to(reduced);
  } else {
    std::array<S, 36> inverse;
    for (int k = 0; k < 6; ++k) load_row(A + row_start(k)).to(&inverse[static_cast<std::size_t>(6 * k)]);
    invert<6>(inverse);
    for (Index k = 0; k < 36; ++k) gains.inverse(block + k) = inverse[static_cast<std::size_t>(k)];
    // The gains are the identity: filled in for completeness, so that no row of them is ever left unwritten.
    for (int k = 0; k < 6; ++k) {
      for (int c = 0; c < 6; ++c) gains.up(row + k, c) = gains.down(row + k, c) = k == c ? one : zero;
    }
    for (int k = 0; k < 36; ++k) reduced[k] = zero;
  }
}

/// Ad_{X^-1}^T A Ad_{X'^-1}: A given in the child's frame, in the parent's; poses may arrive through another placement X' than impulses
/// leave by. Rows first, in place, then columns: take(at, value) receives the 36 numbers, stored as a Mat6.
template <class S, class Take>
LINDEN_INLINE void to_parent(const Placement<S>& X, const Placement<S>& X_pose, S* A, const Take& take) {
  const auto row = [&](int at) LINDEN_INLINE_LAMBDA {
    const Twist<S> a = load_row(A + at);
    const Vec3<S> v = X_pose.R * a.v;
    store_row(A + at, Twist<S>{X_pose.R * a.w - cross(v, X_pose.p), v});
  };
  const auto column = [&](int at) LINDEN_INLINE_LAMBDA {
    const Wrench<S> a = to_parent(X, load_column(A + at));
    take(at, a.n.x);
    take(at + 3, a.n.y);
    take(at + 6, a.n.z);
    take(at + 18, a.f.x);
    take(at + 21, a.f.y);
    take(at + 24, a.f.z);
  };
  row(row_start(0));
  row(row_start(1));
  row(row_start(2));
  row(row_start(3));
  row(row_start(4));
  row(row_start(5));
  spill_here();
  column(column_start(0));
  column(column_start(1));
  column(column_start(2));
  column(column_start(3));
  column(column_start(4));
  column(column_start(5));
}

/// X M: the placement of the body after its joint has moved.
template <JointKind Kind, class S>
LINDEN_INLINE Placement<S> after_motion(Joint<Kind>, const Placement<S>& X, const Displacement<S>& M) {
  if constexpr (Kind == JointKind::screw) {
    // full angle from the half angle
    const S c = S(1.0) - S(2.0) * M.r.v.z * M.r.v.z, s = S(2.0) * M.r.v.z * M.r.w;
    const auto turn = [&](const Vec3<S>& r) LINDEN_INLINE_LAMBDA { return Vec3<S>{c * r.x + s * r.y, c * r.y - s * r.x, r.z}; };
    return {{turn(X.R.x), turn(X.R.y), turn(X.R.z)}, X.p + M.p.z * Vec3<S>{X.R.x.z, X.R.y.z, X.R.z.z}};
  } else {
    return {X.R * rotation(M.r), X.p + X.R * M.p};
  }
}

}  // namespace linden
