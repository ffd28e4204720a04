// engine/scene/scene_start.hpp
// Where a scene's motion begins: its key `initial`, and the poses of floating models.
//
//   base       {position, rotation: [roll, pitch, yaw] or quaternion: [x, y, z, w], velocity, angular_velocity} of the one floating
//              base, all in the world's frame
//   positions  {joint: number, or of a ball joint quaternion}
//   velocities {joint: number, or of a ball joint three, in the body's frame}
//   seed, spread  start from random positions and speeds (engine/initial_state.hpp); what is named above goes over them
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/initial_state.hpp"
#include "engine/scene/scene_yaml.hpp"

namespace linden {

struct SceneStart;

/// Pose and velocity of a base in the world, as far as they are given.
struct BaseStart {
  std::optional<std::array<double, 3>> position;  // [m]
  std::optional<std::array<double, 4>> rotation;  // quaternion x y z w
  std::optional<std::array<double, 3>> velocity, angular_velocity;  // [m/s, rad/s]

  Pose pose() const;
};

/// Reads what there is of the keys of a base.
BaseStart read_base(const SceneValue& at);

/// A root on a free joint that a scene puts somewhere.
struct PlacedBase {
  std::string joint;  // couplings may add bodies before: a slot would be another's then
  BaseStart start;
};

/// Slots of the free joints that hang on the world.
std::vector<Index> floating_roots(const Model& model);

/// The seed that a scene or a command line names.
std::optional<std::uint64_t> read_seed(const std::optional<SceneValue>& at, const SceneStart& given);

/// `at`: the scene's `initial`, where it has one; `limits`: in effect, which random positions keep. Throws InputError with file and line.
InitialState read_start(const std::optional<SceneValue>& at, const Model& model, const std::vector<PlacedBase>& bases,
                        const SceneStart& given, std::span<const JointLimit> limits = {});

}  // namespace linden
