// models/build/dependent_joint.hpp
// Joints whose motion others undo: two hinges about one axis with no inertia between them leave the equations of motion without an answer.
//
// Seen from the root, each joint must feel inertia while all those below it yield: d = S^T Pi S of the articulated inertia must be
// positive definite. In a generic pose, since many a wrist has dependent joints in its zero pose and in no other.
//
// Joints that mimics tie are one coordinate Z_c and need not resist by themselves. They are held while the others are looked at; then
// Z^T (M - what the others yield) Z must be positive definite, a number a pair of coordinates (kernels/tree/mimic.hpp solves by the same parts).
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.2, 8.2
#pragma once

#include "layout/model.hpp"

namespace linden {

/// Slot of a joint that moves nothing which others do not move in the same way, of a coordinate its leader; 0: there is none. Where every
/// body resists its own joint by itself there is nothing to look for.
Index dependent_joint(const Model& model);

}  // namespace linden
