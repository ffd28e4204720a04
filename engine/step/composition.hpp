// engine/step/composition.hpp
// Methods of order 4, 6 and 8 out of the one-step map of order 2.
//
//   step of h  =  one-step map of gamma_s h  after ... after  gamma_2 h  after  gamma_1 h
//
// with gamma_i = gamma_{s+1-i} and sum 1: symmetric and symplectic like the map itself, on every kind of joint, and as linear in
// the number of bodies. Beyond order 2 some gamma must be negative (Sheng, Suzuki): the motion is taken back in time for a
// while. What takes energy gives it back there and grows, and what acts at given times has no place to act, so such effects are
// refused.
//
// cost    s sub-steps, each a solve of its own: s = 1, 5, 9, 17 for order 2, 4, 6, 8
// source  order 4: Suzuki, Fractal decomposition of exponential operators (1990), 1 / (4 - 4^(1/3)) four times, what is left in
//         the middle; 6, 8: Kahan, Li, Composition constants for raising the orders of unconventional schemes (1997), 9 and 17
//         stages, as given in Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), V.3.2
#pragma once

#include <span>
#include <string>

namespace linden {

struct Effects;

/// gamma_1, ..., gamma_s. Throws InputError for an order that is none of 2, 4, 6, 8.
std::span<const double> composition(int order);

/// The effects of a scene that cannot be taken back in time, by name, with commas: all but armature and springs. Empty: none.
std::string irreversible(const Effects& effects);

/// Those of them whose force changes suddenly with the motion, so that no explicit method has them: friction, limits, servos with limited
/// force, ground.
std::string sudden(const Effects& effects);

/// Throws InputError where the order is above 2 and an effect cannot be taken back in time.
void check_order(int order, const Effects& effects);

}  // namespace linden
