// engine/solve/convergence.hpp
// What counts as solved: shared by the stepper of one instance and that of a block of them.
#pragma once

namespace linden {

/// A correction that does not bring the energy norm below this share of what it was calls for a fresh Jacobian.
inline constexpr double kSlowProgress = 0.1;

/// Rounding of a joint's residual, in epsilons of the impulses that meet there. Where iterations gain nothing any more it stalls at 0.1
/// to 0.7 of them (chains of 10 to 10,000 hinges, of 100 ball joints, a tree of 1,023, both solvers).
inline constexpr double kFloorEpsilons = 4;

/// Where a correction has brought it below this many, the next can gain nothing and is not tried: chains from 5,000 links on are spared
/// their third evaluation.
inline constexpr double kBareRounding = 0.7;

/// Above this relative residual no step is accepted as converged, rounding or not.
inline constexpr double kFloorCeiling = 1e-6;
inline constexpr double kSingleFloorCeiling = 1e-3;  // in single precision

/// Relative residual from which on impulses that hold a joint or a contact are those of the solution, but for this much.
inline constexpr double kSettled = 1e-4, kSettledSquared = kSettled * kSettled;

/// A first guess that leaves a larger relative residual than this promises nothing of how exact its step is to be.
inline constexpr double kRoughGuess = 1e-2;

/// The equation of a step may have other roots, of the order of a radian away, once a step turns bodies by something of that order. Where
/// no body turns by more than kFreeTurn, or no joint had to be corrected from the first guess by more than kFreeCorrection, there is
/// none to fear. Measured over the steps that landed on another root (chains of 10 and 100 links at 2 to 10 ms, ball joints; 196
/// steps): turn 0.5 rad or more, correction 0.23 or more; of things that come to rest, are pushed or held: 4e-10 and 2e-6 at most.
inline constexpr double kFreeTurn = 0.1, kFreeCorrection = 0.05;                  // [rad]
inline constexpr double kFreeCosine = 0.99875026;                                // of half of kFreeTurn

/// Beyond both a step is asked for its energies, and may gain this share of the kinetic energy beyond the work of the impulses between it
/// and the step before: what second order leaves where a motion is barely resolved. On ten-link chains whipping at 4 to 6 ms steps
/// gain 0.02 to 0.12 at most; second roots, met from 8 ms on, 0.77 and more.
inline constexpr double kMostGain = 0.25;

}  // namespace linden
