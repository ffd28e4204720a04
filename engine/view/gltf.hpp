// engine/view/gltf.hpp
// An animation as a binary glTF 2.0 file (.glb), which Blender, game engines and web pages open: meshes, colours and the motion in one.
//
//   write_file("humanoid.glb", glb_of(animation));          engine/files/output_file.hpp
//
//   node                     child of       what it does
//   "world, z up"            -              turns z up, as everywhere in linden, to y up, as glTF has it: (x, y, z) -> (x, z, -y)
//   title; "instance 0" ...  world          nothing: all instances are where the motion has them. Who moves this node moves one as a whole
//   a body's name            its instance   the body's frame in the world, animated; a body that never moves has its place and no channel
//   "LINK visual",           its body       pose and scale of a part on its body, with its mesh. What is fixed to the world (slot 0) is a
//   "LINK collision 2" ...                  child of the instance itself
//   "LINK ground"            world          ground and terrain, once for all instances
//
// Where there are several instances the names of their nodes begin with the instance's number, from 0 as everywhere: "3 left_knee".
//
// The tree of nodes is four deep, whatever the model: bodies are no children of those that carry them. No error adds up along a chain of
// 10,000 links, the file says where each body is without any sum, and no reader goes 10,000 calls deep.
//
//   units       metres and seconds, as glTF has them; the first frame is at 0
//   precision   at the frames a pose is that of the animation: its floats, quaternions scaled to unit length (6e-8 a number). Between
//               frames readers take places along lines and rotations along arcs (LINEAR). A quaternion has the sign that is nearer to the
//               one before, so that no body turns the long way round
//   times       floats: a frame that they do not tell from the one before (1e-5 s apart after three minutes) is left out
//   parts       of the layers visual and ground; the others where they are asked for. Parts of one mesh and colour share a glTF mesh, parts
//               of one mesh its numbers in any case. What has no triangles is not drawn. A negative scale mirrors, and readers turn the
//               triangles of such a node round
//   colours     a material each: not metallic, roughness 0.6, seen from both sides; from sRGB to linear; blended where the opacity is below 1
//   names       text and nothing else; control characters and bytes that are no UTF-8 are U+FFFD
//   size        28 bytes a body and frame, 16 or 12 where it only turns or only shifts
//
// Blender turns y up back to z up: places there are those of the engine, and the axes of an object are x, -z and y of its body.
//
// Nothing beyond the core of glTF is written: no extensions, and so no curves and no forces.
//
// source  Khronos Group, glTF 2.0 Specification: 3.3 and 3.4 (axes, units), 3.5.3 (transformations), 3.6.2 (accessors, alignment), 3.7.4
//         (winding of what is mirrored), 3.9 (materials), 3.11 and appendix C (animation), 4 (GLB)
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "engine/view/animation.hpp"

namespace linden {

struct GltfOptions {
  bool collision = false, inertia = false;  // layers that are written too
  /// Of the file; the format knows no larger ones.
  std::uint64_t most_bytes = std::numeric_limits<std::uint32_t>::max();
};

/// The bytes of the file. Throws std::runtime_error for poses that are not finite (the message names body and time), times that fall, no
/// frame at all, arrays that do not fit together, and what would be larger than most_bytes; the last before the memory for it is taken.
/// cost  twice over all poses; memory of the file and its JSON, once each.
std::string glb_of(const Animation& animation, const GltfOptions& options = {});

}  // namespace linden
