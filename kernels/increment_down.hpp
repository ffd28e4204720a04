// kernels/increment_down.hpp
// Second half of a solve with a factored matrix: joints yield to the impulses and to the motion of their parents, root to leaves.
//
//   xi_i = Ad_{M_i^-1} Ad_{X_i^-1} eta_parent,   Delta_i = d_i^-1 u_i - gain_down_i^T xi_i,   eta_i = xi_i + S_i Delta_i
//
//   increment_down  with the motions M of the step: Newton's correction of the displacement
//   rate_down       M = 1: applies M(q)^-1, the velocity of a momentum or RIQN's correction
//
// reads   screw 2 x n, placement 12 x n, (motion 7 x n,) gains, innovation nv (u)
// writes  variation 6 x n (eta), increment nv (Delta)
// slots   [begin, end) in order, begin = 1 first
// cost    one pass; the bodies of one level are independent
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.3, pass 3, for impulses
#pragma once

#include "kernels/impulse_pass_up.hpp"

namespace linden {

/// Delta of joint i, where xi is how its body's pose would change if it did not yield.
template <JointKind Kind, class S>
LINDEN_INLINE Wrench<S> joint_increment(Joint<Kind> joint, const Tree& tree, const Gains<S>& gains, Index i, const Wrench<S>& u,
                                        const Twist<S>& xi) {
  const Index row = tree.first_v(i);
  Wrench<S> delta = yield(joint, gains.inverse, tree.first_block(i), u);
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

template <class S, class PlacementOf, class Element>
void yield_down(const Tree& tree, const BodyConstants<Element>& constants, const PlacementOf& placement_of, const Gains<S>& gains,
                const Field<S>& innovation, Slots slots, Field<S, 6>& variation, Field<S>& increment) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  if (slots.begin == 1) store(variation, 0, Twist<S>{zero, zero});
  auto eta = load<Twist, S>(variation, slots.begin - 1);  // of the body before, often the parent
  down(tree, slots, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const Index row = tree.first_v(i), parent = tree.parent(i);
    if (parent != i - 1) eta = load<Twist, S>(variation, parent);
    const Twist<S> xi = to_child(placement_of(joint, i), eta);
    const Wrench<S> delta = joint_increment(joint, tree, gains, i, load_joint(joint, innovation, row), xi);
    store_joint(joint, increment, row, delta);
    eta = add_motion(joint, constants, i, delta, xi);
    store(variation, i, eta);
  });
}

template <class S, class Element>
void increment_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                    const Field<S, 7>& motion, const Gains<S>& gains, const Field<S>& innovation, Slots slots,
                    Field<S, 6>& variation, Field<S>& increment) {
  const auto placement_of = [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    return after_motion(joint, load<Placement, S>(placement, i), load<Displacement, S>(motion, i));
  };
  yield_down(tree, constants, placement_of, gains, innovation, slots, variation, increment);
}

template <class S, class Element>
void increment_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                    const Field<S, 7>& motion, const Gains<S>& gains, const Field<S>& innovation, Field<S, 6>& variation,
                    Field<S>& increment) {
  increment_down(tree, constants, placement, motion, gains, innovation, all_slots(tree), variation, increment);
}

template <class S, class Element>
void rate_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains,
               const Field<S>& innovation, Field<S, 6>& variation, Field<S>& rate) {
  const auto placement_of = [&](auto, Index i) { return load<Placement, S>(placement, i); };
  yield_down(tree, constants, placement_of, gains, innovation, all_slots(tree), variation, rate);
}

}  // namespace linden
