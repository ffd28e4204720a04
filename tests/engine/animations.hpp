// Animations that tests look at: real motions with a drawing made by hand, and where the engine has the bodies.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "engine/queries/link_motion.hpp"
#include "engine/view/animation.hpp"
#include "tests/engine/scenes.hpp"

namespace linden {

/// A cube from -0.5 to 0.5, with a normal for each corner of each face.
inline TriangleMesh cube_mesh() {
  TriangleMesh mesh;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
      for (const auto& [u, v] : {std::pair{-0.5F, -0.5F}, {0.5F, -0.5F}, {0.5F, 0.5F}, {-0.5F, 0.5F}}) {
        std::array<float, 3> corner{}, normal{};
        corner[axis] = side / 2;
        corner[(axis + 1) % 3] = u * side;  // counter-clockwise seen from outside on both sides
        corner[(axis + 2) % 3] = v;
        normal[axis] = side;
        mesh.positions.insert(mesh.positions.end(), corner.begin(), corner.end());
        mesh.normals.insert(mesh.normals.end(), normal.begin(), normal.end());
      }
      for (const std::uint32_t corner : {0U, 1U, 2U, 0U, 2U, 3U}) mesh.indices.push_back(first + corner);
    }
  }
  return mesh;
}

/// A single triangle in the plane z = 0, seen from above, with corners at the origin, x = 1 and y = 1.
inline TriangleMesh triangle_mesh() { return {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 0, 1, 0, 0, 1, 0, 0, 1}, {0, 1, 2}}; }

/// Numbers of a pose as an animation has them.
inline void append_pose(Animation& animation, const Pose& pose) {
  const std::array<double, 7> numbers = position_and_quaternion(pose);
  for (const std::size_t k : {3U, 4U, 5U, 6U, 0U, 1U, 2U}) animation.poses.push_back(static_cast<float>(numbers[k]));
}

struct RealMotion {
  Animation animation;
  std::vector<Pose> poses;  // [frames x instances x bodies] of the engine
};

/// So many instances of a model from random states, a frame each 1/60 s; a box a body.
inline RealMotion motion_of(const Model& model, std::int64_t instances, std::size_t frames) {
  RealMotion motion;
  Animation& animation = motion.animation;
  animation.title = model.names.model;
  animation.instances = instances;
  animation.drawing.meshes = {cube_mesh()};
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) {
    const auto s = static_cast<std::size_t>(slot);
    animation.bodies.push_back(model.names.body[s]);
    animation.joints.push_back(model.names.joint[s]);
    animation.parents.push_back(model.tree.parent(slot) - 1);
    animation.drawing.parts.push_back({.link = model.names.body[s], .slot = slot, .mesh = 0, .pose = {}, .scale = {0.1, 0.05, 0.05}});
  }
  std::vector<Simulation> simulations;
  for (std::int64_t instance = 0; instance < instances; ++instance) {
    simulations.emplace_back(model, Options{.step = 1.0 / 240});
    random_start(simulations.back(), static_cast<std::uint64_t>(instance + 1), 0.5);
  }
  for (std::size_t frame = 0; frame < frames; ++frame) {
    animation.times.push_back(simulations.front().time());
    for (Simulation& simulation : simulations) {
      const Kinematics now(simulation);
      for (Index slot = 1; slot < model.tree.shape.slots; ++slot) {
        motion.poses.push_back(link_pose(now, {slot, Pose{}}));
        append_pose(animation, motion.poses.back());
      }
      run(simulation, 4);
    }
  }
  return motion;
}

/// One body with a cube that stands still at the origin.
inline Animation still_body(std::size_t frames = 3) {
  Animation animation;
  animation.title = "still";
  animation.bodies = {"body"};
  animation.joints = {"joint"};
  animation.parents = {-1};
  animation.drawing.meshes = {cube_mesh()};
  animation.drawing.parts = {{.link = "body", .slot = 1, .pose = {}}};
  for (std::size_t frame = 0; frame < frames; ++frame) {
    animation.times.push_back(0.5 * static_cast<double>(frame));
    append_pose(animation, {});
  }
  return animation;
}

/// Names that somebody may have meant to do harm with.
inline Animation hostile_names() {
  Animation animation = still_body();
  animation.title = "</script><script>alert(1)</script>";
  animation.bodies[0] = std::string("a\0b\n\x1b[31m\x7f\xc2\x85\"\\ ", 15) + "\xff\xc0\xaf\xed\xa0\x80\xf0\x9f";
  animation.drawing.parts[0].link = "gr\xc3\xbc\xc3\x9f \xe2\x9c\x93 \xf0\x9f\xa6\xbe '; --";
  animation.drawing.parts.push_back({.link = std::string(100'000, '\xff'), .slot = 1, .pose = {}});
  animation.drawing.parts.push_back({.link = "", .slot = 1, .pose = {}});
  return animation;
}

inline void set_pose(Animation& animation, std::size_t frame, std::array<float, 4> rotation, std::array<float, 3> place = {}) {
  float* pose = animation.poses.data() + animation.pose_at(frame, 0, 0);
  std::copy(place.begin(), place.end(), std::copy(rotation.begin(), rotation.end(), pose));
}

}  // namespace linden
