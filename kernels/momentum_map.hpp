// kernels/momentum_map.hpp
// Mean velocity over the step and discrete momentum of every body, one body at a time.
//
//   hV_i = log dT_i                                    (10)
//   h mu_i = dlog_{hV_i}^T G_i hV_i                    (21b), times h
//
// Impulses are carried times h: then nothing is divided by h, the exact derivative of h mu is G + O(hV), and no digits are lost as
// h shrinks.
//
// reads   inertia 10 x n, displacement 7 x n
// writes  twist 6 x n (hV: [rad], [m]), body_momentum 6 x n (G hV), impulse 6 x n (h mu; [kg m^2], [kg m]), all in the body frame
// returns h^2 times the kinetic energy of the mean motion, sum of 1/2 (hV).(G hV)
// cost    three short polynomials a body; bodies are independent
// source  the paper, Algorithm 2, lines 4 and 7
#pragma once

#include "kernels/joints.hpp"
#include "kernels/se3.hpp"

namespace linden {

template <class S>
struct BodyMomentum {
  Twist<S> u;     // hV
  Wrench<S> m;    // G hV
  Wrench<S> mu;   // h mu
};

template <class S>
LINDEN_INLINE BodyMomentum<S> body_momentum_of(const Inertia<S>& G, const Displacement<S>& D) {
  const Logarithm<S> log_D(D);
  const Wrench<S> m = G * log_D.u;
  return {log_D.u, m, dlog_transpose(log_D, m)};
}

template <class S, class Element>
S momentum_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 7>& displacement, Field<S, 6>& twist,
               Field<S, 6>& body_momentum, Field<S, 6>& impulse) {
  S energy(0.0);
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const auto body = body_momentum_of(load<Inertia, S>(constants.inertia, i), load<Displacement, S>(displacement, i));
    store(twist, i, body.u);
    store(body_momentum, i, body.m);
    store(impulse, i, body.mu);
    energy = energy + S(0.5) * dot(body.m, body.u);
  }
  return energy;
}

}  // namespace linden
