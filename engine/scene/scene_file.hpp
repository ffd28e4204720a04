// engine/scene/scene_file.hpp
// Scenes as YAML files: model, base, start, step, duration, solver and effects.
//
//   model: humanoid.urdf       # a URDF file, found relative to the scene, or chain:N and its like
//   base: floating
//   duration: 10
//   initial: {base: {position: [0, 0, 1.2]}, positions: {left_elbow: 0.4}}
//   effects:
//     gravity: [0, 0, -9.81]
//     damping: urdf
//
//   model | models   one of them. models: a list of {model, base, name, position, rotation or quaternion, velocity,
//                    angular_velocity}; several are one system, links and joints of each called name/link and name/joint, where
//                    the name is the model's own unless it is given
//   world            shapes that stand in the world and that bodies touch (engine/scene/scene_world.hpp)
//   inertia          {density: kg/m^3}, beside model or beside each of models: mass of links that have shapes and no <inertial>
//   base             fixed (default) or floating, for a URDF file
//   step, duration, solver, guess, tolerance, stop, max_iterations, max_splits, order   as engine/options.hpp; where no
//                    tolerance is given it goes with the order
//   initial          engine/scene/scene_start.hpp
//   start            checked (default): a start outside limits, against ties or in the ground is refused where it begins to move
//                    (engine/start_check.hpp); as given: it begins there all the same
//   effects          engine/scene/scene_effects.hpp; gravity is one of them: without its key there is none
//   randomize        {masses, friction, joint_friction, gains}, each p or [low, high]: what is drawn for each instance of a rollout, uniformly
//                    and by its seed, and for the one of a run by the seed of `initial` (engine/randomization.hpp). p is a factor from 1 - p
//                    to 1 + p; [low, high] are factors too, of `friction`, which is the ground's, values
//
// A program says the same by values of its own (scene_of), and may bring the model.
//
// A floating model starts at its position and rotation, a fixed one sits there.
// Whatever is wrong - a key or a name that is not known, a value of the wrong kind or one that makes no sense - throws InputError
// with file, line and advice.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "engine/scene/scene.hpp"

namespace linden {

struct YamlNode;  // engine/scene/scene_yaml.hpp

/// What a command line may say instead of the scene.
struct SceneStart {
  std::optional<std::uint64_t> seed;
  std::optional<double> spread;
  std::optional<double> density{};  // of links without inertia [kg/m^3], of all models that are URDF files
};

/// Whether the name is that of a scene: it ends in .yaml or .yml.
bool is_scene(const std::string& file);

/// Whether the name is a generated model that is nothing by itself (needs_contact): `linden run` and its like take it as load_scene does, with
/// gravity and contact.
bool is_generated_scene(const std::string& name);

/// Reads a scene, or makes a generated one; what could be named and does nothing is in its model's warnings. `given` goes over what the scene says.
Scene load_scene(const std::string& file, const SceneStart& given = {});

/// The same from memory; `file` stands for the source, and the files that the scene names are found relative to it.
Scene parse_scene(const std::string& text, const std::string& file, const SceneStart& given = {});

/// The same of values that no file holds: files that they name are found relative to the current folder. With a model given they are all that a
/// scene says beside model and base.
Scene scene_of(std::shared_ptr<const YamlNode> values, std::optional<Model> model = std::nullopt, const SceneStart& given = {});

}  // namespace linden
