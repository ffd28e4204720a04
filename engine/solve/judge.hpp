// engine/solve/judge.hpp
// What counts as solved, of one tree and of the instances of a block alike: every judgement once, for numbers or for packs of them.
//
//   norm     r.A^-1 r, the squared energy norm of the residual, times h^2
//   scale    h^2 x kinetic energy of the mean motion; with effects also what gravity gives in a step to what is at rest
//   relative residual = sqrt(norm / 2 / scale)
#pragma once

#include <array>
#include <limits>

#include "kernels/tree/largest_turn.hpp"
#include "kernels/values/lanes_of.hpp"
#include "kernels/values/scalar.hpp"
#include "layout/model.hpp"

namespace linden {

/// A correction that does not bring the energy norm below this share of what it was calls for a fresh Jacobian.
inline constexpr double kSlowProgress = 0.1;

/// Rounding of a joint's residual, in epsilons of the impulses that meet there. Where iterations gain nothing any more it stalls at 0.1
/// to 0.7 of them (chains of 10 to 10,000 hinges, of 100 ball joints, a tree of 1,023, both solvers).
inline constexpr double kFloorEpsilons = 4;

/// Where a correction has brought it below this many, the next can gain nothing and is not tried: chains from 5,000 links on are spared
/// their third evaluation.
inline constexpr double kBareRounding = 0.7;

/// Only a residual within this factor of the tolerance is looked at for bare rounding: the look costs a tenth of a correction.
inline constexpr double kNearTolerance = 1e4;

/// Above this relative residual no step is accepted as converged, rounding or not.
template <class Real>
inline constexpr double kFloorCeiling = sizeof(Real) == sizeof(float) ? 1e-3 : 1e-6;

/// Relative residual from which on impulses that hold a joint or a contact are those of the solution, but for this much.
inline constexpr double kSettled = 1e-4;

/// A first guess that leaves a larger relative residual than this promises nothing of how exact its step is to be.
inline constexpr double kRoughGuess = 1e-2;

/// The equation of a step may have other roots, of the order of a radian away, once a step turns bodies by something of that order. Where
/// no body turns by more than `turn`, or no joint had to be corrected from the first guess by more than `correction`, there is none to fear.
struct NoOtherRoot {
  double cosine;      // of half of the turn
  double correction;  // [rad]
};

/// Turns of 0.1 rad. Measured over the steps that landed on another root (chains of 10 and 100 links at 2 to 10 ms, ball joints; 196
/// steps): turn 0.5 rad or more, correction 0.23 or more; of things that come to rest, are pushed or held: 4e-10 and 2e-6 at most.
inline constexpr NoOtherRoot kOfTree{0.99875026, 0.05};

/// Turns of 0.01 rad: rows of couplings turn the faster the nearer a mechanism is to where it can go no further.
inline constexpr NoOtherRoot kOfMechanism{0.9999875, 0.005};

/// Beyond both a step is asked for its energies, and may gain this share of the kinetic energy beyond the work of the impulses between it
/// and the step before: what second order leaves where a motion is barely resolved. On ten-link chains whipping at 4 to 6 ms steps
/// gain 0.02 to 0.12 at most; second roots, met from 8 ms on, 0.77 and more.
inline constexpr double kMostGain = 0.25;

/// Couplings may work by this share of the kinetic energy, and of their own, beside what their gaps change by: third order where steps follow how
/// they turn. Rigid ones are asked where energies are: a ball whipped round by a cable gained a thousand times its energy in a few steps. A bushing
/// whose pitch comes near a right angle, where roll and yaw are one and turn the faster the nearer it is, gave ten times the energy of its scene in
/// a step, and half of it where a quarter was allowed.
inline constexpr double kMostStray = 0.01;

/// A row of a coupling that others hold already is watched: it may open by this share of the size of its mechanism, ten times what axes may be
/// off that are taken for parallel (kernels/couplings/masked_solve.hpp). Beyond that the bodies cannot go where they are sent.
inline constexpr double kMostOpen = 3e-4;

/// An evaluation of the residual.
template <class S>
struct Evaluated {
  S least_w = S(1.0);  // see displacement_down: zero or less where a body turned by pi
  S energy = S(0.0);   // h^2 x kinetic energy of the mean motion
  S plain = S(0.0);    // |h r|^2, where somebody asks for it
  S norm = S(0.0);
  S scale = S(0.0);

  /// What another part of the tree adds.
  void add(const Evaluated& part) {
    using std::min;
    least_w = min(least_w, part.least_w);
    energy = energy + part.energy;
    norm = norm + part.norm;
  }
};

/// Kinetic energy per kilogram, times h^2, that gravity gives in a step of h to what is at rest.
inline double fall_per_mass(const std::array<double, 3>& g, double h) {
  return 0.5 * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * h * h * h * h;
}

template <class S>
auto usable(const Evaluated<S>& now) {
  const S most = as<S>(std::numeric_limits<typename ElementOf<S>::type>::max());
  return now.least_w > S(0.0) && now.norm <= most && now.energy <= most && now.plain <= most;
}

/// Whether the relative residual is at most the root of `squared`.
template <class S>
auto within(const S& norm, const S& squared, const S& scale) {
  return S(0.5) * norm <= squared * scale;
}

/// Whether a correction from `before` was a slow one.
template <class S>
auto fell_fast(const S& norm, const S& before) {
  return norm <= as<S>(kSlowProgress * kSlowProgress) * before;
}

/// Whether rounding alone may be so large beside the motion, or beside what gravity alone would do to it where all is at rest (fall).
template <class S>
auto below_ceiling(const S& norm, const S& energy, const S& fall) {
  constexpr double ceiling = kFloorCeiling<typename ElementOf<S>::type>;
  return S(0.5) * norm <= as<S>(ceiling * ceiling) * (energy + fall);
}

/// Whether it is: `sum` is rounding_floor_map's.
template <class S>
auto is_rounding(const S& norm, const S& sum, double epsilons) {
  const double unit = epsilons * static_cast<double>(std::numeric_limits<typename ElementOf<S>::type>::epsilon());
  return norm <= as<S>(unit * unit) * sum;
}

/// By which of them a model is judged.
inline const NoOtherRoot& no_other_root(const Model& model) { return model.couplings.empty() ? kOfTree : kOfMechanism; }

/// Whether a solution may be another root than the motion's: least_w and delta of the solution, guess(row) of what it was found from.
template <class S, class Element, class Guess>
Lanes may_be_another_root(const NoOtherRoot& bounds, const Tree& tree, const BodyConstants<Element>& constants, Lanes asked, const S& least_w,
                          const Field<S>& delta, const Guess& guess) {
  using L = LanesOf<S>;
  asked &= L::bits(least_w <= as<S>(bounds.cosine));
  if (asked == 0) return 0;
  return asked & L::bits(largest_turn(tree, constants, delta, guess) >= as<S>(bounds.correction));
}

}  // namespace linden
