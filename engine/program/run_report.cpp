#include "engine/program/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>

#include "engine/compose/composition.hpp"
#include "engine/program/effects_text.hpp"
#include "engine/program/randomize.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/text.hpp"
#include "engine/version.hpp"

namespace linden {
namespace {

std::string begin_text(const RunArguments& arguments, const RunFigures& figures) {
  return arguments.load.empty() ? start_text(arguments) : fmt::format("{}, at {:.6g} s", arguments.load, figures.begin);
}

double mean(std::int64_t sum, std::int64_t count) { return static_cast<double>(sum) / static_cast<double>(count); }

double steps_per_second(const RunFigures& figures) { return static_cast<double>(figures.run.steps) / figures.step_seconds; }

double ns_per_body_step(const Model& model, const RunFigures& figures) {
  return 1e9 * figures.step_seconds / (static_cast<double>(figures.run.steps) * model.tree.bodies());
}

/// "order 4 (5 sub-steps), "; of order 2, which most runs have, nothing.
std::string order_text(const Options& options) {
  if (options.order == 2) return "";
  return fmt::format("order {} ({} sub-steps), ", options.order, composition(options.order).size());
}

/// "step 0.001 s"; "variable steps".
std::string step_text(const Options& options) { return options.varies() ? "variable steps" : fmt::format("step {:g} s", options.step); }

double band(const EnergyDrift& energy) { return energy.scale() > 0 ? energy.band() / energy.scale() : 0; }

/// Of an accuracy: what steps it was met with, and whether it was.
std::string steps_text(const Simulation& simulation, const RunFigures& figures) {
  if (const std::optional<StepLengths> lengths = simulation.step_lengths()) {
    std::string text = fmt::format("variable, {:.3g} to {:.3g} s, mean {:.3g} s: {}", lengths->shortest, lengths->longest, lengths->mean, figures.steps_why);
    if (lengths->lowered > 0) text += fmt::format("; made shorter for good {}", lengths->lowered == 1 ? "once" : fmt::format("{} times", lengths->lowered));
    if (lengths->retaken > 0) text += fmt::format("; {} taken again, shorter", counted(lengths->retaken, "step"));
    return text;
  }
  return fmt::format("fixed: {}", figures.steps_why);
}

std::string accuracy_text(const Options& options, const EnergyDrift& energy) {
  return fmt::format("{:g} asked for, band {:.1e}: {}", *options.accuracy, band(energy), band(energy) <= *options.accuracy ? "kept" : "not kept");
}

/// " or 1e-05 of the first residual"; where there is none, nothing.
std::string reduction_text(const Options& options) {
  return options.reduction > 0 ? fmt::format(" or {:g} of the first residual", options.reduction) : "";
}

nlohmann::ordered_json accuracy_json(const Simulation& simulation, const RunFigures& figures) {
  nlohmann::ordered_json json{{"asked", *simulation.options().accuracy},
                              {"kept", band(figures.energy) <= *simulation.options().accuracy},
                              {"varies", simulation.options().varies()},
                              {"why", figures.steps_why}};
  if (const std::optional<StepLengths> lengths = simulation.step_lengths()) {
    json["shortest"] = lengths->shortest;
    json["longest"] = lengths->longest;
    json["mean"] = lengths->mean;
    json["retaken"] = lengths->retaken;
    json["lowered"] = lengths->lowered;
  }
  return json;
}

}  // namespace

std::vector<std::string> energy_warnings(const Simulation& simulation, const EnergyDrift& energy) {
  constexpr double kTooFar = 0.05, kRounding = 1e-9, kMostAtOnce = 0.9;
  std::vector<std::string> warnings;
  // where an effect gives what it can only take a smaller step is no cure
  for (const PassiveGift& gift : simulation.passive_gifts()) warnings.push_back(describe(gift));
  if (!warnings.empty()) return warnings;
  // a potential is a sum of weights times heights, rounded at heights of a metre even where it comes to nothing
  const auto& g = simulation.options().gravity;
  const double mass = simulation.model().constants.subtree_mass(0), weight = mass * std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
  if (!(energy.band() > kTooFar * energy.exchanged()) || energy.band() <= kRounding * (energy.magnitude() + weight)) return {};
  // what is set down at rest is held up from the first step on, p having begun without what held it before: gravity is let act for half a step
  const double fall = 0.5 * weight * weight / mass * simulation.options().step * simulation.options().step;
  const bool at_once = energy.first_change() > kMostAtOnce * energy.band();
  if (at_once && energy.band() <= fall) return {};
  const std::string strays = fmt::format("energy strays by {:.2g} % of what went to and fro", 100 * energy.band() / energy.exchanged());
  if (at_once) {
    return {fmt::format("{}, nearly all of it at once at the start: look at how the scene begins", strays)};
  }
  return {fmt::format("{}: the motion is not to be trusted; try --dt {:.3g}", strays, simulation.options().step / 4)};
}

std::string run_summary(const RunArguments& arguments, const Simulation& simulation, const RunFigures& figures) {
  const Model& model = simulation.model();
  const Options& options = simulation.options();
  std::string text;
  const auto row = [&](const char* label, const std::string& value) { text += fmt::format("{:<11} {}\n", label, value); };

  row("model", model_text(arguments, model));
  row("start", begin_text(arguments, figures));
  if (arguments.randomization.any()) row("randomize", randomize_text(arguments.randomization, drawing_seed(arguments), 1));
  const Effects effects = arguments.effects();
  std::string label = "effects";
  for (const EffectLine& line : effect_lines(effects, model)) {
    row(label.c_str(), fmt::format("{}: {}, {}", line.name, line.where, line.what));
    label.clear();
  }
  if (const std::string ignored = IgnoredByScene(model, effects).text(); !ignored.empty()) {
    row("ignored", ignored + "; a scene can name them");
  }
  row("method", fmt::format("{}, {}{}, tolerance {:g} ({}){}, first guess {}, {}", name(options.solver), order_text(options),
                            step_text(options), options.tolerance, name(options.stop), reduction_text(options), name(options.guess),
                            gravity_text(options)));
  if (figures.run.steps == 0) return text;
  if (options.accuracy) row("steps", steps_text(simulation, figures));

  const double simulated = figures.simulated(options.step);
  row("run", figures.complete()
                 ? fmt::format("{:.6g} s, {}", simulated, counted(figures.run.steps, "step"))
             : figures.end ? fmt::format("{:.6g} of {:.6g} s, {}", simulated, arguments.duration, counted(figures.run.steps, "step"))
                 : fmt::format("{:.6g} of {:.6g} s, {} of {}", simulated, static_cast<double>(figures.steps_planned) * options.step,
                               grouped(figures.run.steps), counted(figures.steps_planned, "step")));
  row("speed", fmt::format("{} steps/s, {:.0f} ns per body and step, {:.3g} times real time",
                           grouped(std::llround(steps_per_second(figures))), ns_per_body_step(model, figures),
                           simulated / figures.step_seconds));
  row("iterations", fmt::format("mean {:.2f}, largest {}; {:.2f} evaluations of the residual per step",
                                mean(figures.run.iterations, figures.run.steps), figures.run.most_iterations,
                                mean(figures.run.evaluations, figures.run.steps)));
  if (figures.run.split_steps > 0) row("", describe(figures.run));
  if (figures.run.floor_steps > 0) {
    row("", fmt::format("{} stopped above the tolerance, where rounding lets the residual fall no further (largest {:.1e})",
                        counted(figures.run.floor_steps, "step"), figures.run.largest_residual));
  }

  const EnergyDrift& energy = figures.energy;
  if (!is_motion(model, energy.scale())) row("motion", kNothingMoves);
  row("energy", fmt::format("{:.6g} J at the start; kinetic energy up to {:.4g} J", energy.initial(), energy.scale()));
  if (!effect_lines(effects, model).empty()) {
    row("  work", fmt::format("effects took {:.6g} J and gave {:.6g} J, which the band below accounts for", figures.taken, figures.given));
  }
  const bool scaled = energy.scale() > 0;
  row("  band", fmt::format("{:.2e} J{}", energy.band(),
                            scaled ? fmt::format(" = {:.2e} of the largest kinetic energy", energy.band() / energy.scale()) : ""));
  if (options.accuracy) row("  accuracy", accuracy_text(options, energy));
  if (std::isfinite(energy.slope_error())) {
    row("  slope", fmt::format("{:+.1e} \u00b1 {:.1e} J/s{}", energy.slope(), energy.slope_error(),
                               scaled ? fmt::format(" = {:+.1e} \u00b1 {:.1e} of it per second", energy.slope() / energy.scale(),
                                                    energy.slope_error() / energy.scale())
                                      : ""));
  }
  if (figures.momentum) {
    const MomentumDrift& momentum = *figures.momentum;
    row("momentum", momentum.gravity()
                        ? fmt::format("P - m g t drifts by {:.1e}, L along gravity by {:.1e}, of the most the energy allows",
                                      momentum.linear(), momentum.angular())
                        : fmt::format("linear drifts by {:.1e}, angular by {:.1e}, of the most the energy allows", momentum.linear(),
                                      momentum.angular()));
  }
  const auto written = [&](const std::string& file, const std::string& what) {
    if (!file.empty()) row("", printable(fmt::format("{}: {}", file, what)));
  };
  written(arguments.record, fmt::format("{} rows", grouped(figures.rows)));
  for (const std::string& view : figures.views) row("", printable(view));
  return text;
}

nlohmann::ordered_json run_json(const RunArguments& arguments, const Simulation& simulation, const RunFigures& figures) {
  const Model& model = simulation.model();
  const Options& options = simulation.options();
  const auto random = randomness(arguments);
  const bool ran = figures.run.steps > 0;
  const bool isolated = figures.momentum && !figures.momentum->gravity();
  using Json = nlohmann::ordered_json;
  const auto if_any = [](bool any, double value) { return any && std::isfinite(value) ? Json(value) : Json(nullptr); };
  const auto if_given = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  const Effects effects = arguments.effects();
  const IgnoredByScene ignored(model, effects);
  Json effect_list = Json::array();
  for (const EffectLine& line : effect_lines(effects, model)) {
    effect_list.push_back({{"name", line.name}, {"on", line.where}, {"what", line.what}});
  }
  const EnergyDrift& energy = figures.energy;
  return Json{
      {"command", "run"},
      {"version", kVersion},
      {"model", model.names.model},
      {"source", arguments.model},
      {"base", base_of(model)},
      {"bodies", model.tree.bodies()},
      {"dofs", model.degrees_of_freedom()},
      {"positions", model.tree.shape.positions},
      {"velocities", model.tree.shape.velocities},
      {"mass", model.constants.subtree_mass(0)},
      {"ignored",
       {{"limits", ignored.limits},
        {"damping", ignored.damping},
        {"friction", ignored.friction},
        {"velocity_limits", ignored.velocity_limits}}},
      {"effects", effect_list},
      {"solver", name(options.solver)},
      {"guess", name(options.guess)},
      {"stop", name(options.stop)},
      {"tolerance", options.tolerance},
      {"reduction", options.reduction},
      {"order", options.order},
      {"step", options.step},
      {"accuracy", options.accuracy ? accuracy_json(simulation, figures) : Json(nullptr)},
      {"gravity", options.gravity},
      {"seed", random ? Json(random->seed) : Json(nullptr)},
      {"spread", random ? Json(random->spread) : Json(nullptr)},
      {"randomize", randomize_json(arguments.randomization, drawing_seed(arguments), 1)},
      {"drawn", arguments.randomization.any() ? drawn_json(figures.drawn) : Json(nullptr)},
      {"loaded", if_given(arguments.load)},
      {"time_begin", figures.begin},
      {"duration", figures.simulated(options.step)},
      {"steps_planned", figures.steps_planned},
      {"steps", figures.run.steps},
      {"wall_seconds", figures.step_seconds},
      {"total_seconds", figures.total_seconds},
      {"steps_per_second", if_any(ran, steps_per_second(figures))},
      {"ns_per_body_step", if_any(ran, ns_per_body_step(model, figures))},
      {"real_time_factor", if_any(ran, figures.simulated(options.step) / figures.step_seconds)},
      {"iterations_mean", if_any(ran, mean(figures.run.iterations, figures.run.steps))},
      {"iterations_max", figures.run.most_iterations},
      {"evaluations_mean", if_any(ran, mean(figures.run.evaluations, figures.run.steps))},
      {"factorisations_mean", if_any(ran, mean(figures.run.factorisations, figures.run.steps))},
      {"substeps", figures.run.substeps},
      {"split_steps", figures.run.split_steps},
      {"splits_in_a_row", figures.run.splits_in_a_row},
      {"rounding_floor_steps", figures.run.floor_steps},
      {"residual_max", figures.run.largest_residual},
      {"moves", is_motion(model, energy.scale())},
      {"energy_initial", energy.initial()},
      {"energy_taken", figures.taken},
      {"energy_given", figures.given},
      {"energy_band", energy.band()},
      {"energy_slope", if_any(true, energy.slope())},
      {"energy_slope_error", if_any(true, energy.slope_error())},
      {"energy_scale", energy.scale()},
      {"energy_scale_is", "largest kinetic energy"},
      {"energy_samples", energy.samples()},
      {"energy_sampled_every", figures.sampled_every},
      {"momentum_drift", if_any(isolated, isolated ? std::max(figures.momentum->linear(), figures.momentum->angular()) : 0)},
      {"momentum_drift_linear", if_any(figures.momentum.has_value(), figures.momentum ? figures.momentum->linear() : 0)},
      {"momentum_drift_angular", if_any(figures.momentum.has_value(), figures.momentum ? figures.momentum->angular() : 0)},
      {"momentum_drift_is", !figures.momentum ? Json(nullptr)
                            : isolated        ? Json("linear and angular momentum")
                                              : Json("P - m g t, and angular momentum along gravity")},
      {"failures", figures.failure.empty() ? 0 : 1},
      {"failure", if_given(figures.failure)},
      {"recording_failure", if_given(figures.lost)},
      {"interrupted", figures.signal != 0},
      {"advice", if_given(fmt::format("{}", fmt::join(energy_warnings(simulation, energy), "; ")))},
      {"warnings", model.warnings},
      {"notes", model.notes},
  };
}

namespace {

plot::Chart energy_chart(const RunArguments& arguments, const Simulation& simulation, const RunFigures& figures) {
  const Options& options = simulation.options();
  const EnergyDrift& energy = figures.energy;
  const bool scaled = energy.scale() > 0;
  plot::Series curve{.label = "", .x = {}, .y = {}};
  for (const plot::Point& point : figures.trace) {
    curve.x.push_back(point.x);
    curve.y.push_back(scaled ? point.y / energy.scale() : point.y);
  }
  plot::Chart chart;
  chart.title = fmt::format("Energy drift of {}", printable(simulation.model().names.model));
  chart.subtitle = fmt::format("{}, {}; {}, {}{}, {}, {}; start {}; H(0) = {:.6g} J",
                               counted(simulation.model().tree.bodies(), "body"), base_of(simulation.model()), name(options.solver),
                               order_text(options), step_text(options), counted(figures.run.steps, "step"), gravity_text(options), begin_text(arguments, figures),
                               energy.initial());
  if (scaled && std::isfinite(energy.slope_error())) {
    chart.subtitle += fmt::format("; slope {:+.1e} \u00b1 {:.1e} per second", energy.slope() / energy.scale(), energy.slope_error() / energy.scale());
  }
  chart.x.label = "time [s]";
  const bool effects = !effect_lines(arguments.effects(), simulation.model()).empty();
  const char* drift = effects ? "H \u2212 H(0) \u2212 work of effects" : "H \u2212 H(0)";
  chart.y.label = scaled ? fmt::format("{}, share of the largest kinetic energy ({:.4g} J)", drift, energy.scale())
                         : fmt::format("{} [J]", drift);
  chart.series.push_back(std::move(curve));
  return chart;
}

/// With its unit; of a quantity of several kinds of joints there are two.
std::string axis_label(const QuantityTrace& trace) {
  if (!trace.quantity) return fmt::format("{} [{}]", trace.array, trace.units);
  switch (*trace.quantity) {
    case Quantity::positions: return "positions [rad, m]";
    case Quantity::velocities: return "velocities [rad/s, m/s]";
    case Quantity::servos: return "forces of servos [N m, N]";
    case Quantity::forces: return "forces of effects [N m, N]";
    case Quantity::energies: return "energies [J]";
    case Quantity::contacts: break;
  }
  return trace.array == "contacts" ? "contact points that push" : "normal forces [N]";
}

/// Those of the rows that vary most, as many as can be told apart, in their order; of more than that none that does not vary, but all were so.
std::vector<std::size_t> drawn_rows(const QuantityTrace& trace) {
  constexpr std::size_t kMostDrawn = 12;
  std::vector<std::size_t> rows(trace.rows.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  if (rows.size() <= kMostDrawn) return rows;
  std::vector<double> range;
  for (const std::vector<plot::Point>& points : trace.points) {
    const auto [least, most] = std::ranges::minmax(points, {}, &plot::Point::y);
    range.push_back(most.y - least.y);
  }
  std::ranges::stable_sort(rows, std::greater(), [&](std::size_t row) { return range[row]; });
  rows.resize(kMostDrawn);
  if (range[rows.front()] > 0) std::erase_if(rows, [&](std::size_t row) { return range[row] == 0; });
  std::ranges::sort(rows);
  return rows;
}

}  // namespace

std::vector<plot::Chart> run_charts(const RunArguments& arguments, const Simulation& simulation, const RunFigures& figures) {
  std::vector<plot::Chart> charts;
  if (figures.traces.empty()) charts.push_back(energy_chart(arguments, simulation, figures));
  for (const QuantityTrace& trace : figures.traces) {
    plot::Chart& chart = charts.emplace_back();
    const std::vector<std::size_t> rows = drawn_rows(trace);
    chart.title = fmt::format("{} of {}", axis_label(trace).substr(0, axis_label(trace).find(" [")), printable(simulation.model().names.model));
    if (rows.size() < trace.all) {
      chart.subtitle = fmt::format("the {} that vary most of {}{}", rows.size(), trace.rows.size() < trace.all ? "the first " : "", trace.rows.size());
    }
    chart.x.label = "time [s]";
    chart.y.label = axis_label(trace);
    for (const std::size_t k : rows) {
      plot::Series& series = chart.series.emplace_back(plot::Series{.label = printable(trace.rows[k]), .x = {}, .y = {}});
      for (const plot::Point& point : trace.points[k]) {
        series.x.push_back(point.x);
        series.y.push_back(point.y);
      }
    }
  }
  if (!figures.failure.empty()) {
    std::string& subtitle = charts.front().subtitle;
    subtitle += fmt::format("{}FAILED: {}", subtitle.empty() ? "" : "; ", printable(figures.failure));
  }
  return charts;
}

}  // namespace linden
