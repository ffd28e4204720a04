// engine/randomization.hpp
// What differs from one instance of a scene to the next beside its start, each drawn uniformly from a range.
//
//   masses          a factor for each body, of its mass, first moment and inertia alike
//   friction        Coulomb's coefficient of the ground, one value
//   joint_friction  a factor for each joint that has friction
//   gains           a factor for each servo, of stiffness and damping alike; what it feeds forward and its limit of force stay
//
// What is drawn goes by the seed alone: each quantity has a stream of its own, none of them that of a random start
// (engine/initial_state.hpp), so that neither another range nor the number of instances changes a draw.
//
//   const Randomization ranges{.masses = Range{0.8, 1.2}};
//   for (std::int64_t i = 0; i < batch.size(); ++i) apply(draw(ranges, batch.model(), effects, 1 + i), effects, batch, i);  // then reset
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct Scene;
template <class Real>
class BatchOf;

struct Range {
  double low, high;
  bool operator==(const Range&) const = default;
};

/// Nothing where all instances are as the model and the effects have it.
struct Randomization {
  std::optional<Range> masses{};          // factors
  std::optional<Range> friction{};        // Coulomb's coefficient
  std::optional<Range> joint_friction{};  // factors
  std::optional<Range> gains{};           // factors

  bool any() const { return masses || friction || joint_friction || gains; }
};

/// What they are called in scenes and on command lines.
std::span<const std::string> randomized_names();

/// Sets the range of what is called `name`: from one number p, 0 <= p < 1, factors from 1 - p to 1 + p, of the ground's friction those of the
/// effects' coefficient; from two, low and high. Throws InputError for a range that makes no sense (a mass is above zero, the others not
/// below it), and where the effects have none of what it is of.
void set_range(Randomization& randomization, const std::string& name, std::span<const double> numbers, const Effects& effects);

/// "masses ±20 %, ground friction 0.4 to 1, gains times 0.5 to 2"
std::string randomization_text(const Randomization& randomization);

/// Of one instance; empty, or none, where nothing was to be drawn.
struct DrawnNumbers {
  std::vector<double> mass_factors;            // [bodies]: of slots 1, 2, ...
  std::optional<double> ground_friction{};
  std::vector<double> joint_friction_factors;  // in the order of Effects::friction
  std::vector<double> gain_factors;            // in the order of Effects::servos
  bool operator==(const DrawnNumbers&) const = default;
};

DrawnNumbers draw(const Randomization& randomization, const Model& model, const Effects& effects, std::uint64_t seed);

/// Makes model and effects those of the instance, for a Simulation.
void apply(const DrawnNumbers& drawn, Model& model, Effects& effects);

/// Makes instance i that one, before its reset. effects: as the batch was made with. Once it was called for one instance several threads may
/// call it for different ones at once.
template <class Real>
void apply(const DrawnNumbers& drawn, const Effects& effects, BatchOf<Real>& batch, std::int64_t i);

/// The scene with model and effects as its own seed draws them, and nothing left to draw.
Scene drawn(Scene scene);

}  // namespace linden
