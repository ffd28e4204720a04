// engine/queries/step_forces.hpp
// Inverse dynamics of a discrete motion: the forces with which linden's own steps go through three configurations, a step apart each. The
// residual of the discrete Euler-Lagrange equation (kernels/tree/residual_up.hpp) read the other way round, in O(n):
//
//   h f = S^T (F+ - F-) / h - h Q(q1)      F+ h x momenta of the subtrees in the step q1 -> q2 at its beginning, F- in q0 -> q1 at its end
//
// At q1 half of the force of the step before acts and half of that of the step after. A simulation that has come from q0 under the force f0 and
// is given 2 f - f0 by set_forces at q1 goes on to q2, to the tolerance of its solver; where f stays the same from step to step that is f.
#pragma once

#include "engine/queries/kinematics.hpp"

namespace linden {

struct StepForces {
  std::vector<double> joints;        // f [nv; N m, N], conjugate to the velocities at q1; without armature
  std::vector<SpatialForce> across;  // [slots] wrench across each joint, as joint_reactions has it, mean about q1; slot 0 as there
};

/// q0, q1 and q2 [nq], h [s], gravity [m/s^2] in the world's frame. `outside` as in inverse_dynamics: wrenches on the bodies at q1. Throws
/// InputError for wrong counts, numbers that are not finite, a step that is not positive, and where a body turns by half a turn or more in
/// a step.
StepForces step_forces(const Model& model, std::span<const double> q0, std::span<const double> q1, std::span<const double> q2, double h,
                       const std::array<double, 3>& gravity = {0, 0, -9.81}, std::span<const double> outside = {});

}  // namespace linden
