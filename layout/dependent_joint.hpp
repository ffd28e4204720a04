// layout/dependent_joint.hpp
// Joints whose motion others undo: two hinges about one axis with no inertia between them leave the equations of motion without an answer.
//
// Seen from the root, each joint must feel inertia while all those below it yield: d = S^T Pi S of the articulated inertia must be
// positive definite. In a generic pose, since many a wrist has dependent joints in its zero pose and in no other.
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.2
#pragma once

#include "layout/model.hpp"

namespace linden {

/// Slot of a joint that moves nothing which joints below it do not move in the same way; 0: there is none. Where every body resists its
/// own joint by itself there is nothing to look for.
Index dependent_joint(const Model& model);

}  // namespace linden
