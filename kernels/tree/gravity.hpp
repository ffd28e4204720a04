// kernels/tree/gravity.hpp
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

#include "kernels/values/joints.hpp"

namespace linden {

template <class S>
void gravity_field_down(const Tree& tree, const Field<S, 12>& placement, const Vec3<S>& gravity, Slots slots, Field<S, 3>& field) {
  if (slots.begin == 1) store(field, 0, gravity);
  auto g = load<Vec3, S>(field, slots.row_of_parent(slots.begin - 1));  // at the body before, often the parent
  for (Index i = slots.begin; i < slots.end; ++i) {
    const Index parent = tree.parent(i);
    if (parent != i - 1) g = load<Vec3, S>(field, slots.row_of_parent(parent));
    g = transpose_times(load<Placement, S>(placement, slots.row(i)).R, g);
    store(field, slots.row(i), g);
  }
}

template <class S>
void gravity_field_down(const Tree& tree, const Field<S, 12>& placement, const Vec3<S>& gravity, Field<S, 3>& field) {
  gravity_field_down(tree, placement, gravity, all_slots(tree), field);
}

template <class S>
S gravity_potential(const Field<S, 3>& field, const Field<S, 3>& first_moment) {
  return -dot(load<Vec3, S>(field, 0), load<Vec3, S>(first_moment, 0));
}

/// slots: all, or parts of a large tree as for innovation_up. EachMoment: first_moment of every body, else of those it waits for there.
template <bool EachMoment = false, class S, class Element>
void gravity_force_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                      const Field<S, 3>& field, Slots slots, Field<S, 3>& first_moment, Field<S>& force) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  const auto left_for = [&](Index i) LINDEN_INLINE_LAMBDA { return tree.is_leaf(i) != 0 ? zero : load<Vec3, S>(first_moment, slots.row(i)); };
  if (slots.begin == slots.end) return;
  Vec3<S> pending = left_for(slots.end - 1);  // what the children of the body that comes next pass to it
  up(tree, slots, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const Vec3<S> own{as<S>(constants.inertia(i, 1)), as<S>(constants.inertia(i, 2)), as<S>(constants.inertia(i, 3))};
    const Vec3<S> c = own + pending;
    if constexpr (EachMoment) store(first_moment, slots.row(i), c);
    const auto g = load<Vec3, S>(field, slots.row(i));
    const S mass = as<S>(constants.subtree_mass(i));
    store_joint(joint, force, tree.first_v(i), project(joint, constants, i, Wrench<S>{cross(c, g), mass * g}));
    const auto X = load<Placement, S>(placement, slots.row(i));
    const Vec3<S> passed = X.R * c + mass * X.p;
    // a parent that comes next and has no other child takes it from the registers
    const Index parent = tree.parent(i);
    const bool first = tree.is_last_child(i) != 0;
    if (parent == i - 1 && first && i > slots.begin) {
      pending = passed;
      return;
    }
    const Index row = slots.row_of_parent(parent);
    store(first_moment, row, first ? passed : load<Vec3, S>(first_moment, row) + passed);
    if (i > slots.begin) pending = left_for(i - 1);
  });
}

template <class S, class Element>
S gravity_force_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                   const Field<S, 3>& field, Field<S, 3>& first_moment, Field<S>& force) {
  gravity_force_up<true>(tree, constants, placement, field, all_slots(tree), first_moment, force);
  return gravity_potential(field, first_moment);
}

}  // namespace linden
