// engine/scene/scene_couplings.hpp
// The couplings of a scene: ties between links that the tree does not know of, which close its loops.
//
//   couplings:
//     - {type: hinge, between: [rocker, frame], point: [1, 0, 0], axis: [0, 1, 0]}     # in the world while all coordinates are zero
//     - {type: rod, between: [a, b], points: [[0, 0, 0], [0, 0, 1]], length: 0.5}      # of each link; without length: as they start
//     - {type: weld, between: [a, world], frames: [{position: [0, 0, 1]}, {position: [2, 0, 0], rotation: [0, 0, 1.57]}]}
//     - {type: cable, name: rope, between: [world, boom, load], points: [[0, 0, 2], [1, 0, 0], [0, 0, 0]], length: 3, stiffness: 1e4, damping: 50}
//     - {type: gear, joints: {left: 1, right: -2}, offset: 0}                          # sum of ratio x coordinate + offset = 0
//
//   type     ball, hinge, universal, cylindrical, slider, weld, point_on_line, point_on_plane, rod, gear, cable (layout/couplings.hpp)
//   name     for messages and reports; "hinge of rocker and frame" where none is given, which a cable has to have
#pragma once

#include "engine/scene/scene_yaml.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct SceneCouplings {
  Model model;
  Effects ends;  // of cables, where they are taut: limits, and springs with dead zones
};

/// The model with the couplings of a list. Throws InputError with file, line and advice.
SceneCouplings read_couplings(const SceneValue& at, Model model);

}  // namespace linden
