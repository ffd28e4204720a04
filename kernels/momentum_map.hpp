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
// cost    one reciprocal and three polynomials a body; bodies are independent
// source  the paper, Algorithm 2, lines 4 and 7
#pragma once

#include "kernels/joints.hpp"
#include "kernels/se3.hpp"

namespace linden {

template <class S, class Element>
S momentum_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 7>& displacement, Field<S, 6>& twist,
               Field<S, 6>& body_momentum, Field<S, 6>& impulse) {
  S energy(0.0);
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const Twist<S> u = log(load<Displacement, S>(displacement, i));
    const Wrench<S> m = load<Inertia, S>(constants.inertia, i) * u;
    const TransposedDlog<S> mu = dlog_transpose(u, m);
    store(twist, i, u);
    store(body_momentum, i, m);
    store(impulse, i, mu.even + mu.odd);
    energy = energy + S(0.5) * dot(m, u);
  }
  return energy;
}

/// h nu_i = Ad_{exp(hV_i)}^T h mu_i = dlog_{-hV_i}^T G_i hV_i: the same momentum seen from the end of the step.
/// reads twist, body_momentum; writes impulse.
template <class S>
void end_momentum_map(const Tree& tree, const Field<S, 6>& twist, const Field<S, 6>& body_momentum, Field<S, 6>& impulse) {
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const TransposedDlog<S> nu = dlog_transpose(load<Twist, S>(twist, i), load<Wrench, S>(body_momentum, i));
    store(impulse, i, nu.even - nu.odd);
  }
}

}  // namespace linden
