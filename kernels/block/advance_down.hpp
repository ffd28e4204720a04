// kernels/block/advance_down.hpp
// The end of a step in two sweeps, for a block of instances: lane = instance.
//
//   advance_down     q_i <- q_i (+) M_i in the lanes that move;  X_i at the new q;  g_i = R_i^T g_parent
//   momentum_up      c_parent += X_i c_i;  Q_i;  p_i <- (S_i^T Ad_{dT_i}^T E_i - C u_i) / h + h/2 (Q_i + applied_i) in the lanes that move
//
// With no lane that moves the two bring placements and forces to the positions as they are, by the same instructions.
// advance_map, placement_map, gravity.hpp and momentum_update_map, fused; E and u for F and r, see innovation_up.
//
// reads   screw 2 x n, tree_placement 12 x n, inertia 10 x n, subtree_mass n, motion, displacement, impulse (E), innovation (u), delta,
//         applied nv (forces given from outside; nullptr: none)
// writes  q nq, placement 12 x n, field 3 x n;  first_moment 3 x n, force nv (Q + applied), p nv
// returns momentum_up: potential energy of gravity [J]
#pragma once

#include "kernels/block/evaluate_down.hpp"
#include "kernels/tree/advance_map.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/placement_map.hpp"

namespace linden {

template <bool kGravity, class S, class Mask, class Element>
[[gnu::noinline]] void advance_down(const Tree& tree, const BodyConstants<Element>& constants, const Vec3<S>& gravity, const Mask& moves,
                                    Workspace<S>& work, Field<S>& q) {
  if constexpr (kGravity) store(work.field, 0, gravity);
  down(tree, [&](auto joint, Index i) {
    const Index row = tree.first_q(i);
    constexpr Index n = position_count(joint);
    S before[n];
    for (Index k = 0; k < n; ++k) before[k] = q(row + k);
    advance(joint, row, work.delta(tree.first_v(i)), load_motion(joint, work.motion, i), q);
    for (Index k = 0; k < n; ++k) q(row + k) = select(moves, q(row + k), before[k]);
    const Placement<S> X = placed(joint, constants, i, row, q);
    store(work.placement, i, X);
    if constexpr (kGravity) store(work.field, i, transpose_times(X.R, load<Vec3, S>(work.field, tree.parent(i))));
  });
}

template <bool kGravity, class S, class Mask, class Element>
[[gnu::noinline]] S momentum_up(const Tree& tree, const BodyConstants<Element>& constants, const S& h, const Mask& moves,
                                const Field<S>* applied, Workspace<S>& work, Field<S>& p) {
  const S half = S(0.5) * h;
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  if constexpr (kGravity) {
    for (Index i = 0; i < tree.shape.slots; ++i) store(work.first_moment, i, zero);
  }
  up(tree, [&](auto joint, Index i) {
    const Index row = tree.first_v(i), parent = tree.parent(i);
    Wrench<S> force{zero, zero};
    if constexpr (kGravity) {
      const auto own = load<Inertia, S>(constants.inertia, i).mc;
      const Vec3<S> c = load<Vec3, S>(work.first_moment, i) + own;
      const auto g = load<Vec3, S>(work.field, i);
      const S mass = as<S>(constants.subtree_mass(i));
      force = project(joint, constants, i, Wrench<S>{cross(c, g), mass * g});
      const auto X = load<Placement, S>(work.placement, i);
      store(work.first_moment, parent, load<Vec3, S>(work.first_moment, parent) + X.R * c + mass * X.p);
    }
    if (applied != nullptr) force = force + load_joint(joint, *applied, row);
    store_joint(joint, work.force, row, force);

    const auto D = load<Displacement, S>(work.displacement, i);
    const Wrench<S> now = project(joint, constants, i, carried(D, load<Wrench, S>(work.impulse, i)));
    const Wrench<S> left = load_joint(joint, work.innovation, row);
    const auto update = [&](Index at, const S& value) { p(at) = select(moves, value, p(at)); };
    if constexpr (joint == JointKind::screw) {
      update(row, (now.n.x - left.n.x) / h + half * force.n.x);
    } else {
      const Wrench<S> kept = (now - carried(D, left)) / h + half * force;
      update(row, kept.n.x);
      update(row + 1, kept.n.y);
      update(row + 2, kept.n.z);
      if constexpr (joint == JointKind::free) {
        update(row + 3, kept.f.x);
        update(row + 4, kept.f.y);
        update(row + 5, kept.f.z);
      }
    }
  });
  if constexpr (kGravity) return -dot(load<Vec3, S>(work.field, 0), load<Vec3, S>(work.first_moment, 0));
  return S(0.0);
}

}  // namespace linden
