// kernels/tree/increment_down.hpp
// Second half of a solve with a factored matrix: joints yield to the impulses and to the motion of their parents, root to leaves.
//
//   xi_i = Ad_{M_i^-1} Ad_{X_i^-1} eta_parent,   Delta_i = d_i^-1 u_i - gain_down_i^T xi_i,   eta_i = xi_i + S_i Delta_i
//
//   increment_down  with the motions M of the step: Newton's correction of the displacement
//   rate_down       M = 1: applies M(q)^-1, the velocity of a momentum or RIQN's correction
//
// reads   screw 2 x n, placement 12 x n, (motion 7 x n,) gains, innovation nv (u)
// writes  variation 6 x n (eta), increment nv (Delta)
// slots   [begin, end) in order, begin = 1 first; of parts only what is read again is written: not the eta of a body whose only child
//         comes next, which takes it from the registers
// cost    one pass; screws of one level fill the lanes where there are enough of them
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.3, pass 3, for impulses
#pragma once

#include "kernels/tree/impulse_pass_up.hpp"
#include "kernels/values/body_lanes.hpp"

namespace linden {

/// Delta of joint i, where xi is how its body's pose would change if it did not yield.
template <JointKind Kind, class S>
LINDEN_INLINE Wrench<S> joint_increment(Joint<Kind> joint, const Tree& tree, const Gains<S>& gains, Index i, const Wrench<S>& u,
                                        const Twist<S>& xi) {
  const Index row = tree.first_v(i);
  Wrench<S> delta = apply_inverse(joint, gains.inverse, tree.first_block(i), u);
  const auto along = [&](Index k) {
    const auto gain = load<Twist, S>(gains.down, row + k);
    return dot(gain.w, xi.w) + dot(gain.v, xi.v);
  };
  if constexpr (Kind == JointKind::screw) {
    delta.n.x = delta.n.x - along(0);
  } else if constexpr (Kind == JointKind::ball) {
    delta.n = delta.n - Vec3<S>{along(0), along(1), along(2)};
  } else {
    delta = delta - Wrench<S>{xi.w, xi.v};
  }
  return delta;
}

template <bool EachEta, class S, class PlacementOf, class Element>
void yield_down(const Tree& tree, const BodyConstants<Element>& constants, const PlacementOf& placement_of, const Gains<S>& gains,
                const Field<S>& innovation, Slots slots, Field<S, 6>& variation, Field<S>& increment) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  if (slots.begin == 1) store(variation, 0, Twist<S>{zero, zero});
  const auto one_by_one = [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    auto eta = load<Twist, S>(variation, slots.row_of_parent(part.begin - 1));  // of the body before, often the parent
    for (Index i = part.begin; i < part.end; ++i) {
      const Index row = tree.first_v(i), parent = tree.parent(i);
      if (parent != i - 1) eta = load<Twist, S>(variation, slots.row_of_parent(parent));
      const Twist<S> xi = to_child(placement_of(joint, OneBody<S>{}, i), eta);
      const Wrench<S> delta = joint_increment(joint, tree, gains, i, load_joint(joint, innovation, row), xi);
      store_joint(joint, increment, row, delta);
      eta = add_motion(joint, constants, i, delta, xi);
      const bool handed_on = !EachEta && i + 1 < part.end && tree.parent(i + 1) == i && tree.is_last_child(i + 1) != 0;
      if (!handed_on) store(variation, slots.row(i), eta);
    }
  };
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw && std::is_same_v<S, double>) {
      const auto many = [&](auto bodies, Index i) LINDEN_INLINE_LAMBDA {
        const Index row = tree.first_v(i);
        const auto above = gather_at<Twist>(bodies, variation, rows_of_parents(tree, slots, i).data());
        const auto xi = to_child(placement_of(joint, bodies, i), above);
        const auto gain = gather<Twist>(bodies, gains.down, row);
        const auto delta = gather_row(bodies, gains.inverse, tree.first_block(i)) * gather_row(bodies, innovation, row) -
                           (dot(gain.w, xi.w) + dot(gain.v, xi.v));
        scatter_row(bodies, increment, row, delta);
        const auto screw = gather<Screw>(bodies, constants.screw, i);
        auto next = xi;
        next.w.z = xi.w.z + screw.r * delta;
        next.v.z = xi.v.z + screw.t * delta;
        scatter(bodies, variation, slots.row(i), next);
      };
      for_same_level_down(tree, part, many, [&](Slots few) LINDEN_INLINE_LAMBDA { one_by_one(joint, few); });
    } else {
      one_by_one(joint, part);
    }
  });
}

template <bool EachEta = false, class S, class Element>
void increment_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                    const Field<S, 7>& motion, const Gains<S>& gains, const Field<S>& innovation, Slots slots,
                    Field<S, 6>& variation, Field<S>& increment) {
  const auto placement_of = [&](auto joint, auto bodies, Index i) LINDEN_INLINE_LAMBDA {
    return after_motion(joint, gather<Placement>(bodies, placement, slots.row(i)), gather<Displacement>(bodies, motion, slots.row(i)));
  };
  yield_down<EachEta>(tree, constants, placement_of, gains, innovation, slots, variation, increment);
}

template <class S, class Element>
void increment_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                    const Field<S, 7>& motion, const Gains<S>& gains, const Field<S>& innovation, Field<S, 6>& variation,
                    Field<S>& increment) {
  increment_down<true>(tree, constants, placement, motion, gains, innovation, all_slots(tree), variation, increment);
}

template <class S, class Element>
void rate_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains,
               const Field<S>& innovation, Slots slots, Field<S, 6>& variation, Field<S>& rate) {
  const auto placement_of = [&](auto, auto bodies, Index i) LINDEN_INLINE_LAMBDA { return gather<Placement>(bodies, placement, i); };
  yield_down<true>(tree, constants, placement_of, gains, innovation, slots, variation, rate);
}

template <class S, class Element>
void rate_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains,
               const Field<S>& innovation, Field<S, 6>& variation, Field<S>& rate) {
  rate_down(tree, constants, placement, gains, innovation, all_slots(tree), variation, rate);
}

}  // namespace linden
