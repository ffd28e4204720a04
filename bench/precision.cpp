// bench/precision.cpp
// What single precision costs: energy over time and error against double precision, for the humanoid and a chain of 100 links.
//
//   build/release/bench/bench_precision [FILE.csv]
//
// 16 instances each, h = 1 ms. Energy: band (max - min) and slope of H over the run, relative to the largest kinetic energy, the median of
// the instances. Error: largest difference of any coordinate to double precision, the median of the instances. On chaotic motions
// every difference grows until it is as large as the motion itself; `1e-12` is double precision started that far beside, to compare with.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>

#include "engine/batch.hpp"
#include "engine/drift.hpp"
#include "engine/initial_state.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

namespace {

using namespace linden;

constexpr std::int64_t kInstances = 16;
constexpr int kEvery = 10;                             // steps between samples
constexpr double kErrorsAt[] = {0.1, 1, 10};           // [s]
constexpr double kDuration = 10;                       // [s]

struct Motion {
  std::vector<EnergyDrift> energy;
  std::vector<std::vector<Eigen::VectorXd>> positions;  // [time][instance]
  BatchSummary summary;
};

template <class Real>
Motion motion(const std::shared_ptr<const Model>& model, double spread, double aside) {
  BatchOf<Real> batch(model, kInstances);
  for (std::int64_t i = 0; i < kInstances; ++i) {
    InitialState start = random_state(*model, static_cast<std::uint64_t>(i) + 1, spread);
    for (double& speed : start.velocities) speed += aside;
    batch.reset(i, start.positions, start.velocities);
  }
  const auto samples = std::llround(kDuration / (1e-3 * kEvery)) + 1;
  Motion result{std::vector<EnergyDrift>(kInstances, EnergyDrift(samples)), {}, {}};
  for (std::int64_t sample = 0; sample < samples; ++sample) {
    if (sample > 0) batch.step(kEvery);
    const double time = 1e-3 * kEvery * static_cast<double>(sample);
    const auto seen = batch.observe();
    for (std::int64_t i = 0; i < kInstances; ++i) {
      result.energy[static_cast<std::size_t>(i)].add(
          time, {static_cast<double>(seen.energies()(i, 0)), static_cast<double>(seen.energies()(i, 1))});
    }
    for (const double at : kErrorsAt) {
      if (std::abs(time - at) > 1e-6) continue;
      result.positions.emplace_back();
      for (std::int64_t i = 0; i < kInstances; ++i) {
        result.positions.back().push_back(batch.positions().instance(i).template cast<double>());
      }
    }
  }
  result.summary = batch.summary();
  return result;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  struct Scene {
    const char* name;
    std::shared_ptr<const Model> model;
    double spread;
  };
  const Scene scenes[] = {
      {"humanoid", std::make_shared<const Model>(load_urdf(LINDEN_MODELS_DIR "/humanoid.urdf", Base::floating)), 0.5},
      {"chain:100", std::make_shared<const Model>(chain(100)), 0.1}};
  std::ostringstream csv;
  csv << "model,precision,frozen,evaluations,energy_band,energy_slope_per_s,error_0.1s,error_1s,error_10s\n";
  for (const Scene& scene : scenes) {
    const Motion reference = motion<double>(scene.model, scene.spread, 0);
    const auto row = [&](const char* precision, const Motion& found) {
      std::vector<double> bands, slopes;
      for (const EnergyDrift& energy : found.energy) {
        bands.push_back(energy.band() / energy.scale());
        slopes.push_back(std::abs(energy.slope()) / energy.scale());
      }
      csv << fmt::format("{},{},{},{:.2f},{:.1e},{:.1e}", scene.name, precision, found.summary.frozen,
                         static_cast<double>(found.summary.evaluations) / static_cast<double>(found.summary.steps), median(bands),
                         median(slopes));
      for (std::size_t at = 0; at < found.positions.size(); ++at) {
        std::vector<double> errors;
        for (std::size_t i = 0; i < kInstances; ++i) {
          errors.push_back((found.positions[at][i] - reference.positions[at][i]).lpNorm<Eigen::Infinity>());
        }
        csv << fmt::format(",{:.1e}", median(errors));
      }
      csv << "\n";
    };
    row("double", reference);
    row("1e-12", motion<double>(scene.model, scene.spread, 1e-12));
    row("single", motion<float>(scene.model, scene.spread, 0));
  }
  std::cout << csv.str();
  if (argc > 1) {
    std::ofstream file(argv[1]);
    if (!(file << csv.str())) {
      std::cerr << argv[1] << ": cannot be written\n";
      return 1;
    }
  }
}
