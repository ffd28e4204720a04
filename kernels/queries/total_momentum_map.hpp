// kernels/queries/total_momentum_map.hpp
// Centre of mass and momentum of a whole system, a sum over its bodies.
//
//   m c = sum of m_i p_i + R_i (m c)_i                    p_i, R_i of T_i
//   l   = sum of R_i f_i                                  (n_i, f_i) = G_i V_i
//   k   = sum of R_i n_i + p_i x R_i f_i                  about the world's origin
//
// The centre of mass moves by l / m. About the centre of mass the angular momentum is k - c x l.
//
// reads   inertia 10 x n, pose 12 x n, twist 6 x n (where momenta are asked for)
// returns mass [kg], first moment [kg m], momenta [kg m^2/s, kg m/s]; world frame
// cost    bodies are independent
#pragma once

#include "kernels/queries/body_motion_down.hpp"

namespace linden {

template <class S>
struct TotalMomentum {
  S mass;
  Vec3<S> moment;      // mass times centre of mass
  Wrench<S> momentum;  // angular about the world's origin, linear
};

template <bool kMomentum, class S, class Element>
TotalMomentum<S> total_momentum_map(const Tree& tree, const BodyConstants<Element>& constants, const BodyMotions<S>& motions) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  TotalMomentum<S> sum{S(0.0), zero, {zero, zero}};
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const auto G = load<Inertia, S>(constants.inertia, i);
    const auto T = load<Placement, S>(motions.pose, i);
    sum.mass = sum.mass + G.m;
    sum.moment += G.m * T.p + T.R * G.mc;
    if constexpr (kMomentum) sum.momentum = sum.momentum + to_parent(T, G * load<Twist, S>(motions.twist, i));
  }
  return sum;
}

}  // namespace linden
