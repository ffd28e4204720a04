// kernels/block/mass_solve_up.hpp
// Factor of the mass matrix M(q) and the first half of a solve with it, in one sweep for a block of instances: lane = instance. With
// rate_down it gives the velocity that a momentum stands for.
//
//   A_i = G_i + sum over children c of Ad_{X_c^-1}^T (A_c - g_c d_c g_c^T) Ad_{X_c^-1},   d = S^T A S,  g = A S d^-1
//   u_i = r_i - S_i^T b_i,    b_parent += Ad_{X_i^-1}^T (b_i + g_i u_i)
//
// articulated_inertia_up and impulse_pass_up, fused, with A as the symmetric matrix that it is: 21 numbers instead of 36, and one gain for
// both ways. A body and block take 117 ns instead of 191 (eight lanes, AVX-512).
//
// reads   inertia 10 x n, screw 2 x n, placement 12 x n, residual nv (r)
// writes  gain 6 x nv (g: for rate_down), joint_inverse (d^-1), innovation nv (u); articulated (its first 21 numbers) and bias 6 x n (b) of
//         bodies that have children are scratch
// cost    one pass, one division a screw
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.3 (ABI), pass 2 with it
#pragma once

#include "kernels/tree/impulse_pass_up.hpp"

namespace linden {

/// A symmetric 3 x 3 matrix.
template <class S>
struct Symmetric3 {
  S xx, xy, xz, yy, yz, zz;

  LINDEN_INLINE static Symmetric3 from(const S* row) { return {row[0], row[1], row[2], row[3], row[4], row[5]}; }
  LINDEN_INLINE Mat3<S> whole() const { return {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}; }
  /// Of a b^T that is known to be symmetric.
  LINDEN_INLINE static Symmetric3 product(const Vec3<S>& a, const Vec3<S>& b) {
    return {a.x * b.x, a.x * b.y, a.x * b.z, a.y * b.y, a.y * b.z, a.z * b.z};
  }
  LINDEN_INLINE static Symmetric3 part_of(const Mat3<S>& a) { return {a.x.x, a.x.y, a.x.z, a.y.y, a.y.z, a.z.z}; }
  LINDEN_INLINE friend Symmetric3 operator+(const Symmetric3& a, const Symmetric3& b) {
    return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
  }
  LINDEN_INLINE friend Symmetric3 operator-(const Symmetric3& a, const Symmetric3& b) {
    return {a.xx - b.xx, a.xy - b.xy, a.xz - b.xz, a.yy - b.yy, a.yz - b.yz, a.zz - b.zz};
  }
  template <class Take>
  LINDEN_INLINE void give(int at, const Take& take) const {
    take(at, xx);
    take(at + 1, xy);
    take(at + 2, xz);
    take(at + 3, yy);
    take(at + 4, yz);
    take(at + 5, zz);
  }
};

/// R A R^T
template <class S>
LINDEN_INLINE Symmetric3<S> turned(const Mat3<S>& R, const Symmetric3<S>& A) {
  const Mat3<S> T = R * A.whole();
  return {dot(T.x, R.x), dot(T.x, R.y), dot(T.x, R.z), dot(T.y, R.y), dot(T.y, R.z), dot(T.z, R.z)};
}

/// Twist -> wrench: n = J w + H v, f = H^T w + M v. In memory J, H, M: 21 numbers.
template <class S>
struct SymmetricInertia {
  Symmetric3<S> J;
  Mat3<S> H;
  Symmetric3<S> M;

  LINDEN_INLINE static SymmetricInertia from(const S* row) {
    return {Symmetric3<S>::from(row), Mat3<S>::from(row + 6), Symmetric3<S>::from(row + 15)};
  }
  LINDEN_INLINE friend SymmetricInertia operator+(const SymmetricInertia& a, const SymmetricInertia& b) {
    return {a.J + b.J, a.H + b.H, a.M + b.M};
  }
};

/// Ad_{X^-1}^T A Ad_{X^-1}: with p the shift and all turned into the parent's directions, M stays, H becomes N = H + [p] M, and J becomes
/// J + [p] N^T + ([p] H^T)^T. take(at, value) receives the 21 numbers.
template <class S, class Take>
LINDEN_INLINE void to_parent(const Placement<S>& X, const SymmetricInertia<S>& A, const Take& take) {
  const Vec3<S>& p = X.p;
  const Symmetric3<S> M = turned(X.R, A.M);
  M.give(15, take);
  const Mat3<S> H = times_transpose(X.R * A.H, X.R);
  const Vec3<S> x{M.xx, M.xy, M.xz}, y{M.xy, M.yy, M.yz}, z{M.xz, M.yz, M.zz};
  const Mat3<S> N{H.x + p.y * z - p.z * y, H.y + p.z * x - p.x * z, H.z + p.x * y - p.y * x};
  const auto give = [&](int at, const Vec3<S>& row) LINDEN_INLINE_LAMBDA {
    take(at, row.x);
    take(at + 1, row.y);
    take(at + 2, row.z);
  };
  give(6, N.x);
  give(9, N.y);
  give(12, N.z);
  const Symmetric3<S> J = turned(X.R, A.J);
  const Vec3<S> hx = cross(p, H.x), hy = cross(p, H.y), hz = cross(p, H.z);
  const Vec3<S> nx = cross(p, N.x), ny = cross(p, N.y), nz = cross(p, N.z);
  const Symmetric3<S> moved{J.xx + nx.x + hx.x, J.xy + ny.x + hx.y, J.xz + nz.x + hx.z,
                            J.yy + ny.y + hy.y, J.yz + nz.y + hy.z, J.zz + nz.z + hz.z};
  moved.give(0, take);
}

/// Takes the joint of body i out of A and stores its gain; what is left for the parent to feel.
template <JointKind Kind, class S, class Element, class Added>
LINDEN_INLINE SymmetricInertia<S> eliminate_symmetric(Joint<Kind>, const Tree& tree, const BodyConstants<Element>& constants, Index i,
                                                      const SymmetricInertia<S>& A, Field<S, 6>& gain, Field<S>& inverse,
                                                      const Added& added) {
  const Index row = tree.first_v(i), block = tree.first_block(i);
  const S zero(0.0), one(1.0);
  const Vec3<S> none{zero, zero, zero};
  if constexpr (Kind == JointKind::screw) {
    const auto screw = load<Screw, S>(constants.screw, i);
    const Wrench<S> U{screw.r * Vec3<S>{A.J.xz, A.J.yz, A.J.zz} + screw.t * Vec3<S>{A.H.x.z, A.H.y.z, A.H.z.z},
                      screw.r * A.H.z + screw.t * Vec3<S>{A.M.xz, A.M.yz, A.M.zz}};
    S d = screw.r * U.n.z + screw.t * U.f.z;
    if constexpr (Added::to_joints) d = d + added.stiffness(row);
    const S of_one = one / d;
    const Wrench<S> g = of_one * U;
    store(gain, row, g);
    inverse(block) = of_one;
    return {A.J - Symmetric3<S>::product(g.n, U.n),
            {A.H.x - g.n.x * U.f, A.H.y - g.n.y * U.f, A.H.z - g.n.z * U.f},
            A.M - Symmetric3<S>::product(g.f, U.f)};
  } else if constexpr (Kind == JointKind::ball) {
    const Mat3<S> J = A.J.whole();
    std::array<S, 9> flat;
    J.to(flat.data());
    if constexpr (Added::to_joints) {
      for (Index k = 0; k < 3; ++k) {
        S& d = flat[static_cast<std::size_t>(4 * k)];
        d = d + added.stiffness(row + k);
      }
    }
    invert<3>(flat);
    for (Index k = 0; k < 9; ++k) inverse(block + k) = flat[static_cast<std::size_t>(k)];
    const auto D = Mat3<S>::from(flat.data());
    const Mat3<S> force = D * A.H;  // its rows are the forces of the gains
    if constexpr (Added::to_joints) {
      const Mat3<S> moment = D * J;
      store(gain, row, Wrench<S>{moment.x, force.x});
      store(gain, row + 1, Wrench<S>{moment.y, force.y});
      store(gain, row + 2, Wrench<S>{moment.z, force.z});
      return {A.J - Symmetric3<S>::part_of(J * moment), A.H - J * force, A.M - Symmetric3<S>::part_of(transpose(A.H) * force)};
    }
    store(gain, row, Wrench<S>{{one, zero, zero}, force.x});
    store(gain, row + 1, Wrench<S>{{zero, one, zero}, force.y});
    store(gain, row + 2, Wrench<S>{{zero, zero, one}, force.z});
    return {{zero, zero, zero, zero, zero, zero}, {none, none, none}, A.M - Symmetric3<S>::part_of(transpose(A.H) * force)};
  } else {
    const Mat3<S> J = A.J.whole(), turned_over = transpose(A.H), M = A.M.whole();
    std::array<S, 36> whole;
    const auto put = [&](std::size_t at, const Mat3<S>& part) LINDEN_INLINE_LAMBDA {
      part.x.to(&whole[at]);
      part.y.to(&whole[at + 6]);
      part.z.to(&whole[at + 12]);
    };
    put(0, J);
    put(3, A.H);
    put(18, turned_over);
    put(21, M);
    invert<6>(whole);
    for (Index k = 0; k < 36; ++k) inverse(block + k) = whole[static_cast<std::size_t>(k)];
    // the gains are the identity: filled in for completeness, so that no row of them is ever left unwritten
    for (int k = 0; k < 6; ++k) {
      for (int c = 0; c < 6; ++c) gain(row + k, c) = k == c ? one : zero;
    }
    return {{zero, zero, zero, zero, zero, zero}, {none, none, none}, {zero, zero, zero, zero, zero, zero}};
  }
}

template <class S, class Element, int Room, class Added = NothingAdded>
void mass_solve_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Field<S>& residual,
                   Field<S, Room>& articulated, Field<S, 6>& gain, Field<S>& inverse, Field<S, 6>& bias, Field<S>& innovation,
                   const Added& added = {}) {
  static_assert(Room >= 21 && !Added::to_bodies);
  const S zero(0.0);
  const Vec3<S> none{zero, zero, zero};
  up(tree, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const Index row = tree.first_v(i), parent = tree.parent(i);
    const auto G = load<Inertia, S>(constants.inertia, i);
    SymmetricInertia<S> A{{G.xx, G.xy, G.xz, G.yy, G.yz, G.zz}, hat(G.mc), {G.m, zero, zero, G.m, zero, G.m}};
    Wrench<S> b{none, none};
    if (tree.is_leaf(i) == 0) {
      A = A + SymmetricInertia<S>::from(articulated.row(i));
      b = load<Wrench, S>(bias, i);
    }
    const SymmetricInertia<S> left = eliminate_symmetric(joint, tree, constants, i, A, gain, inverse, added);
    const Wrench<S> u = load_joint(joint, residual, row) - project(joint, constants, i, b);
    store_joint(joint, innovation, row, u);
    if (parent == 0) return;  // of the world nothing is asked
    const auto X = load<Placement, S>(placement, i);
    S norm(0.0);
    const Wrench<S> passed = to_parent(X, bias_to_parent(joint, tree, Gains<S>{gain, gain, inverse}, i, b, u, norm));
    S* const above = articulated.row(parent);
    if (tree.is_last_child(i) != 0) {
      store(bias, parent, passed);
      to_parent(X, left, [&](int at, const S& value) LINDEN_INLINE_LAMBDA { above[at] = value; });
    } else {
      store(bias, parent, load<Wrench, S>(bias, parent) + passed);
      to_parent(X, left, [&](int at, const S& value) LINDEN_INLINE_LAMBDA { above[at] = above[at] + value; });
    }
  });
}

}  // namespace linden
