#include "engine/program/effect_cost.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "engine/simulation.hpp"

namespace linden {
namespace {

constexpr int kRounds = 5;
constexpr double kSecondsOfEach = 0.15;  // of steps of each, over all rounds

using Clock = std::chrono::steady_clock;

/// One way to take the scene, a few steps at a time.
class Variant {
 public:
  Variant(std::string name, std::shared_ptr<const Model> model, const Scene& scene, const Effects& effects)
      : name_(std::move(name)), simulation_(std::move(model), scene.options, effects), start_(scene.initial) {
    begin();
  }

  /// Until `seconds` have gone by; a scene that fails begins anew.
  void take(double seconds) {
    const Clock::time_point begin_time = Clock::now();
    std::int64_t steps = 0;
    double taken = 0;
    while (taken < seconds) {
      const StepsReport report = simulation_.run(8);
      steps += report.steps;
      if (!report.ok()) begin();
      taken = std::chrono::duration<double>(Clock::now() - begin_time).count();
    }
    least_ = std::min(least_, taken / static_cast<double>(steps));
  }
  const std::string& name() const { return name_; }
  double seconds_per_step() const { return least_; }

 private:
  void begin() {
    if (!start_.positions.empty()) simulation_.set_positions(start_.positions);
    if (!start_.velocities.empty()) simulation_.set_velocities(start_.velocities);
  }

  std::string name_;
  Simulation simulation_;
  InitialState start_;
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<EffectCost> effect_costs(const Scene& scene) {
  const auto model = std::make_shared<const Model>(scene.model);
  std::vector<std::unique_ptr<Variant>> variants;
  const auto contend = [&](std::string name, const Effects& effects) {
    variants.push_back(std::make_unique<Variant>(std::move(name), model, scene, effects));
  };
  contend("none", {});
  // lists of one name are one effect
  std::vector<std::string_view> names;
  Effects::each(scene.effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    if (!entries.empty() && std::ranges::find(names, Entry::facts.name) == names.end()) names.push_back(Entry::facts.name);
  });
  for (const std::string_view name : names) {
    Effects effects = scene.effects;
    Effects::each(scene.effects, [&]<class Entry>(std::span<const Entry>, std::string_view) {
      if (Entry::facts.name != name) effects.list<Entry>() = {};
    });
    contend(std::string(name), effects);
  }
  contend("all", scene.effects);
  for (int round = 0; round < kRounds; ++round) {
    for (const auto& variant : variants) variant->take(kSecondsOfEach / kRounds);
  }
  std::vector<EffectCost> costs;
  const double none = variants.front()->seconds_per_step();
  for (const auto& variant : variants) {
    const bool whole = variant == variants.front() || variant == variants.back();
    const double seconds = variant->seconds_per_step() - (whole ? 0 : none);
    costs.push_back({variant->name(), 1e9 * seconds / model->tree.bodies()});
  }
  return costs;
}

}  // namespace linden
