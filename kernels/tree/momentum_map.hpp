// kernels/tree/momentum_map.hpp
// Mean velocity over the step and discrete momentum of every body, one body at a time.
//
//   hV_i = log dT_i                                    (10)
//   h mu_i = dlog_{hV_i}^T G_i hV_i                    (21b), times h
//
// Impulses are carried times h: then nothing is divided by h, the exact derivative of h mu is G + O(hV), and no digits are lost as
// h shrinks.
//
// reads   inertia 10 x n, displacement 7 x n
// writes  impulse 6 x n (h mu; [kg m^2], [kg m]), in the body frame
// returns h^2 times the kinetic energy of the mean motion, sum of 1/2 (hV).(G hV)
// slots   [begin, end), in any order
// cost    three short polynomials a body; a body in every lane
// source  the paper, Algorithm 2, lines 4 and 7
#pragma once

#include "kernels/values/body_lanes.hpp"
#include "kernels/values/joints.hpp"
#include "kernels/values/se3.hpp"

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
S momentum_map(const Tree&, const BodyConstants<Element>& constants, const Field<S, 7>& displacement, Slots slots,
               Field<S, 6>& impulse) {
  S energy(0.0);
  for_bodies<S>(slots.begin, slots.end, [&](auto bodies, Index i) {
    using B = typename decltype(bodies)::Scalar;
    const auto body = body_momentum_of(gather<Inertia>(bodies, constants.inertia, i), gather<Displacement>(bodies, displacement, slots.row(i)));
    scatter(bodies, impulse, slots.row(i), body.mu);
    energy = energy + summed(bodies, B(0.5) * dot(body.m, body.u));
  });
  return energy;
}

template <class S, class Element>
S momentum_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 7>& displacement, Field<S, 6>& impulse) {
  return momentum_map(tree, constants, displacement, all_slots(tree), impulse);
}

}  // namespace linden
