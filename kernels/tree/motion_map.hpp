// kernels/tree/motion_map.hpp
// The displacement of each joint over the step, as a group element near identity.
//
//   motion_map          M_i = exp(S_i delta_i)
//   correct_motion_map  M_i <- M_i exp(-s S_i Delta_i), delta of screws alike
//   displacement_map    delta_i = log M_i for ball and free joints (a screw's delta is kept as it goes)
//
// Newton's corrections of ball and free joints are multiplied on, so no chart and no derivative of one enters the solve. A correction
// taken back (s negative) returns to the same motion up to rounding: that is how the solver backtracks.
//
// reads   screw 2 x n, delta nv, increment nv [rad, m]
// writes  motion 7 x n (quaternion x y z w, shift [m]), delta nv
// range   turns by less than pi
// cost    two polynomials a screw; a body in every lane
#pragma once

#include "kernels/values/body_lanes.hpp"
#include "kernels/values/joints.hpp"
#include "kernels/values/se3.hpp"

namespace linden {

template <class S>
LINDEN_INLINE Displacement<S> screw_motion(const Screw<S>& screw, const S& delta) {
  const S zero(0.0);
  const S half = S(0.5) * screw.r * delta, square = half * half;
  return {{{zero, zero, half * sinc(square)}, S(1.0) - square * versine_over_square(square)}, {zero, zero, screw.t * delta}};
}

/// exp of the joint's rows of `delta`, times `factor`.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Displacement<S> joint_motion(Joint<Kind> joint, const BodyConstants<Element>& constants, Index i, Index row,
                             const Field<S>& delta, const S& factor) {
  if constexpr (Kind == JointKind::screw) {
    return screw_motion(load_screw<S>(constants, i), factor * delta(row));
  } else {
    const Wrench<S> rows = load_joint(joint, delta, row);
    return exp(Twist<S>{factor * rows.n, factor * rows.f});
  }
}

template <class S, class Element>
void motion_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& delta, Slots slots, Field<S, 7>& motion) {
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw) {
      const Index shift = tree.first_v(part.begin) - part.begin;
      for_bodies<S>(part.begin, part.end, [&](auto bodies, Index i) {
        scatter(bodies, motion, slots.row(i), screw_motion(gather<Screw>(bodies, constants.screw, i), gather_row(bodies, delta, i + shift)));
      });
    } else {
      for (Index i = part.begin; i < part.end; ++i) {
        store(motion, slots.row(i), joint_motion(joint, constants, i, tree.first_v(i), delta, S(1.0)));
      }
    }
  });
}

template <class S, class Element>
void correct_motion_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& increment, const S& factor,
                        Slots slots, Field<S>& delta, Field<S, 7>& motion) {
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw) {
      const Index shift = tree.first_v(part.begin) - part.begin;
      for_bodies<S>(part.begin, part.end, [&](auto bodies, Index i) {
        using B = typename decltype(bodies)::Scalar;
        const B better = gather_row(bodies, delta, i + shift) - as<B>(factor) * gather_row(bodies, increment, i + shift);
        scatter_row(bodies, delta, i + shift, better);
        scatter(bodies, motion, slots.row(i), screw_motion(gather<Screw>(bodies, constants.screw, i), better));
      });
    } else {
      for (Index i = part.begin; i < part.end; ++i) {
        const auto M = load<Displacement, S>(motion, slots.row(i));
        store(motion, slots.row(i), M * joint_motion(joint, constants, i, tree.first_v(i), increment, -factor));
      }
    }
  });
}

template <class S, class Element>
void motion_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& delta, Field<S, 7>& motion) {
  motion_map(tree, constants, delta, all_slots(tree), motion);
}

template <class S, class Element>
void correct_motion_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& increment, const S& factor,
                        Field<S>& delta, Field<S, 7>& motion) {
  correct_motion_map(tree, constants, increment, factor, all_slots(tree), delta, motion);
}

template <class S>
void displacement_map(const Tree& tree, const Field<S, 7>& motion, Field<S>& delta) {
  down(tree, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    if constexpr (joint != JointKind::screw) {
      const Twist<S> u = log(load<Displacement, S>(motion, i));
      store_joint(joint, delta, tree.first_v(i), Wrench<S>{u.w, u.v});
    }
  });
}

}  // namespace linden
