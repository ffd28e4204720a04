// kernels/queries/newton_euler_map.hpp
// The wrench that each body needs to move as it does: the middle of the recursive Newton-Euler algorithm, one body at a time.
//
//   F_i = G_i (A_i - g_i) - ad_{V_i}^T G_i V_i - E_i         g_i gravity in the body's frame, E_i what acts on the body from outside
//
// impulse_up of it gives the wrench across every joint, and what the joint itself has to apply: S^T F.
//
// reads   inertia 10 x n, pose 12 x n, twist 6 x n, acceleration 6 x n, outside 6 x n (E; moment [N m] about the body's origin, force [N]),
//         gravity [m/s^2] in the world's frame
// writes  wrench 6 x n, body frame, moment about its origin
// cost    bodies are independent
// source  Featherstone, Rigid Body Dynamics Algorithms, 5.3 (RNEA)
#pragma once

#include "kernels/queries/body_motion_down.hpp"

namespace linden {

template <class S, class Element>
void newton_euler_map(const Tree& tree, const BodyConstants<Element>& constants, const BodyMotions<S>& motions, const Vec3<S>& gravity,
                      const Field<S, 6>& outside, Field<S, 6>& wrench) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  store(wrench, 0, Wrench<S>{zero, zero});
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const auto G = load<Inertia, S>(constants.inertia, i);
    const auto V = load<Twist, S>(motions.twist, i), A = load<Twist, S>(motions.acceleration, i);
    const Wrench<S> m = G * V;
    const Vec3<S> g = transpose_times(load<Placement, S>(motions.pose, i).R, gravity);
    const Wrench<S> turning{cross(V.w, m.n) + cross(V.v, m.f), cross(V.w, m.f)};
    store(wrench, i, G * Twist<S>{A.w, A.v - g} + turning - load<Wrench, S>(outside, i));
  }
}

}  // namespace linden
