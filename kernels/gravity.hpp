// kernels/gravity.hpp
// Generalized force and potential of a constant field.
//
//   gravity_field_down  g_i = R_i^T g_lambda(i),  g_0 given
//   gravity_force_up    c_i = m c of the subtree of i;  Q_i = S_i^T (c_i x g_i, m_subtree g_i)
//
// The subtree's mass is a constant and its first moment takes one rotation, so gravity needs no wrench of its own.
//
// reads   placement 12 x n, inertia 10 x n, subtree_mass n, gravity [m/s^2] in the world's frame
// writes  field 3 x n, first_moment 3 x n, force nv [N m, N] (overwritten)
// returns the potential energy -g.c_0 [J], zero where the centre of mass is at the height of the world's origin
// cost    two light passes
// source  Featherstone, Rigid Body Dynamics Algorithms, 5.3, for gravity alone
#pragma once

#include "kernels/joints.hpp"

namespace linden {

template <class S>
void gravity_field_down(const Tree& tree, const Field<S, 12>& placement, const Vec3<S>& gravity, Field<S, 3>& field) {
  store(field, 0, gravity);
  for (Index i = 1; i < tree.shape.slots; ++i) {
    store(field, i, transpose_times(load<Placement, S>(placement, i).R, load<Vec3, S>(field, tree.parent(i))));
  }
}

template <class S, class Element>
S gravity_force_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                   const Field<S, 3>& field, Field<S, 3>& first_moment, Field<S>& force) {
  store(first_moment, 0, Vec3<S>{S(0.0), S(0.0), S(0.0)});
  for (Index i = 1; i < tree.shape.slots; ++i) {
    store(first_moment, i, Vec3<S>{as<S>(constants.inertia(i, 1)), as<S>(constants.inertia(i, 2)), as<S>(constants.inertia(i, 3))});
  }
  up(tree, [&](auto joint, Index i) {
    const auto c = load<Vec3, S>(first_moment, i);
    const auto g = load<Vec3, S>(field, i);
    const S mass = as<S>(constants.subtree_mass(i));
    store_joint(joint, force, tree.first_v(i), project(joint, constants, i, Wrench<S>{cross(c, g), mass * g}));
    const auto X = load<Placement, S>(placement, i);
    const Index parent = tree.parent(i);
    store(first_moment, parent, load<Vec3, S>(first_moment, parent) + X.R * c + mass * X.p);
  });
  return -dot(load<Vec3, S>(field, 0), load<Vec3, S>(first_moment, 0));
}

}  // namespace linden
