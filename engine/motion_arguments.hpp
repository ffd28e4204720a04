// engine/motion_arguments.hpp
// What every command that moves a model is told - which model, how long, how, from where - and how it is said to people.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "engine/options.hpp"
#include "layout/effects.hpp"
#include "layout/urdf.hpp"

namespace linden {

struct MotionArguments {
  std::string model;
  std::optional<Base> base;
  double duration = 10;  // [s]
  std::optional<std::uint64_t> seed;
  std::optional<double> spread;
};

/// Seed and spread as they are used; nothing where neither was given.
struct Randomness {
  std::uint64_t seed;
  double spread;
};
std::optional<Randomness> randomness(const MotionArguments& arguments);

/// Throws InputError for a spread that makes no sense.
void check_spread(double spread);

/// Steps that the duration is. Throws InputError for a duration or a spread that makes no sense.
std::int64_t step_count(const MotionArguments& arguments, double step);

/// "humanoid (models/humanoid.urdf): 35 bodies, 40 degrees of freedom, 75 kg, floating base"
std::string model_text(const MotionArguments& arguments, const Model& model);
/// "gravity 0 0 -9.81 m/s^2", "no gravity"
std::string gravity_text(const Options& options);

/// What the model's file says of its joints and no effect takes up.
struct LeftOut {
  int limits = 0, damping = 0, friction = 0;
  explicit LeftOut(const Model& model, const Effects& effects = {});
  /// Empty where there is nothing.
  std::string text() const;
};

}  // namespace linden
