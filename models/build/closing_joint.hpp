// A joint that closes a loop, as a joint of the tree: with a coordinate, limits, friction, servos and whatever else acts on joints.
//
//   a ----- joint ----- b        becomes        a ----- joint ----- half of b ===== weld ===== the other half, in the tree where b is
//
// Both halves have half of b's mass and inertia and move as one: the motion is that of the link, and what acts on the joint needs no law of its
// own. The coordinate is how b has turned, or slid, against a about the z axis of their frames. Where b is the world, or has nothing that the
// joint could move, a is shared.
#pragma once

#include "models/build/builder.hpp"

namespace linden {

struct ClosingJoint {
  std::string name;  // of the joint; its half of a link is called "LINK at NAME"
  JointLimits limits{};
  double damping = 0, friction = 0;  // as files give them (LinkSpec)
};

/// The model with this joint. coupling: a hinge or slider of bodies of the model, which becomes a weld of the new one. Throws InputError where neither
/// of both bodies can be shared, and for names that are there already.
Model with_closing_joint(Model model, Coupling& coupling, const ClosingJoint& joint);

}  // namespace linden
