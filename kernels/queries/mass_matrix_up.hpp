// kernels/queries/mass_matrix_up.hpp
// The mass matrix by composite rigid bodies, leaves to root.
//
//   C_i = G_i + sum over children c of X_c C_c X_c^T         inertia of the subtree as one rigid body, in the frame of body i
//   M_ij = (Ad_{T_i^-1 T_j} S_j)^T C_i S_i                   for j above or at i; zero for bodies of which neither is above the other
//   A_i = Ad_{T_i^-1}^T C_i S_i                              momentum of the whole system by the velocity of joint i
//
// reads   inertia 10 x n, screw 2 x n, placement 12 x n, pose 12 x n
// writes  composite 10 x n (C), matrix nv x nv (M, symmetric) or 6 x nv (A), row by row [kg m^2, kg m, kg]
// cost    O(n d), d the depth of the tree, and nv^2 to clear the matrix; A O(n)
// source  Featherstone, Rigid Body Dynamics Algorithms, 6.2 (CRBA)
#pragma once

#include <algorithm>

#include "kernels/values/joints.hpp"

namespace linden {

/// An inertia given in the child's frame, in the parent's.
template <class S>
LINDEN_INLINE Inertia<S> to_parent(const Placement<S>& X, const Inertia<S>& G) {
  const Vec3<S> a = X.R * G.mc, &p = X.p;
  const Mat3<S> turned = times_transpose(X.R * G.rotational(), X.R);
  // of a place r + p instead of r: |r + p|^2 - |r|^2 on the diagonal, less the products of its components
  const S far = S(2.0) * dot(p, a) + G.m * dot(p, p);
  const Vec3<S> b = a + G.m * p;  // of the products p b^T + a p^T
  const auto more = [&](const S& pi, const S& ai, const S& pj, const S& bj) LINDEN_INLINE_LAMBDA { return pi * bj + ai * pj; };
  return {G.m,
          b,
          turned.x.x + far - more(p.x, a.x, p.x, b.x),
          turned.x.y - more(p.x, a.x, p.y, b.y),
          turned.x.z - more(p.x, a.x, p.z, b.z),
          turned.y.y + far - more(p.y, a.y, p.y, b.y),
          turned.y.z - more(p.y, a.y, p.z, b.z),
          turned.z.z + far - more(p.z, a.z, p.z, b.z)};
}

template <class S>
LINDEN_INLINE Inertia<S> operator+(const Inertia<S>& a, const Inertia<S>& b) {
  return {a.m + b.m,   a.mc + b.mc, a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}

template <class S>
LINDEN_INLINE void store(Field<S, 10>& field, Index i, const Inertia<S>& G) {
  S* const row = field.row(i);
  row[0] = G.m;
  G.mc.to(row + 1);
  const S rest[6] = {G.xx, G.xy, G.xz, G.yy, G.yz, G.zz};
  std::copy(rest, rest + 6, row + 4);
}

/// Column k of S_i.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Twist<S> joint_column(Joint<Kind> joint, const BodyConstants<Element>& constants, Index i, Index k) {
  S unit[6] = {S(0.0), S(0.0), S(0.0), S(0.0), S(0.0), S(0.0)};
  unit[k] = S(1.0);
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  return add_motion(joint, constants, i, Wrench<S>::from(unit), Twist<S>{zero, zero});
}

/// Numbers of column `column` in the rows of body j, and of the row in its columns: S_j^T F.
template <class S, class Element>
void put_products(const Tree& tree, const BodyConstants<Element>& constants, Index j, Index column, const Wrench<S>& F, S* matrix) {
  const Index nv = tree.shape.velocities, row = tree.first_v(j);
  with_joint(tree.kind(j), [&](auto joint) {
    S numbers[6];
    project(joint, constants, j, F).to(numbers);
    for (Index k = 0; k < velocity_count(joint); ++k) matrix[(row + k) * nv + column] = matrix[column * nv + row + k] = numbers[k];
  });
}

/// C of every body.
template <class S, class Element>
void composite_inertia_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                          Field<S, 10>& composite) {
  for (Index i = 0; i < tree.shape.slots; ++i) store(composite, i, load<Inertia, S>(constants.inertia, i));
  for (Index i = tree.shape.slots - 1; i > 0; --i) {
    const Index parent = tree.parent(i);
    if (parent == 0) continue;
    const auto passed = to_parent(load<Placement, S>(placement, i), load<Inertia, S>(composite, i));
    store(composite, parent, load<Inertia, S>(composite, parent) + passed);
  }
}

template <class S, class Element>
void mass_matrix_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, Field<S, 10>& composite,
                    S* matrix) {
  const auto nv = static_cast<std::size_t>(tree.shape.velocities);
  std::fill(matrix, matrix + nv * nv, S(0.0));
  composite_inertia_up(tree, constants, placement, composite);
  up(tree, [&](auto joint, Index i) {
    const auto C = load<Inertia, S>(composite, i);
    for (Index k = 0; k < velocity_count(joint); ++k) {
      Wrench<S> F = C * joint_column<joint.value, S>(joint, constants, i, k);
      for (Index j = i; j != 0; j = tree.parent(j)) {
        put_products(tree, constants, j, tree.first_v(i) + k, F, matrix);
        F = to_parent(load<Placement, S>(placement, j), F);
      }
    }
  });
}

/// Rows of the momentum of the whole system, 6 x nv: angular about the world's origin, linear; world frame. Times v it is the momentum.
template <class S, class Element>
void momentum_matrix_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& pose, const Field<S, 10>& composite,
                         S* matrix) {
  const Index nv = tree.shape.velocities;
  up(tree, [&](auto joint, Index i) {
    const auto C = load<Inertia, S>(composite, i);
    const auto T = load<Placement, S>(pose, i);
    for (Index k = 0; k < velocity_count(joint); ++k) {
      S column[6];
      to_parent(T, C * joint_column<joint.value, S>(joint, constants, i, k)).to(column);
      for (Index row = 0; row < 6; ++row) matrix[row * nv + tree.first_v(i) + k] = column[row];
    }
  });
}

}  // namespace linden
