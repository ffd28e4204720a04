#include "engine/view/gltf_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>

#include "layout/support/words.hpp"

namespace linden {
namespace {

using Quaternion4 = std::array<float, 4>;
using PoseNumbers = std::span<const float, 7>;

double squared_length(PoseNumbers pose) {
  return std::inner_product(pose.begin(), pose.begin() + 4, pose.begin(), 0.0);
}

Quaternion4 unit_quaternion(PoseNumbers pose) {
  const double scale = 1 / std::sqrt(squared_length(pose));
  Quaternion4 unit;
  std::ranges::transform(pose.first<4>(), unit.begin(), [&](float number) { return static_cast<float>(scale * number); });
  return unit;
}

/// The same rotation, whichever of its two quaternions stands there.
bool same_rotation(PoseNumbers a, PoseNumbers b) {
  return std::ranges::equal(a.first<4>(), b.first<4>()) || std::ranges::equal(a.first<4>(), b.first<4>(), {}, std::negate{});
}

PoseNumbers pose_of(const Animation& animation, std::size_t frame, std::size_t track) {
  const std::size_t tracks = static_cast<std::size_t>(animation.instances) * animation.bodies.size();
  return PoseNumbers(animation.poses.data() + (frame * tracks + track) * 7, 7);
}

void require_fitting_arrays(const Animation& animation) {
  const std::size_t frames = animation.frames();
  if (frames == 0) throw std::runtime_error("a glTF file is to be written of a motion without frames: expected one at least");
  const std::size_t tracks = static_cast<std::size_t>(std::max<std::int64_t>(0, animation.instances)) * animation.bodies.size();
  if (animation.instances < 0 || animation.poses.size() != frames * tracks * 7) {
    throw std::runtime_error(
        fmt::format("a motion has {} numbers for its poses: expected 7 for each of {} frames, {} instances and {} bodies",
                    animation.poses.size(), frames, animation.instances, animation.bodies.size()));
  }
}

/// Frames, and times as floats that rise.
void choose_frames(const Animation& animation, GltfMotion& motion) {
  const std::vector<double>& times = animation.times;
  for (std::size_t frame = 0; frame < times.size(); ++frame) {
    if (!std::isfinite(times[frame]) || (frame > 0 && times[frame] < times[frame - 1])) {
      throw std::runtime_error(fmt::format("frame {} of a motion is at {} s{}: expected times that rise", frame, times[frame],
                                           frame > 0 ? fmt::format(" and the one before at {} s", times[frame - 1]) : ""));
    }
    const auto time = static_cast<float>(times[frame] - times[0]);
    if (frame > 0 && time <= motion.times.back()) continue;
    motion.frames.push_back(frame);
    motion.times.push_back(time);
  }
}

void require_pose(const Animation& animation, std::size_t frame, std::size_t track) {
  const PoseNumbers pose = pose_of(animation, frame, track);
  if (std::ranges::all_of(pose, [](float number) { return std::isfinite(number); }) && squared_length(pose) > 0) return;
  const std::size_t body = track % animation.bodies.size();
  const std::string instance = animation.instances > 1 ? fmt::format(" of instance {}", track / animation.bodies.size()) : "";
  throw std::runtime_error(
      fmt::format("the pose of {}{} at {} s is quaternion {}, place {}: expected finite numbers and a quaternion that is not zero; write "
                  "the motion up to the frame before",
                  quoted(animation.bodies[body]), instance, animation.times[frame], fmt::join(pose.first<4>(), " "),
                  fmt::join(pose.last<3>(), " ")));
}

}  // namespace

GltfMotion gltf_motion_of(const Animation& animation) {
  require_fitting_arrays(animation);
  GltfMotion motion;
  choose_frames(animation, motion);
  motion.tracks.resize(static_cast<std::size_t>(animation.instances) * animation.bodies.size());
  for (const std::size_t frame : motion.frames) {
    for (std::size_t track = 0; track < motion.tracks.size(); ++track) {
      require_pose(animation, frame, track);
      const PoseNumbers pose = pose_of(animation, frame, track), first = pose_of(animation, 0, track);
      GltfTrack& seen = motion.tracks[track];
      if (frame == 0) {
        seen.rotation = unit_quaternion(pose);
        std::ranges::copy(pose.last<3>(), seen.place.begin());
      }
      seen.turns |= !same_rotation(pose, first);
      seen.shifts |= !std::ranges::equal(pose.last<3>(), first.last<3>());
    }
  }
  return motion;
}

std::vector<std::array<float, 4>> rotations_of(const Animation& animation, const GltfMotion& motion, std::size_t track) {
  std::vector<Quaternion4> rotations;
  rotations.reserve(motion.frames.size());
  for (const std::size_t frame : motion.frames) {
    Quaternion4 next = unit_quaternion(pose_of(animation, frame, track));
    if (!rotations.empty() && std::inner_product(next.begin(), next.end(), rotations.back().begin(), 0.0) < 0) {
      std::ranges::transform(next, next.begin(), std::negate{});
    }
    rotations.push_back(next);
  }
  return rotations;
}

std::vector<std::array<float, 3>> places_of(const Animation& animation, const GltfMotion& motion, std::size_t track) {
  std::vector<std::array<float, 3>> places(motion.frames.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    std::ranges::copy(pose_of(animation, motion.frames[k], track).last<3>(), places[k].begin());
  }
  return places;
}

}  // namespace linden
