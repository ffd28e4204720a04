// tests/engine/scenes.hpp
// Models and starts that the engine's tests share.
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"
#include "engine/solve/instructions.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

namespace linden {

/// Height of the fall that sets the scale of the ten-link chain's energy: its links from horizontal to hanging, 4.905 J.
inline constexpr double kTenLinkFall = 10 * 0.1 * 9.81 * 0.5;

inline std::string model_file(const std::string& name) { return std::string(LINDEN_MODELS_DIR) + "/" + name; }

/// The project's own models and, where the folder is there, real robots.
inline std::vector<std::string> all_robots() {
  std::vector<std::string> files;
  for (const std::string folder : {LINDEN_MODELS_DIR, LINDEN_ROBOTS_DIR}) {
    if (!std::filesystem::is_directory(folder)) {
      WARN("skipping the robots of " << folder << ": no such folder");
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".urdf") files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Those of them that are trees: without closed loops, so that any velocities are possible ones.
inline std::vector<std::string> tree_robots() {
  std::vector<std::string> files = all_robots();
  std::erase_if(files, [](const std::string& file) { return !load_urdf(file).couplings.empty(); });
  return files;
}

/// Instructions that this processor has and this build knows.
inline std::vector<Instructions> all_instructions() {
  std::vector<Instructions> list;
  for (const Instructions one : {Instructions::scalar, Instructions::baseline, Instructions::avx2, Instructions::avx512}) {
    if (available(one)) list.push_back(one);
  }
  return list;
}

inline void random_start(Simulation& simulation, std::uint64_t seed, double spread) {
  const InitialState start = random_state(simulation.model(), seed, spread);
  simulation.set_positions(start.positions);
  simulation.set_velocities(start.velocities);
}

/// Steps, and fails the test where a step fails.
inline void run(Simulation& simulation, int steps) {
  const StepsReport report = simulation.run(steps);
  if (!report.ok()) FAIL(simulation.describe(report.last));
}

/// Largest difference between two states of the same model, positions alone.
inline double distance(std::span<const double> a, std::span<const double> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

}  // namespace linden
