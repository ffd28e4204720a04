// engine/queries/mass_matrix.hpp
// The mass matrix M(q), with the armature of the state on its diagonal, and its inverse at work.
//
// Of joints that follow others by <mimic> rows and columns are zero, and their leaders' have their shares: M v = p for any v of the model.
#pragma once

#include "engine/queries/kinematics.hpp"
#include "engine/queries/matrix.hpp"

namespace linden {

/// nv x nv, symmetric [kg m^2, kg m, kg]. cost  O(n d), d the depth of the tree.
Matrix mass_matrix(const Kinematics& state);

/// M(q)^-1 f [nv], followers as their leaders move: accelerations of forces, velocities of momenta. What f has in the rows of followers is
/// carried to their leaders. Of the tree alone, as if it had no couplings. cost  O(n), without the matrix. Throws InputError for another count.
std::vector<double> solve_mass_matrix(const Kinematics& state, std::span<const double> f);

/// Accelerations that joint forces tau [nv] give the state, gravity and what turns of itself with them: M^-1 (tau - bias_forces).
/// cost  O(n). Throws InputError for another count, and for a model with couplings, whose forces are found by a step alone.
std::vector<double> forward_dynamics(const Kinematics& state, std::span<const double> tau);

}  // namespace linden
