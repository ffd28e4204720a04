// engine/program/motion_arguments.hpp
// What a command is told of the model or scene it is for, and, if it moves it, how long and from where; and how that is said to people.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "engine/files/output_file.hpp"
#include "engine/options.hpp"
#include "engine/scene/scene.hpp"
#include "models/urdf/urdf.hpp"

namespace linden {

struct ModelArguments {
  std::string model;  // as it was given: a file, a generator with its size, a scene
  std::optional<Base> base;
  std::optional<double> density;  // of links without inertia [kg/m^3]
  bool strict = false;  // a model that gives warnings is refused
  std::shared_ptr<const Scene> scene;  // that `model` names; null: it names a model

  Effects effects() const { return scene ? scene->effects : Effects(); }
  /// The scene's model, or the one that `model` names. Throws InputError, also where one of the outputs is a file that it is read from.
  std::shared_ptr<const Model> loaded(const Outputs& outputs) const;
};

struct MotionArguments : ModelArguments {
  double duration = 10;  // [s]
  std::optional<std::uint64_t> seed;
  std::optional<double> spread;
  bool start_as_given = false;  // no start is refused
  bool gravity_given = false;   // beside the scene
  Randomization randomization{};  // the scene's, and what the command line has over it
};

/// Seed and spread as they are used; nothing where neither was given.
struct Randomness {
  std::uint64_t seed;
  double spread;
};
std::optional<Randomness> randomness(const MotionArguments& arguments);

/// Which draws what is randomised of one instance: the command line's, or the scene's.
std::uint64_t drawing_seed(const MotionArguments& arguments);

/// "at rest in the zero configuration", "as the scene says, from random positions and speeds, seed 1, spread 0.1"
std::string start_text(const MotionArguments& arguments);

/// Throws InputError for a spread that makes no sense.
void check_spread(double spread);

/// Steps that the duration is. Throws InputError for a duration or a spread that makes no sense.
std::int64_t step_count(const MotionArguments& arguments, double step);

/// "humanoid (models/humanoid.urdf): 35 bodies, 40 degrees of freedom, 75 kg, floating base"
std::string model_text(const ModelArguments& arguments, const Model& model);
/// "gravity 0 0 -9.81 m/s^2", "no gravity"
std::string gravity_text(const Options& options);

/// What the model's file says of its joints and no effect takes up.
struct IgnoredByScene {
  int limits = 0, damping = 0, friction = 0;
  int velocity_limits = 0;  // where limits of positions act alone
  explicit IgnoredByScene(const Model& model, const Effects& effects = {});
  /// Empty where there is nothing.
  std::string text() const;
};

}  // namespace linden
