// layout/state.hpp
// What a checkpoint saves: everything the future of a simulation depends on.
//
// The state of the system itself is (q, p). The displacements of the last steps only feed the first guess of the next solve and judge
// its solution; they are kept here because a run continued from a checkpoint is to be bit-identical.
#pragma once

#include "layout/field.hpp"

namespace linden {

/// Displacements of earlier steps that the first guess extrapolates from. Measured on the ten-link chain at 1 ms: 2.79 evaluations of
/// the residual a step with three, 2.38 with four, 2.16 with five; on 1,023 bodies in a binary tree 2.33, 2.12, 2.07.
inline constexpr int kHistory = 5;

#define LINDEN_STATE_FIELDS(FIELD)                                                                                     \
  FIELD(Scalar, q, 1, positions, "joint positions [rad, m, unit quaternion x y z w]")                                  \
  FIELD(Scalar, p, 1, velocities, "discrete conjugate momenta [kg m^2/s, kg m/s], body frame for ball and free joints") \
  FIELD(Scalar, history, kHistory, velocities, "displacements of the last steps, latest first [rad, m]")                       \
  FIELD(Scalar, last_step, 1, instance, "length of the step that the latest displacement is of; 0 = none is known [s]")

template <class Scalar>
struct State {
  LINDEN_FIELDS(LINDEN_STATE_FIELDS)
};

}  // namespace linden
