#include "engine/randomization.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/batch.hpp"
#include "engine/scene/scene.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/build/random.hpp"

namespace linden {
namespace {

/// How one quantity is called, where it stands, and what it is of.
struct Quantity {
  const char* label;  // in reports
  std::optional<Range> Randomization::*range;
  std::uint64_t stream;  // of its random numbers
  const char* needs;     // what has to be there
  const char* where;     // where that is written
};

const std::vector<std::string> kNames{"masses", "friction", "joint_friction", "gains"};
constexpr std::array<Quantity, 4> kQuantities{{{"masses", &Randomization::masses, 0x6d617373, "", ""},
                                               {"ground friction", &Randomization::friction, 0x67726e64, "ground", "effects.ground"},
                                               {"joint friction", &Randomization::joint_friction, 0x66726963, "joint friction", "effects.friction"},
                                               {"gains", &Randomization::gains, 0x6761696e, "servo", "effects.servo"}}};

bool is_there(const Quantity& quantity, const Effects& effects) {
  if (quantity.range == &Randomization::friction) return effects.ground.has_value();
  if (quantity.range == &Randomization::joint_friction) return !effects.friction.empty();
  return quantity.range != &Randomization::gains || !effects.servos.empty();
}

/// Random numbers of one quantity. Streams of neighbouring seeds have nothing in common.
Random stream(std::uint64_t seed, const Quantity& quantity) { return Random(Random(seed ^ (quantity.stream << 32)).next()); }

std::vector<double> drawn_factors(const Randomization& randomization, std::size_t which, std::size_t count, std::uint64_t seed) {
  std::vector<double> factors;
  const std::optional<Range>& range = randomization.*kQuantities[which].range;
  if (!range) return factors;
  Random random = stream(seed, kQuantities[which]);
  for (std::size_t k = 0; k < count; ++k) factors.push_back(random.uniform(range->low, range->high));
  return factors;
}

std::array<double, 10> scaled_inertia(const Model& model, Index slot, double factor) {
  std::array<double, 10> inertia;
  for (int k = 0; k < 10; ++k) inertia[static_cast<std::size_t>(k)] = factor * model.constants.inertia(slot, k);
  return inertia;
}

}  // namespace

std::span<const std::string> randomized_names() { return kNames; }

void set_range(Randomization& randomization, const std::string& name, std::span<const double> numbers, const Effects& effects) {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) {
    const std::string guess = nearest(name, kNames);
    throw InputError(fmt::format("{} is nothing that can be randomised; expected one of {}; {}", quoted(name), fmt::join(kNames, ", "),
                                 guess.empty() ? "leave it out" : fmt::format("did you mean {}?", guess)));
  }
  const Quantity& quantity = kQuantities[static_cast<std::size_t>(found - kNames.begin())];
  if (!is_there(quantity, effects)) {
    throw InputError(fmt::format("there is no {} whose numbers could be drawn; expected one; name it under {}, or leave {} out", quantity.needs,
                                 quantity.where, name));
  }
  Range range{};
  if (numbers.size() == 1) {
    const double p = numbers[0];
    if (!(p >= 0 && p < 1)) {
      throw InputError(fmt::format("the number {:g} is no spread; expected p from 0 to below 1, for factors from 1 - p to 1 + p; or write low "
                                   "and high",
                                   p));
    }
    const double middle = quantity.range == &Randomization::friction ? effects.ground->friction : 1;
    range = {middle * (1 - p), middle * (1 + p)};
  } else if (numbers.size() == 2) {
    range = {numbers[0], numbers[1]};
  } else {
    throw InputError(fmt::format("{} numbers are no range; expected one or two; write p, or low and high", numbers.size()));
  }
  const bool above_zero = quantity.range == &Randomization::masses ? range.low > 0 : range.low >= 0;
  if (!above_zero || !(range.low <= range.high) || !std::isfinite(range.high)) {
    throw InputError(fmt::format("the range from {:g} to {:g} makes no sense; expected finite numbers, {}, the lower one first; change them",
                                 range.low, range.high, quantity.range == &Randomization::masses ? "above zero" : "not below zero"));
  }
  randomization.*quantity.range = range;
}

std::string randomization_text(const Randomization& randomization) {
  std::vector<std::string> parts;
  for (const Quantity& quantity : kQuantities) {
    const std::optional<Range>& range = randomization.*quantity.range;
    if (!range) continue;
    const bool factors = quantity.range != &Randomization::friction;
    if (factors && std::abs(range->low + range->high - 2) < 1e-12) {
      parts.push_back(fmt::format("{} \u00b1{:.6g} %", quantity.label, 50 * (range->high - range->low)));
    } else {
      parts.push_back(fmt::format("{}{} {:.6g} to {:.6g}", quantity.label, factors ? " times" : "", range->low, range->high));
    }
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

DrawnNumbers draw(const Randomization& randomization, const Model& model, const Effects& effects, std::uint64_t seed) {
  DrawnNumbers drawn;
  drawn.mass_factors = drawn_factors(randomization, 0, static_cast<std::size_t>(model.tree.bodies()), seed);
  if (const std::vector<double> friction = drawn_factors(randomization, 1, 1, seed); !friction.empty()) drawn.ground_friction = friction[0];
  drawn.joint_friction_factors = drawn_factors(randomization, 2, effects.friction.size(), seed);
  drawn.gain_factors = drawn_factors(randomization, 3, effects.servos.size(), seed);
  return drawn;
}

void apply(const DrawnNumbers& drawn, Model& model, Effects& effects) {
  for (std::size_t k = 0; k < drawn.mass_factors.size(); ++k) {
    const Index slot = static_cast<Index>(k) + 1;
    const std::array<double, 10> inertia = scaled_inertia(model, slot, drawn.mass_factors[k]);
    for (int row = 0; row < 10; ++row) model.constants.inertia(slot, row) = inertia[static_cast<std::size_t>(row)];
  }
  if (!drawn.mass_factors.empty()) sum_subtree_masses(model.tree, model.constants);
  if (drawn.ground_friction) effects.ground->friction = *drawn.ground_friction;
  for (std::size_t k = 0; k < drawn.joint_friction_factors.size(); ++k) effects.friction[k].force *= drawn.joint_friction_factors[k];
  for (std::size_t k = 0; k < drawn.gain_factors.size(); ++k) {
    effects.servos[k].stiffness *= drawn.gain_factors[k];
    effects.servos[k].damping *= drawn.gain_factors[k];
  }
}

template <class Real>
void apply(const DrawnNumbers& drawn, const Effects& effects, BatchOf<Real>& batch, std::int64_t i) {
  for (std::size_t k = 0; k < drawn.mass_factors.size(); ++k) {
    const Index slot = static_cast<Index>(k) + 1;
    batch.set_inertia(i, slot, scaled_inertia(batch.model(), slot, drawn.mass_factors[k]));
  }
  if (drawn.ground_friction) batch.ground_friction()(i, 0) = static_cast<Real>(*drawn.ground_friction);
  for (std::size_t k = 0; k < drawn.joint_friction_factors.size(); ++k) {
    batch.friction()(i, static_cast<Index>(k)) = static_cast<Real>(effects.friction[k].force * drawn.joint_friction_factors[k]);
  }
  for (std::size_t k = 0; k < drawn.gain_factors.size(); ++k) {
    batch.gains()(i, static_cast<Index>(k)) = static_cast<Real>(drawn.gain_factors[k]);
  }
}

template void apply(const DrawnNumbers& drawn, const Effects& effects, BatchOf<double>& batch, std::int64_t i);
template void apply(const DrawnNumbers& drawn, const Effects& effects, BatchOf<float>& batch, std::int64_t i);

Scene drawn(Scene scene) {
  apply(draw(scene.randomization, scene.model, scene.effects, scene.seed), scene.model, scene.effects);
  scene.randomization = {};
  return scene;
}

}  // namespace linden
