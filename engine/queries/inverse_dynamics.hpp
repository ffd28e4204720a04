// engine/queries/inverse_dynamics.hpp
// Forces that a motion takes: the recursive Newton-Euler algorithm, O(n).
//
//   M(q) a + c(q, v) - Q(q) = tau        c what turns of itself (Coriolis, centrifugal, gyroscopic), Q of gravity
//
// tau [nv; N m, N] is conjugate to the velocities: of a ball or free joint moment, then force, in the body's frame. `outside`: wrenches
// that act on the bodies besides [slots x 6]: moment about the body's origin, force, in the body's frame, such as
// Simulation::body_wrenches; empty: none.
#pragma once

#include "engine/queries/kinematics.hpp"

namespace linden {

/// tau of the state's q, v and a. Throws InputError for another count of `outside`.
std::vector<double> inverse_dynamics(const Kinematics& state, std::span<const double> outside = {});

/// tau of q and v with a = 0: c - Q.
std::vector<double> bias_forces(const Kinematics& state);

/// Q alone.
std::vector<double> gravity_forces(const Kinematics& state);

/// The wrench across every joint [slots]: what the body that carries the joint gives the body in that slot by way of it, bearings and drive
/// together, for the state's q, v and a; in the frame of the body in that slot, which sits at the joint, moment about its origin. Of slot
/// 0, the world: the wrench that all bodies that hang on it give it, about the world's origin. Rotors (armature) are on no body, and not in
/// it.
///
/// Of a Simulation that keeps forces: joint_reactions(Kinematics(simulation), simulation.body_wrenches()) is right to the order of the
/// step; exact for what rests.
std::vector<SpatialForce> joint_reactions(const Kinematics& state, std::span<const double> outside = {});

}  // namespace linden
