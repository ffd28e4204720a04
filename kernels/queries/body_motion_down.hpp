// kernels/queries/body_motion_down.hpp
// Where bodies are, how they move and how they accelerate, root to leaves: of the whole tree, or only of the bodies that are asked for and
// those between them and the root.
//
//   T_i = T_lambda(i) X_i                                                   body -> world
//   V_i = Ad_{X_i^-1} V_lambda(i) + S_i v_i                                 body frame
//   A_i = Ad_{X_i^-1} A_lambda(i) + S_i a_i + ad_{V_i} S_i v_i              spatial acceleration, body frame
//
// The classical acceleration of the body's origin is A.v + V.w x V.v: a spatial acceleration counts how the velocity changes of whatever
// passes the origin of a frame that stands still.
//
// reads   tree_placement 12 x n, screw 2 x n, q nq, v nv, a nv; slots: every one behind its parent, unless that is the world
// writes  placement 12 x n (X), pose 12 x n (T), twist 6 x n (V), acceleration 6 x n (A), rows of these slots and of the world
// cost    one pass; a sine and cosine a screw
// source  Featherstone, Rigid Body Dynamics Algorithms, 5.3
#pragma once

#include <cstddef>

#include "kernels/tree/placement_map.hpp"

namespace linden {

/// How much of it: each needs those before it.
enum class MotionDepth : std::uint8_t { poses, twists, accelerations };

#define LINDEN_BODY_MOTION_FIELDS(FIELD)                                                          \
  FIELD(Scalar, placement, 12, slots, "X: body -> parent; rotation row by row, shift [m]")       \
  FIELD(Scalar, pose, 12, slots, "T: body -> world, likewise")                                   \
  FIELD(Scalar, twist, 6, slots, "V: angular [rad/s], linear [m/s]; body frame")                 \
  FIELD(Scalar, acceleration, 6, slots, "A: spatial acceleration [rad/s^2, m/s^2]; body frame")

template <class Scalar>
struct BodyMotions {
  LINDEN_FIELDS(LINDEN_BODY_MOTION_FIELDS)
};

template <class S>
LINDEN_INLINE Placement<S> no_placement() {
  const S zero(0.0), one(1.0);
  return {{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}}, {zero, zero, zero}};
}

template <class S>
LINDEN_INLINE Twist<S> no_twist() {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  return {zero, zero};
}

/// Of one body behind its parent.
template <MotionDepth Depth, JointKind Kind, class S, class Element>
LINDEN_INLINE void move_body(Joint<Kind> joint, const Tree& tree, const BodyConstants<Element>& constants, Index i, const Field<S>& q,
                             const Field<S>& v, const Field<S>& a, BodyMotions<S>& motions) {
  const Index parent = tree.parent(i), row = tree.first_v(i);
  const Placement<S> X = placed(joint, constants, i, tree.first_q(i), q);
  const auto T = load<Placement, S>(motions.pose, parent);
  store(motions.placement, i, X);
  store(motions.pose, i, Placement<S>{T.R * X.R, T.p + T.R * X.p});
  if constexpr (Depth >= MotionDepth::twists) {
    const Twist<S> own = add_motion(joint, constants, i, load_joint(joint, v, row), no_twist<S>());
    const Twist<S> V = to_child(X, load<Twist, S>(motions.twist, parent)) + own;
    store(motions.twist, i, V);
    if constexpr (Depth >= MotionDepth::accelerations) {
      const Twist<S> carried = to_child(X, load<Twist, S>(motions.acceleration, parent));
      const Twist<S> turned{cross(V.w, own.w), cross(V.w, own.v) + cross(V.v, own.w)};
      store(motions.acceleration, i, add_motion(joint, constants, i, load_joint(joint, a, row), carried + turned));
    }
  }
}

/// slots [count]. v and a are not read where the depth does not need them.
template <MotionDepth Depth, class S, class Element>
void body_motion_down(const Tree& tree, const BodyConstants<Element>& constants, const Index* slots, std::size_t count, const Field<S>& q,
                      const Field<S>& v, const Field<S>& a, BodyMotions<S>& motions) {
  store(motions.placement, 0, no_placement<S>());
  store(motions.pose, 0, no_placement<S>());
  if constexpr (Depth >= MotionDepth::twists) store(motions.twist, 0, no_twist<S>());
  if constexpr (Depth >= MotionDepth::accelerations) store(motions.acceleration, 0, no_twist<S>());
  for (std::size_t k = 0; k < count; ++k) {
    const Index i = slots[k];
    with_joint(tree.kind(i), [&](auto joint) LINDEN_INLINE_LAMBDA { move_body<Depth>(joint, tree, constants, i, q, v, a, motions); });
  }
}

}  // namespace linden
