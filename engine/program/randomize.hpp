// engine/program/randomize.hpp
// --randomize masses=0.2,friction=0.4:1.0,gains=0.1: from the command line to what reports and files say of it (engine/randomization.hpp).
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "engine/files/rollout_file.hpp"
#include "engine/randomization.hpp"

namespace linden {

/// What the text names goes over what is there. Throws InputError for a text that does not read so, and as set_range does.
void randomize_from(const std::string& text, const Effects& effects, Randomization& randomization);

/// "masses ±20 %, ground friction 0.4 to 1, from seeds 1 to 4096"
std::string randomize_text(const Randomization& randomization, std::uint64_t seed, std::int64_t instances);
/// The same for scripts: ranges [low, high] and seeds; null where nothing is randomised.
nlohmann::ordered_json randomize_json(const Randomization& randomization, std::uint64_t seed, std::int64_t instances);

/// What was drawn for one instance, named as in rollout files.
nlohmann::ordered_json drawn_json(const DrawnNumbers& drawn);

/// What was drawn, for a rollout file.
class DrawnArrays {
 public:
  DrawnArrays(const Randomization& randomization, const Model& model, const Effects& effects, std::int64_t instances);

  /// Several threads may set different instances at once.
  void set(std::int64_t i, const DrawnNumbers& drawn);
  const std::vector<FixedArray>& arrays() const { return arrays_; }

 private:
  std::vector<FixedArray> arrays_;
  std::vector<std::vector<double> (*)(const DrawnNumbers&)> of_array_;
};

}  // namespace linden
