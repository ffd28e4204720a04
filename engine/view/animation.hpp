// engine/view/animation.hpp
// A motion to be looked at: what there is to see, and where it is in every frame. The page (engine/view/page.hpp) and the glTF file
// (engine/view/gltf.hpp) are written from it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/view/drawing.hpp"

namespace linden {

/// A number over time, drawn as a curve.
struct Curve {
  std::string group;          // that it is shown in: "position", "velocity", "force", "energy", or an observation's name
  std::string name;           // "left_knee"
  std::string unit;           // "rad"; may be empty
  Index slot = -1;            // body whose joint it belongs to; -1: none
  std::int64_t instance = 0;
  std::vector<float> values;  // [frames]; NaN where there is none
};

/// A place where something pushes a body.
struct DrawnForce {
  std::int64_t instance = 0;
  Index slot = 0;                 // body that it pushes
  std::array<float, 3> place{};   // world frame [m]
  std::array<float, 3> force{};   // world frame [N]
};

/// A cable, a spring or a rod: straight from point to point.
struct DrawnLine {
  struct Point {
    Index slot = 0;                // body that it is on; 0: the world
    std::array<float, 3> place{};  // in the frame that `poses` has [m]
  };
  std::string name;
  std::vector<Point> points;  // two or more
};

struct Animation {
  std::string title;
  std::vector<std::string> notes;    // what is left out, and why: sentences for people
  std::vector<std::string> bodies;   // [bodies]  name of each; body b is slot b + 1
  std::vector<std::string> joints;   // [bodies]  that carries it
  std::vector<Index> parents;        // [bodies]  body that carries it; -1: the world
  Drawing drawing;                   // whose parts are in the frames that `poses` has
  std::vector<DrawnLine> lines;
  std::int64_t instances = 1;
  std::vector<double> times;         // [frames, s], rising
  std::vector<float> poses;          // [frames x instances x bodies x 7]  quaternion x y z w, place [m]: frame of the link at the body's
                                     // joint, as the robot's file has it, in the world's
  std::vector<Curve> curves;
  std::vector<std::vector<DrawnForce>> forces;  // [frames]

  std::size_t frames() const { return times.size(); }
  std::size_t pose_at(std::size_t frame, std::int64_t instance, std::size_t body) const {
    return ((frame * static_cast<std::size_t>(instances) + static_cast<std::size_t>(instance)) * bodies.size() + body) * 7;
  }
};

}  // namespace linden
