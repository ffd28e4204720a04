#include "engine/program/start_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/standard_streams.hpp"
#include "engine/start_check.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

void note(const std::string& text) { tell("note: {}", text); }

/// A load that gravity is missing beside: "a ground", "servos", "contact", "springs"; empty where there is none.
std::string load_of(const Effects& effects) {
  if (effects.ground) return "a ground";
  if (!effects.servos.empty()) return "servos";
  if (effects.contact) return "contact";
  bool springs = false;
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    springs = springs || (Entry::facts.stores && !entries.empty());
  });
  return springs ? "springs" : "";
}

void look_at_scene(const MotionArguments& arguments, const Options& options) {
  const Scene& scene = *arguments.scene;
  const StartFindings found = StartCheck(scene.model, options, scene.effects).look(scene.initial.positions);
  if (!found.sound()) {
    const std::string text = fmt::format("{}: {}", arguments.model, found.text());
    if (!scene.start_as_given && !arguments.start_as_given) throw InputError(text);
    tell("warning: {}: it starts outside of what holds it, as given: {}", arguments.model, fmt::join(found.faults, "; "));
  }
  for (const std::string& told : found.told) tell("warning: {}: {}", arguments.model, told);
  const std::string load = load_of(scene.effects);
  const bool weightless = options.gravity == std::array<double, 3>{0, 0, 0};
  if (weightless && !scene.gravity_named && !arguments.gravity_given && !load.empty()) {
    note(fmt::format("{} has {} and no gravity: name it under effects if it is wanted (gravity: [0, 0, -9.81])", arguments.model, load));
  }
}

void look_at_zero(const MotionArguments& arguments, const Model& model) {
  constexpr std::size_t kShown = 3;
  std::vector<std::string> joints = zeros_outside_limits(model);
  if (joints.empty()) return;
  const std::size_t all = joints.size();
  joints.resize(std::min(all, kShown));
  note(fmt::format("{}: the zero of {} lies outside the limits of the file: {}{}; no limits are in effect here, a scene can name them",
                   arguments.model, counted(static_cast<std::int64_t>(all), "joint"), fmt::join(joints, ", "),
                   all > kShown ? fmt::format(" and {} more", all - kShown) : ""));
}

}  // namespace

void look_at_start(const MotionArguments& arguments, const Model& model, const Options& options) {
  if (arguments.scene) return look_at_scene(arguments, options);
  if (!randomness(arguments)) look_at_zero(arguments, model);  // random positions keep the file's limits
}

void look_at_instances(const MotionArguments& arguments, const Options& options, std::int64_t instances, Ranks& ranks, InstanceRange own,
                       const std::function<std::vector<double>(std::int64_t i)>& positions) {
  if (!arguments.scene || !arguments.scene->effects.ground || arguments.scene->start_as_given || arguments.start_as_given) return;
  const StartCheck check(arguments.scene->model, options, arguments.scene->effects);
  std::int64_t count = 0;
  std::string first;
  for (std::int64_t i = 0; i < own.count; ++i) {
    const StartFindings found = check.look_under(positions(i));
    if (found.sound()) continue;
    if (count == 0) first = fmt::format("instance {}: {}", own.first + i, found.faults.front());
    count += 1;
  }
  ranks.sum({&count, 1});
  first = first_text(ranks, first);
  if (count == 0) return;
  tell("warning: {} of {} instances start in the ground, by their random joints ({}); raise the base or choose a smaller --spread",
       grouped(count), grouped(instances), first);
}

}  // namespace linden
