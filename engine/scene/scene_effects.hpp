// engine/scene/scene_effects.hpp
// A scene's key `effects`: from names and numbers to rows and slots. What is not named is not there.
//
//   gravity    [x, y, z]
//   armature   number (every screw joint) | {joint: number}
//   damping    urdf | number (every screw and ball joint) | {joint: number}
//   friction   urdf | number (every screw joint) | {joint: number}
//   spring     {joint: {stiffness, rest: number, or of a ball joint quaternion}}
//   dead_zone_spring  {joint: {stiffness, half_width, rest, damping}}
//   limits     urdf | {restitution, velocity: urdf | number} (all of the URDF's; a number on every screw joint)
//               | {joint: urdf | {lower, upper, restitution, velocity}}
//   servo      {stiffness, damping, max_force: urdf | none | number, targets, velocities, feedforward: {joint: over time},
//               joints: [joint, ...] | {joint: {stiffness, damping, target, target_velocity, feedforward, max_force}}}
//   torque     {joint: over time};  over time: number | FILE.csv | {times, values}
//   wrench     {link: {force, moment, point, frame: world | body, from, to, file}, or a list of such}
//   drag       {linear, quadratic, wind, bodies: {link: {linear, quadratic}}}
//   ground     {normal, height, stiffness, damping, friction, terrain: {file, spacing, origin}}
//   contact    {stiffness, damping, friction, restitution, rolling_friction, torsional_friction, between: [{links, those}],
//               pairs: [[link, link], ...], or except: likewise, srdf: FILE}
//
// A servo acts on every screw joint; on those that `joints` names where it is a list, or a map without a `stiffness` beside it. Targets
// are the positions at the start where none are given; a target that moves has no velocity but the one given for it. Limits of velocity
// are none but those that are named: `limits: urdf` means positions.
// Mimic joints: armature, damping, friction and limits of a follower act on its leader; springs, servo, torque and motion refuse it.
// Free joints have none of these, ball joints damping and spring only. A link that is merged into another's body acts there.
// CSV files are found relative to the scene: time,value a line for torque, servo, motion
// (also time,position,velocity) and wrench (there a share of force and moment).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/scene/scene_yaml.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct SceneEffects {
  Effects effects;
  std::array<double, 3> gravity{};
  std::vector<std::string> warnings;  // what was named and does nothing
};

/// Names of the effects that a scene can have.
const std::vector<std::string>& effect_keys();

/// Of these the limits alone, which random starts keep; what is wrong in the rest is not looked at.
std::vector<JointLimit> read_limits(const SceneValue& at, const Model& model);

/// `start`: positions [nq] that servos hold where no target is given; `folder`: of the scene, empty for the current one. Throws
/// InputError with file and line.
SceneEffects read_effects(const SceneValue& at, const Model& model, const std::vector<double>& start, const std::string& folder);

}  // namespace linden
