// engine/scene/scene.hpp
// All that a simulation is: model, effects, start, how to step, for how long. A plain value, built in C++ or read from a YAML file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/initial_state.hpp"
#include "engine/options.hpp"
#include "engine/randomization.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct Scene {
  Model model;
  Options options;        // step, gravity, solver, tolerance
  double duration = 10;   // [s]
  InitialState initial;   // positions [nq], velocities [nv]; empty: at rest in the zero configuration
  Effects effects;
  std::vector<std::string> files{};  // that it was read from: scene, models, meshes, tables
  bool start_as_given = false;       // begins wherever `initial` says: no look at limits, ties and ground (engine/start_check.hpp)
  bool gravity_named = true;         // whether to have gravity or none was decided; a scene file may not say
  Randomization randomization{};     // what instances differ in
  std::uint64_t seed = kDefaultSeed;  // of what is drawn of it where there is one instance
};

}  // namespace linden
