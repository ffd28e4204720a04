// How far rows of couplings that give way, and joints, move by an impulse along them: what tells a spring that a step resolves from one that it does
// not (kernels/couplings/compliance.hpp, kernels/effects/dead_zone_spring.hpp).
//
//   row      y = G M^-1 G^T
//   joint    y = e^T M^-1 e, couplings that are rigid closed: the length of a cable moves what the cable does
//
// and the most of it in a few configurations: the zero one and some in which all joints are turned at random.
//
// Of rows those that are rigid are left out, as if mechanisms were open. The most, since a row may not move at all in one configuration, a spring along
// a bar that turns about its end, and far in others. The free bodies that scale rows of multipliers (coupling_sweeps.hpp) will not do here: a bar of
// no thickness on a hinge yields thousands of times less than it would were it free, and a damper on it was taken for one that no step resolves.
//
// cost    a factor of the tree and one of the rows each, once for a model and its armature; of a joint one solve more
#pragma once

#include <span>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

/// Of each row of the model's couplings; empty where none gives way.
std::vector<double> row_yields(const Model& model, std::span<const Armature> rotors);

/// Of these velocity rows, none of them a follower's [rad/(N m s), m/(N s)]; empty where there are none.
std::vector<double> joint_yields(const Model& model, std::span<const Armature> rotors, std::span<const Index> rows);

}  // namespace linden
