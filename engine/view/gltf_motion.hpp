// engine/view/gltf_motion.hpp
// The motion of an animation as glTF has it: which frames, which bodies move at all, and numbers that readers can interpolate.
#pragma once

#include <array>
#include <vector>

#include "engine/view/animation.hpp"

namespace linden {

/// A body of an instance over all frames.
struct GltfTrack {
  std::array<float, 4> rotation{0, 0, 0, 1};  // at the first frame: unit quaternion x y z w
  std::array<float, 3> place{};               // [m]
  bool turns = false, shifts = false;         // whether they change
};

struct GltfMotion {
  std::vector<std::size_t> frames;  // of the animation that are written
  std::vector<float> times;         // of each since the first [s], strictly rising
  std::vector<GltfTrack> tracks;    // [instances x bodies]
};

/// Throws std::runtime_error for what cannot be written (engine/view/gltf.hpp). cost  once over all poses.
GltfMotion gltf_motion_of(const Animation& animation);

/// Unit quaternions of a body at all frames of the motion, each with the sign that is nearer to the one before.
std::vector<std::array<float, 4>> rotations_of(const Animation& animation, const GltfMotion& motion, std::size_t track);
std::vector<std::array<float, 3>> places_of(const Animation& animation, const GltfMotion& motion, std::size_t track);

}  // namespace linden
