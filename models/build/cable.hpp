// A cable through points of several bodies, whose length is a joint of the tree: limits, springs, servos, friction, given motions and whatever else
// acts on joints act on it.
//
//   sum of |x_k+1 - x_k| = q     one row (layout/couplings.hpp); q: coordinate of a slide that hangs on the body that all of its bodies hang on
//
//   a limit above                                     it does not stretch; shorter it is slack and does nothing
//   a spring with a dead zone from 0 to its length    it stretches
//   a given motion, a servo, a torque                 a winch, a motor that pulls a tendon
//   friction, damping                                 those of its guides
//
// What is solved for has to resist, so the slide has a mass, kCableMass of the lightest body that the cable goes through, as a cable that runs
// along its guides has. A weight on a cable over a hook takes 1e-6 of its acceleration from that; forces at rest are none of it, since it slides
// across gravity where the body that it hangs on does not turn.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "models/build/closing_joint.hpp"

namespace linden {

inline constexpr double kCableMass = 1e-6;

/// A point that a cable goes through.
struct CablePlace {
  std::string link;       // "world", or empty: the world
  Eigen::Vector3d point;  // [m], in the frame of the link
};

/// The model with the joint that is the length of this cable, which gets its points and that coordinate. Links have to be there. Throws InputError
/// where all points are on one body, one of them is not finite, and for names that are there already.
Model with_cable_length(Model model, Coupling& cable, const std::vector<CablePlace>& places, const ClosingJoint& joint);

}  // namespace linden
