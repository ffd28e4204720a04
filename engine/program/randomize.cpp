#include "engine/program/randomize.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// The parts of a text between separators.
std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

}  // namespace

void randomize_from(const std::string& text, const Effects& effects, Randomization& randomization) {
  std::vector<std::string> named;
  for (const std::string& part : split(text, ',')) {
    const std::size_t sign = part.find('=');
    const std::string name = part.substr(0, sign);
    std::vector<double> numbers;
    for (const std::string& word : split(sign == part.npos ? "" : std::string_view(part).substr(sign + 1), ':')) {
      const std::optional<double> number = number_in(word);
      if (!number) {
        throw InputError(fmt::format("--randomize {}: {} is no range; expected name=p or name=low:high, with commas; write for example "
                                     "masses=0.2,friction=0.4:1.0",
                                     quoted(text), quoted(part)));
      }
      numbers.push_back(*number);
    }
    if (std::ranges::find(named, name) != named.end()) {
      throw InputError(fmt::format("--randomize {} names {} twice; expected it once; leave one out", quoted(text), name));
    }
    named.push_back(name);
    try {
      set_range(randomization, name, numbers, effects);
    } catch (const InputError& error) {
      throw InputError(fmt::format("--randomize {}: {}", quoted(text), error.what()));
    }
  }
}

std::string randomize_text(const Randomization& randomization, std::uint64_t seed, std::int64_t instances) {
  const std::uint64_t last = seed + static_cast<std::uint64_t>(instances) - 1;
  return fmt::format("{}, from {}", randomization_text(randomization),
                     instances == 1 ? fmt::format("seed {}", seed) : fmt::format("seeds {} to {}", seed, last));
}

nlohmann::ordered_json randomize_json(const Randomization& randomization, std::uint64_t seed, std::int64_t instances) {
  if (!randomization.any()) return nullptr;
  const auto range = [](const std::optional<Range>& of) {
    return of ? nlohmann::ordered_json{of->low, of->high} : nlohmann::ordered_json(nullptr);
  };
  return {{"mass_factors", range(randomization.masses)},
          {"ground_friction", range(randomization.friction)},
          {"joint_friction_factors", range(randomization.joint_friction)},
          {"gain_factors", range(randomization.gains)},
          {"first_seed", seed},
          {"last_seed", seed + static_cast<std::uint64_t>(instances) - 1}};
}

nlohmann::ordered_json drawn_json(const DrawnNumbers& drawn) {
  return {{"mass_factors", drawn.mass_factors},
          {"ground_friction", drawn.ground_friction ? nlohmann::ordered_json(*drawn.ground_friction) : nlohmann::ordered_json(nullptr)},
          {"joint_friction_factors", drawn.joint_friction_factors},
          {"gain_factors", drawn.gain_factors}};
}

DrawnArrays::DrawnArrays(const Randomization& randomization, const Model& model, const Effects& effects, std::int64_t instances) {
  const auto add = [&](FixedArray array, std::vector<double> (*numbers)(const DrawnNumbers&)) {
    array.numbers.resize(static_cast<std::size_t>(instances) * (array.names.empty() ? 1 : array.columns.size()));
    arrays_.push_back(std::move(array));
    of_array_.push_back(numbers);
  };
  const auto names_of_rows = [&](const auto& entries) {
    std::vector<std::string> names;
    for (const auto& entry : entries) names.push_back(model.names.velocity[static_cast<std::size_t>(entry.row)]);
    return names;
  };
  if (randomization.masses) {
    add({"mass_factors", "bodies", {model.names.body.begin() + 1, model.names.body.end()}, {}},
        [](const DrawnNumbers& drawn) { return drawn.mass_factors; });
  }
  if (randomization.friction) {
    add({"ground_friction", "", {}, {}}, [](const DrawnNumbers& drawn) { return std::vector{drawn.ground_friction.value()}; });
  }
  if (randomization.joint_friction) {
    add({"joint_friction_factors", "friction_joints", names_of_rows(effects.friction), {}},
        [](const DrawnNumbers& drawn) { return drawn.joint_friction_factors; });
  }
  if (randomization.gains) {
    add({"gain_factors", "servos", names_of_rows(effects.servos), {}}, [](const DrawnNumbers& drawn) { return drawn.gain_factors; });
  }
}

void DrawnArrays::set(std::int64_t i, const DrawnNumbers& drawn) {
  for (std::size_t k = 0; k < arrays_.size(); ++k) {
    const std::vector<double> numbers = of_array_[k](drawn);
    std::ranges::copy(numbers, arrays_[k].numbers.begin() + i * std::ssize(numbers));
  }
}

}  // namespace linden
