// engine/scene/scene_world.hpp
// Shapes that stand in the world: a scene's key `world`, a list of
//
//   {type: box, size: [x, y, z]}
//   {type: sphere, radius}
//   {type: ellipsoid, radii: [a, b, c]}                                 semi-axes along x, y, z
//   {type: cylinder, radius, length}, {type: capsule, radius, length}   along z; a capsule's from the centre of one round end to the other's
//   {type: mesh, file, scale: [x, y, z]}                                its convex hull; the file is found relative to the scene
//   {type: plane, normal: [x, y, z], height}                            all that is below it, without end; or with a position, of a point of it, and
//                                                                       with a rotation or quaternion, which turns z into the normal
//   {type: heights, file, spacing: [dx, dy], origin: [x, y]}            all that lies below a height field, z up (scene_heights.hpp)
//
// each with a name (its type and its place in the list, box_1, where it is not given), a position [m] and a rotation or quaternion of its middle, of
// a mesh of its origin. Links of the world, called world/NAME (models/build/world_shapes.hpp).
#pragma once

#include <string>

#include "engine/scene/scene_yaml.hpp"
#include "layout/model.hpp"

namespace linden {

/// The model with these. Throws InputError with file and line.
Model read_world(const SceneValue& at, Model model, const std::string& folder);

}  // namespace linden
