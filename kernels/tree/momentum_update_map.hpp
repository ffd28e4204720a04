// kernels/tree/momentum_update_map.hpp
// Momentum at the ends of a step.
//
//   momentum_target_map  h (p^k + h/2 Q^k)                                   what h mu must sum up to
//   momentum_update_map  p^k+1 = (S^T Ad_{dT_i}^T h F_i - C h r) / h + h/2 Q^k+1,    C = Ad_{dT}^T on the joint's rows
//   momentum_at_end_map    h (p^k+1 - h/2 Q^k+1), while F and dT are at hand; momentum_end_map: the rest
//
// The momentum of body j seen from the end of the step, nu_j = Ad_{exp(hV_j)}^T mu_j = dlog_{-hV_j}^T G_j V_j, is the same wrench in
// space as mu_j; so is its sum over a subtree, and F_i of the last evaluation has only to be seen from where body i is now. No second
// sweep over the tree is needed for the new momenta.
//
// C r hands what the solver left of the residual on to the next step instead of dropping it. To first order that is one more
// correction of p, and the momentum of a tree that nothing holds is carried over exactly, whatever the tolerance. Measured on the
// tumbling humanoid over 1,000 steps: the relative drift of angular momentum at tolerance 1e-6 falls from 5e-6 to 3e-14, at the default
// 1e-10 from 7e-10 to 6e-14.
//
// What target_map multiplies by h is divided by h again: times 1 / h it would be times 1 + 2e-17 at 1 ms, and the same each step, so
// that momenta would grow with the number of steps and not with its root (2e-11 after a million).
//
// reads   screw 2 x n, displacement 7 x n, impulse 6 x n (h F of the residual), residual nv (h r), force nv (Q), momentum p nv
// writes  momentum_target nv; momentum p nv [kg m^2/s, kg m/s]
#pragma once

#include "kernels/values/body_lanes.hpp"
#include "kernels/values/joints.hpp"

namespace linden {

template <class S>
void momentum_target_map(const Tree& tree, const S& h, const Field<S>& momentum, const Field<S>& force, Slots slots, Field<S>& target) {
  const Slots rows = velocities(tree, slots);
  for (Index row = rows.begin; row < rows.end; ++row) {
    target(row) = h * (momentum(row) + (S(0.5) * h) * force(row));
  }
}

template <class S>
void momentum_target_map(const Tree& tree, const S& h, const Field<S>& momentum, const Field<S>& force, Field<S>& target) {
  momentum_target_map(tree, h, momentum, force, all_slots(tree), target);
}

template <class S, class Element>
void momentum_at_end_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 7>& displacement,
                       const Field<S, 6>& impulse, const Field<S>& residual, Slots slots, Field<S>& seen) {
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw) {
      const Index shift = tree.first_v(part.begin) - part.begin;
      for_bodies<S>(part.begin, part.end, [&](auto bodies, Index i) {
        const auto F = carried(gather<Displacement>(bodies, displacement, slots.row(i)), gather<Wrench>(bodies, impulse, slots.row(i)));
        const auto screw = gather<Screw>(bodies, constants.screw, i);
        scatter_row(bodies, seen, i + shift, screw.r * F.n.z + screw.t * F.f.z - gather_row(bodies, residual, i + shift));
      });
    } else {
      for (Index i = part.begin; i < part.end; ++i) {
        const Index row = tree.first_v(i);
        const auto D = load<Displacement, S>(displacement, slots.row(i));
        store_joint(joint, seen, row, carried(D, load<Wrench, S>(impulse, slots.row(i)) - load_joint(joint, residual, row)));
      }
    }
  });
}

template <class S>
void momentum_end_map(const Tree& tree, const S& h, const Field<S>& seen, const Field<S>& force, Slots slots, Field<S>& momentum) {
  const Slots rows = velocities(tree, slots);
  for (Index row = rows.begin; row < rows.end; ++row) momentum(row) = seen(row) / h + (S(0.5) * h) * force(row);
}

template <class S, class Element>
void momentum_update_map(const Tree& tree, const BodyConstants<Element>& constants, const S& h, const Field<S, 7>& displacement,
                         const Field<S, 6>& impulse, const Field<S>& residual, const Field<S>& force, Slots slots, Field<S>& momentum) {
  const S half = S(0.5) * h;
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw) {
      const Index shift = tree.first_v(part.begin) - part.begin;
      for_bodies<S>(part.begin, part.end, [&](auto bodies, Index i) {
        using B = typename decltype(bodies)::Scalar;
        const Wrench<B> F = carried(gather<Displacement>(bodies, displacement, i), gather<Wrench>(bodies, impulse, i));
        const auto screw = gather<Screw>(bodies, constants.screw, i);
        const B now = screw.r * F.n.z + screw.t * F.f.z;
        scatter_row(bodies, momentum, i + shift, (now - gather_row(bodies, residual, i + shift)) / as<B>(h) +
                                                as<B>(half) * gather_row(bodies, force, i + shift));
      });
    } else {
      for (Index i = part.begin; i < part.end; ++i) {
        const Index row = tree.first_v(i);
        const auto D = load<Displacement, S>(displacement, i);
        const Wrench<S> now = carried(D, load<Wrench, S>(impulse, i)), left = carried(D, load_joint(joint, residual, row));
        store_joint(joint, momentum, row, (now - left) / h + half * load_joint(joint, force, row));
      }
    }
  });
}

template <class S, class Element>
void momentum_update_map(const Tree& tree, const BodyConstants<Element>& constants, const S& h, const Field<S, 7>& displacement,
                         const Field<S, 6>& impulse, const Field<S>& residual, const Field<S>& force, Field<S>& momentum) {
  momentum_update_map(tree, constants, h, displacement, impulse, residual, force, all_slots(tree), momentum);
}

}  // namespace linden
