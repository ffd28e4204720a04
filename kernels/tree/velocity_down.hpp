// kernels/tree/velocity_down.hpp
// Body twists from joint rates, and what follows from them, root to leaves.
//
//   velocity_down      V_i = Ad_{X_i^-1} V_lambda(i) + S_i v_i
//   momentum_of_map    G_i V_i
//   coriolis_down      a_i = Ad_{X_i^-1} a_lambda(i) + ad_{V_i} S_i v_i,   G_i a_i - ad_{V_i}^T G_i V_i
//
// impulse_up of the results gives M(q) v, and the Coriolis force C(q, v) v of the explicit first guess (paper, IG3).
//
// reads   placement 12 x n, screw 2 x n, inertia 10 x n, rate nv [rad/s, m/s]
// writes  velocity 6 x n, acceleration 6 x n, impulse 6 x n (body frame)
// cost    one pass; the bodies of one level are independent
// source  Featherstone, Rigid Body Dynamics Algorithms, 5.3 (RNEA with zero joint accelerations)
#pragma once

#include "kernels/values/joints.hpp"

namespace linden {

template <class S, class Element>
void velocity_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                   const Field<S>& rate, Field<S, 6>& velocity) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  store(velocity, 0, Twist<S>{zero, zero});
  down(tree, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const auto carried = to_child(load<Placement, S>(placement, i), load<Twist, S>(velocity, tree.parent(i)));
    store(velocity, i, add_motion(joint, constants, i, load_joint(joint, rate, tree.first_v(i)), carried));
  });
}

template <class S, class Element>
void momentum_of_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 6>& velocity,
                     Field<S, 6>& impulse) {
  for (Index i = 1; i < tree.shape.slots; ++i) {
    store(impulse, i, load<Inertia, S>(constants.inertia, i) * load<Twist, S>(velocity, i));
  }
}

template <class S, class Element>
void coriolis_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                   const Field<S>& rate, const Field<S, 6>& velocity, Field<S, 6>& acceleration, Field<S, 6>& impulse) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  store(acceleration, 0, Twist<S>{zero, zero});
  down(tree, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const auto V = load<Twist, S>(velocity, i);
    const Twist<S> own = add_motion(joint, constants, i, load_joint(joint, rate, tree.first_v(i)), Twist<S>{zero, zero});
    const auto carried = to_child(load<Placement, S>(placement, i), load<Twist, S>(acceleration, tree.parent(i)));
    const Twist<S> a = carried + Twist<S>{cross(V.w, own.w), cross(V.w, own.v) + cross(V.v, own.w)};
    store(acceleration, i, a);
    const auto G = load<Inertia, S>(constants.inertia, i);
    const Wrench<S> m = G * V;
    // -ad_V^T m = (w x n + v x f, w x f)
    store(impulse, i, G * a + Wrench<S>{cross(V.w, m.n) + cross(V.v, m.f), cross(V.w, m.f)});
  });
}

}  // namespace linden
