// engine/step/convergence.hpp
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

/// Share of its kinetic energy that a scene with effects may have back a step after an impact took it.
inline constexpr double kImpactMemory = 0.9;

/// A first guess that leaves a larger relative residual than this promises nothing of how exact its step is to be.
inline constexpr double kRoughGuess = 1e-2;

/// A step may gain this share of the kinetic energy beyond the work of the forces: what second order leaves where a motion is barely
/// resolved. On ten-link chains whipping at 4 to 6 ms steps gain 0.02 to 0.12 at most; second roots, met from 8 ms on, 0.77 and more.
inline constexpr double kMostGain = 0.25;

}  // namespace linden
