#include "engine/program/rollout_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/program/effects_text.hpp"
#include "engine/program/randomize.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/text.hpp"
#include "engine/version.hpp"

namespace linden {
namespace {

double ns_per_body_step(const Model& model, const RolloutFigures& figures) {
  return 1e9 * figures.threads / (figures.steps_per_second() * model.tree.bodies());
}

double evaluations_mean(const RolloutFigures& figures) {
  return static_cast<double>(figures.summary.evaluations) / static_cast<double>(figures.summary.steps);
}

double factors_mean(const RolloutFigures& figures) {
  return static_cast<double>(figures.summary.factors) / static_cast<double>(figures.summary.steps);
}

std::string instructions_text(const RolloutArguments& arguments) {
  const std::string used(name(arguments.computed.instructions.value_or(best_instructions())));
  return arguments.instructions_shared ? used + ", the best that all ranks have" : used;
}

}  // namespace

std::string rollout_summary(const RolloutArguments& arguments, const Model& model, const RolloutFigures& figures) {
  const Options& options = arguments.options;
  std::string text;
  const auto row = [&](const char* label, const std::string& value) { text += fmt::format("{:<11} {}\n", label, value); };
  const auto random = randomness(arguments);

  row("model", model_text(arguments, model));
  row("instances", fmt::format("{}, {} of {} kept", grouped(arguments.instances), memory_text(figures.bytes),
                               arguments.single ? "single precision" : "double precision"));
  row("start", fmt::format("{}random positions and speeds, seeds {} to {}, spread {:g}", arguments.scene ? "as the scene says, with " : "",
                           random->seed, random->seed + static_cast<std::uint64_t>(arguments.instances) - 1, random->spread));
  if (arguments.randomization.any()) row("randomize", randomize_text(arguments.randomization, random->seed, arguments.instances));
  const Effects effects = arguments.effects();
  std::string label = "effects";
  for (const EffectLine& line : effect_lines(effects, model)) {
    row(label.c_str(), fmt::format("{}: {}, {}", line.name, line.where, line.what));
    label.clear();
  }
  if (const std::string ignored = IgnoredByScene(model, effects).text(); !ignored.empty()) {
    row("ignored", ignored + "; a scene can name them");
  }
  row("method", fmt::format("newton, {}step {:g} s, tolerance {:g} (energy), {}",
                            options.order == 2 ? "" : fmt::format("order {}, ", options.order), options.step,
                            arguments.single ? std::max(options.tolerance, kSingleTolerance) : options.tolerance,
                            gravity_text(options)));
  row("processor", fmt::format("{}{} of {} instances ({})", figures.ranks > 1 ? fmt::format("{} ranks, ", grouped(figures.ranks)) : "",
                               counted(figures.threads, "thread"), figures.lanes,
                               instructions_text(arguments)));
  if (figures.summary.steps > 0) {
    const double simulated = static_cast<double>(figures.steps) * options.step;
    row("rollout", figures.signal == 0 ? fmt::format("{:.6g} s, {} of every instance", simulated, counted(figures.steps, "step"))
                                       : fmt::format("{:.6g} of {:.6g} s", simulated, static_cast<double>(figures.steps_planned) * options.step));
    row("speed", fmt::format("{} env-steps/s, {:.1f} ns per body and step on a thread, {:.4g} times real time",
                             grouped(std::llround(figures.steps_per_second())), ns_per_body_step(model, figures),
                             figures.steps_per_second() * options.step));
    row("iterations", fmt::format("{:.3f} evaluations of the residual and {:.3f} factors per step{}", evaluations_mean(figures),
                                  factors_mean(figures),
                                  figures.summary.rescued > 0
                                      ? fmt::format("; {} taken alone", counted(figures.summary.rescued, "step"))
                                      : ""));
    // where effects give and take its change says nothing
    const EnergyChange& energy = figures.energy;
    if (effect_lines(effects, model).empty()) row("energy", fmt::format("changes by {:+.1e} of the kinetic energy in the mean, {:.1e} in the median, {:.1e} at most (instance {})",
                              energy.mean, energy.median, energy.most, grouped(energy.worst)));
  }
  if (const auto& one = figures.account) {
    const double scale = one->energy.scale();
    row("energy", fmt::format("of instance {} on its own, over {:.6g} s: effects took {:.6g} J and gave {:.6g} J, band {:.2e} J{}",
                              grouped(one->instance), static_cast<double>(one->steps) * options.step, one->taken, one->given, one->energy.band(),
                              scale > 0 ? fmt::format(" = {:.2e} of the largest kinetic energy", one->energy.band() / scale) : ""));
  }
  if (!effect_lines(effects, model).empty() && figures.summary.steps > 0) {
    row("verdict", fmt::format("{} of {} frozen, {} of {} taken alone{}", grouped(figures.summary.frozen), counted(arguments.instances, "instance"),
                               grouped(figures.summary.rescued), counted(figures.summary.steps, "step"),
                               !figures.account                    ? ""
                               : figures.account->warnings.empty() ? ", the energy of that instance is accounted for"
                                                                   : ", the energy of that instance is not accounted for"));
  }
  if (figures.frames > 0) row("", printable(fmt::format("{}: {}", arguments.record, counted(figures.frames, "frame"))));
  if (!figures.checkpoint.empty()) row("checkpoint", printable(figures.checkpoint));
  for (const std::string& view : figures.views) row("", printable(view));
  if (figures.summary.frozen > 0) {
    row("frozen", fmt::format("{} at the last good state:", counted(figures.summary.frozen, "instance")));
    for (const std::string& failure : figures.failures) row("", printable(failure));
    if (figures.summary.frozen > static_cast<std::int64_t>(figures.failures.size())) row("", "...");
  }
  return text;
}

nlohmann::ordered_json rollout_json(const RolloutArguments& arguments, const Model& model, const RolloutFigures& figures) {
  using Json = nlohmann::ordered_json;
  const Options& options = arguments.options;
  const auto random = randomness(arguments);
  const EnergyChange& energy = figures.energy;
  const bool ran = figures.summary.steps > 0;
  const auto if_ran = [&](double value) { return ran && std::isfinite(value) ? Json(value) : Json(nullptr); };
  return Json{
      {"command", "rollout"},
      {"version", kVersion},
      {"model", model.names.model},
      {"source", arguments.model},
      {"base", base_of(model)},
      {"bodies", model.tree.bodies()},
      {"dofs", model.degrees_of_freedom()},
      {"instances", arguments.instances},
      {"ranks", figures.ranks},
      {"threads", figures.threads},
      {"lanes", figures.lanes},
      {"instructions", name(arguments.computed.instructions.value_or(best_instructions()))},
      {"precision", arguments.single ? "single" : "double"},
      {"bytes", figures.bytes},
      {"tolerance", arguments.single ? std::max(options.tolerance, kSingleTolerance) : options.tolerance},
      {"step", options.step},
      {"gravity", options.gravity},
      {"seed", random->seed},
      {"spread", random->spread},
      {"randomize", randomize_json(arguments.randomization, random->seed, arguments.instances)},
      {"steps_planned", figures.steps_planned},
      {"steps", figures.steps},
      {"env_steps", figures.summary.steps},
      {"wall_seconds", figures.step_seconds},
      {"total_seconds", figures.total_seconds},
      {"env_steps_per_second", if_ran(figures.steps_per_second())},
      {"ns_per_body_step", if_ran(ns_per_body_step(model, figures))},
      {"iterations_mean", if_ran(evaluations_mean(figures) - 1)},
      {"evaluations_mean", if_ran(evaluations_mean(figures))},
      {"factors_mean", if_ran(factors_mean(figures))},
      {"steps_alone", figures.summary.rescued},
      {"energy_change_mean", energy.mean},
      {"energy_change_median", energy.median},
      {"energy_change_most", energy.most},
      {"energy_change_most_instance", energy.worst},
      {"energy_change_is", "from first to last state, relative to the instance's largest kinetic energy"},
      {"frames", figures.frames},
      {"failures", figures.summary.frozen},
      {"failure_texts", figures.failures},
      {"account", !figures.account ? Json(nullptr)
                                   : Json{{"instance", figures.account->instance},
                                          {"steps", figures.account->steps},
                                          {"energy_taken", figures.account->taken},
                                          {"energy_given", figures.account->given},
                                          {"energy_band", figures.account->energy.band()},
                                          {"energy_scale", figures.account->energy.scale()},
                                          {"warnings", figures.account->warnings}}},
      {"recording_failure", figures.lost.empty() ? Json(nullptr) : Json(figures.lost)},
      {"interrupted", figures.signal != 0},
      {"warnings", model.warnings},
      {"notes", model.notes},
  };
}

}  // namespace linden
