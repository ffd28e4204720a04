// engine/compose/composition.hpp
// Methods of order 4, 6 and 8 out of the one-step map of order 2.
//
//   step of h  =  one-step map of gamma_s h  after ... after  gamma_2 h  after  gamma_1 h
//
// with gamma_i = gamma_{s+1-i} and sum 1: symmetric and symplectic like the map itself, on every kind of joint, and as linear in
// the number of bodies. Beyond order 2 some gamma must be negative (Sheng, Suzuki): the motion is taken back in time for a
// while. What takes energy gives it back there and grows, and what acts at given times has no place to act, so such effects are
// refused.
//
// cost    s sub-steps, each a solve of its own: s = 1, 5, 11, 17 for order 2, 4, 6, 8
// source  order 4, 6: palindromes of 5 and 11 stages with one and two numbers to spare (Hairer, Lubich, Wanner, Geometric Numerical
//         Integration (2006), V.3.2): those are gamma_1 and gamma_2, the others solve the order conditions to 50 digits.
//         8: Kahan, Li, Composition constants for raising the orders of unconventional schemes (1997), 17 stages, as given there
//
// What is to spare was chosen, and the number of stages, by the work that an equal energy band takes: the ten-link chain falling and
// whipping, from eight places on its way, and the tumbling humanoid, at several steps. Where the band is least it is flat: 0.33 to 0.37
// are as good as 0.35.
//
//   work          order 4                                          order 6
//   here          1                                                1
//   7 stages      1.04, the best of two to spare                   13 stages: 1.03, the best of three to spare
//   others        Suzuki (1990): 1.07, of 7, 9, 11 equal stages    Kahan, Li, 9 stages: 1.08
//                 and one back 1.13, 1.3, 1.4
//
// Stages that are many, short and equal have a smaller sum of gamma^5, but a larger coefficient of [Y1, [Y1, Y3]], the other term that is
// left at order 4 of a symmetric map exp(h Y1 + h^3 Y3 + ...), and on trees of bodies it weighs ten times as much. For order 8 no 19 or
// 21 stages were found that need less work than 17.
//
// Errors of positions at the same step, here over Suzuki's and Kahan and Li's: order 4 0.7 on the humanoid, 1.2 on a heavy top, twice
// on a pendulum and a free body; order 6 a tenth to a twentieth on all of them.
#pragma once

#include <span>
#include <string>

namespace linden {

struct Effects;
struct Model;

/// gamma_1, ..., gamma_s. Throws InputError for an order that is none of 2, 4, 6, 8.
std::span<const double> composition(int order);

/// The effects of a scene that cannot be taken back in time, by name, with commas: what takes or gives energy one way. Empty: none.
std::string irreversible(const Effects& effects);

/// Those whose force changes suddenly with the motion, so that no explicit method has them, as their facts say: friction, limits, servos with
/// limited force, given motions, ground.
std::string sudden(const Effects& effects);

/// Throws InputError where the order is above 2 and an effect, or what damps a coupling, cannot be taken back in time.
void check_order(int order, const Model& model, const Effects& effects);

}  // namespace linden
