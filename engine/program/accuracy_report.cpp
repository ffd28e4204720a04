#include "engine/program/accuracy_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/text.hpp"
#include "engine/version.hpp"

namespace linden {
namespace {

constexpr double kTargets[] = {1e-3, 1e-6, 1e-9};
constexpr double kWhole = 0.9;  // of the duration asked for

std::string milliseconds(double seconds) { return fmt::format("{:.4g}", 1e3 * seconds); }

/// "1.3e-05", "-" where nothing is known.
std::string short_number(double value) { return std::isfinite(value) ? fmt::format("{:.1e}", value) : "-"; }

std::string reference_text(const AccuracyFigures& figures) {
  const AccuracyReference& reference = figures.reference;
  if (!reference.failure.empty()) return reference.failure;
  const std::string steps = fmt::format("{} at {} ms and {} at {} ms", name(reference.method), milliseconds(reference.step),
                                        name(reference.other), milliseconds(reference.other_step));
  if (!figures.chaotic()) return fmt::format("{} agree to {:.1e} over all {:.6g} s", steps, reference.gap, figures.duration);
  return fmt::format("{} agree to {:.1e} up to {:.4g} s", steps, reference.gap, reference.horizon);
}

/// "12 ms", "0.25 ms".
std::string step_text(const AccuracyRow& row) { return fmt::format("{}, h = {} ms", name(row.method), milliseconds(row.step)); }

std::string minute_text(const AccuracyRow& row, const AccuracyFigures& figures) {
  return fmt::format("{:.2g} s", 60 * row.seconds / figures.duration);
}

std::string advice_for(const AccuracyFigures& figures, double AccuracyRow::*value, double target, std::string_view what) {
  const AccuracyRow* ours = cheapest(figures, value, target, true);
  const AccuracyRow* theirs = cheapest(figures, value, target, false);
  const std::string goal = fmt::format("for {} of {:.0e}", what, target);
  if (ours == nullptr) {
    return theirs == nullptr ? "" : fmt::format("{} no step that was tried suffices ({} would do)", goal, step_text(*theirs));
  }
  const auto timed = [&](const AccuracyRow& row) { return fmt::format("{}: {}", step_text(row), minute_text(row, figures)); };
  if (theirs != nullptr && theirs->seconds < ours->seconds) {
    return fmt::format("{} RK4 costs least ({} of CPU per simulated minute); of linden's own {}", goal, timed(*theirs), timed(*ours));
  }
  return fmt::format("{} use {} ({} of CPU per simulated minute{})", goal, step_text(*ours), minute_text(*ours, figures),
                     theirs == nullptr ? "" : "; " + timed(*theirs));
}

/// What advice from a shorter time than was asked for is worth; empty where it is none.
std::string worth_of(const AccuracyFigures& figures) {
  if (!(figures.duration < kWhole * figures.asked)) return "";
  return fmt::format("from {:.3g} s of the {:.6g} s that were asked for: what grows with time, or happens later, is not in it; a larger --budget "
                     "goes on for longer",
                     figures.duration, figures.asked);
}

std::string note(const AccuracyRow& row) {
  if (row.left_out) return "left out: no time";
  if (!row.failure.empty()) return "failed";
  if (row.split_steps > 0) return counted(row.split_steps, "step") + " split";
  return "";
}

std::string fit_text(const AccuracyFit& fit) {
  const std::string nominal = fmt::format("{} (nominal {})", name(fit.method), fit.method.order);
  if (!std::isfinite(fit.order)) return fmt::format("{}: too few steps between too coarse and exact", nominal);
  return fmt::format("{}: error ~ h^{:.2f} \u00b1 {:.1g} from {} to {} ms", nominal, fit.order, fit.error, milliseconds(fit.from),
                     milliseconds(fit.to));
}

/// What a curve over steps from large to small lacks, and why; empty where it lacks nothing.
std::string lacking(std::span<const AccuracyRow> rows) {
  std::vector<std::string> failed;
  double least = 0;  // step for which there was time
  bool no_time = false;
  for (const AccuracyRow& row : rows) {
    if (!row.failure.empty()) failed.push_back(milliseconds(row.step));
    if (row.left_out) no_time = true;
    else least = row.step;
  }
  if (failed.size() == rows.size()) return ", failed at every step";
  std::string text = failed.empty() ? "" : fmt::format(", failed at {} ms", fmt::join(failed, ", "));
  if (no_time) text += least > 0 ? fmt::format(", no time below {} ms", milliseconds(least)) : ", no time";
  return text;
}

/// Over CPU time, a curve for each method, with the order that its errors fall by where `fits` has it.
plot::Chart chart_of(const AccuracyFigures& figures, double AccuracyRow::*value, const std::vector<AccuracyFit>& fits) {
  plot::Chart chart;
  chart.x = {"CPU time [s]", true};
  chart.y.log = true;
  for (auto first = figures.rows.begin(); first != figures.rows.end();) {
    const auto last = std::find_if(first, figures.rows.end(), [&](const AccuracyRow& row) { return row.method != first->method; });
    const auto ladder_end = std::find_if(first, last, [](const AccuracyRow& row) { return !row.of_ladder; });
    const auto fit = std::ranges::find(fits, first->method, &AccuracyFit::method);
    const std::string slope = fit != fits.end() && std::isfinite(fit->order) ? fmt::format(", ~ h^{:.2f} \u00b1 {:.1g}", fit->order, fit->error) : "";
    if (first != ladder_end) chart.series.push_back(accuracy_curve({first, ladder_end}, value, 1, slope));
    first = last;
  }
  return chart;
}

}  // namespace

plot::Series accuracy_curve(std::span<const AccuracyRow> rows, double AccuracyRow::*value, double units_per_second,
                            const std::string& slope) {
  plot::Series series{.label = name(rows.front().method) + slope + lacking(rows), .x = {}, .y = {}, .mark = plot::Mark::both};
  for (const AccuracyRow& row : rows) {
    if (!row.done() || !(row.*value > 0) || row.seconds <= 0) continue;
    series.x.push_back(units_per_second * row.seconds);
    series.y.push_back(row.*value);
    series.notes.push_back(milliseconds(row.step));
  }
  return series;
}

std::vector<std::string> accuracy_advice(const AccuracyFigures& figures) {
  std::vector<std::string> lines;
  if (!figures.moves) return {"none: nothing moves, so every step and order is as good; give it a velocity or a force"};
  for (const double target : kTargets) {
    // what is closer than the reference itself cannot be promised
    if (target > figures.reference.gap) lines.push_back(advice_for(figures, &AccuracyRow::error, target, "an error"));
  }
  for (const double target : kTargets) lines.push_back(advice_for(figures, &AccuracyRow::band, target, "an energy band"));
  std::erase(lines, "");
  if (!lines.empty()) lines.push_back(worth_of(figures));
  std::erase(lines, "");
  return lines;
}

std::string accuracy_summary(const AccuracyArguments& arguments, const AccuracySetup& setup, const AccuracyFigures& figures) {
  std::string text;
  const auto row = [&](const char* label, const std::string& value) { text += fmt::format("{:<11} {}\n", label, value); };
  row("model", model_text(arguments, *setup.model));
  row("start", start_text(arguments));
  row("run", fmt::format("{:.6g} s{}, {}", figures.duration,
                         figures.duration < kWhole * figures.asked
                             ? fmt::format(" instead of {:.6g} s, for the budget of {:g} s", figures.asked, setup.budget)
                             : "",
                         gravity_text(setup.options)));
  row("reference", reference_text(figures));
  if (figures.chaotic() && figures.reference.failure.empty()) {
    row("", "beyond that they part, as on a chaotic motion: errors are judged there, and what comes later by its energy");
  }
  if (figures.reference.method == figures.reference.other && figures.reference.failure.empty()) {
    row("", "no other method knows this scene's effects: order 2 is judged by its own run at the smallest step");
  }
  if (figures.rows.empty()) return text;

  using enum Table::Align;
  Table table({{"method", left},
               {"h [ms]", right},
               {"tolerance", right},
               {fmt::format("error at {:.4g} s", figures.reference.horizon), right},
               {"energy band", right},
               {"slope [1/s]", right},
               {"momentum", right},
               {"CPU [ms]", right},
               {"evaluations", right},
               {"", left}});
  bool ladder = true;
  for (const AccuracyRow& one : figures.rows) {
    if (ladder && !one.of_ladder) table.add(std::vector<std::string>(10));
    ladder = one.of_ladder;
    const bool ran = !one.left_out;
    const auto if_ran = [&](const std::string& cell) { return ran ? cell : "-"; };
    table.add({name(one.method), milliseconds(one.step), one.tolerance > 0 ? fmt::format("{:.0e}", one.tolerance) : "-",
               if_ran(short_number(one.error)), if_ran(short_number(one.band)), if_ran(short_number(one.slope)),
               if_ran(short_number(one.momentum)), if_ran(fmt::format("{:.4g}", 1e3 * one.seconds)),
               if_ran(grouped(one.evaluations)), note(one)});
  }
  text += '\n' + table.text() + '\n';
  text += fmt::format(
      "error: largest difference of a coordinate to the reference [rad, m]. Energy band, slope and momentum: relative to the\n"
      "largest kinetic energy ({:.4g} J), over the whole run. Evaluations: of the residual; of the forces for RK4 and Euler.\n",
      figures.reference.kinetic);
  const char* label = "failed";
  for (const AccuracyRow& one : figures.rows) {
    if (one.failure.empty()) continue;
    row(label, printable(fmt::format("{}: {}", step_text(one), one.failure)));
    label = "";
  }
  label = "order";
  for (const AccuracyFit& fit : accuracy_fits(figures)) {
    row(label, fit_text(fit));
    label = "";
  }
  label = "advice";
  for (const std::string& line : accuracy_advice(figures)) {
    row(label, line);
    label = "";
  }
  return text;
}

nlohmann::ordered_json accuracy_json(const AccuracyArguments& arguments, const AccuracySetup& setup,
                                     const AccuracyFigures& figures) {
  using Json = nlohmann::ordered_json;
  const auto if_any = [](bool any, double value) { return any && std::isfinite(value) ? Json(value) : Json(nullptr); };
  const auto random = randomness(arguments);
  const AccuracyReference& reference = figures.reference;
  const bool judged = reference.failure.empty();
  Json rows = Json::array(), fits = Json::array();
  for (const AccuracyRow& row : figures.rows) {
    const bool ran = !row.left_out;
    rows.push_back({{"method", name(row.method)},
                    {"nominal_order", row.method.order},
                    {"step", row.step},
                    {"tolerance", if_any(row.tolerance > 0, row.tolerance)},
                    {"ladder", row.of_ladder},
                    {"error", if_any(ran, row.error)},
                    {"energy_band", if_any(ran, row.band)},
                    {"energy_slope", if_any(ran, row.slope)},
                    {"energy_slope_error", if_any(ran, row.slope_error)},
                    {"momentum_drift", if_any(ran, row.momentum)},
                    {"cpu_seconds", if_any(ran, row.seconds)},
                    {"steps", row.steps},
                    {"split_steps", row.split_steps},
                    {"evaluations", row.evaluations},
                    {"left_out", row.left_out},
                    {"failure", row.failure.empty() ? Json(nullptr) : Json(row.failure)}});
  }
  for (const AccuracyFit& fit : accuracy_fits(figures)) {
    fits.push_back({{"method", name(fit.method)},
                    {"nominal_order", fit.method.order},
                    {"order", if_any(true, fit.order)},
                    {"order_error", if_any(true, fit.error)},
                    {"steps", fit.rows},
                    {"step_from", if_any(std::isfinite(fit.order), fit.from)},
                    {"step_to", if_any(std::isfinite(fit.order), fit.to)}});
  }
  return Json{
      {"command", "accuracy"},
      {"version", kVersion},
      {"model", setup.model->names.model},
      {"source", arguments.model},
      {"bodies", setup.model->tree.bodies()},
      {"dofs", setup.model->degrees_of_freedom()},
      {"gravity", setup.options.gravity},
      {"step", setup.options.step},
      {"seed", random ? Json(random->seed) : Json(nullptr)},
      {"spread", random ? Json(random->spread) : Json(nullptr)},
      {"budget", setup.budget},
      {"duration_asked", figures.asked},
      {"duration", figures.duration},
      {"reference",
       {{"method", name(reference.method)},
        {"step", reference.step},
        {"other_method", name(reference.other)},
        {"other_step", reference.other_step},
        {"horizon", if_any(judged, reference.horizon)},
        {"gap", if_any(judged, reference.gap)},
        {"gap_at_end", if_any(judged, reference.gap_at_end)},
        {"failure", judged ? Json(nullptr) : Json(reference.failure)}}},
      {"chaotic", judged ? Json(figures.chaotic()) : Json(nullptr)},
      {"error_is", "largest difference of a coordinate to the reference at the horizon [rad, m]"},
      {"energy_is", "relative to the largest kinetic energy"},
      {"energy_scale", reference.kinetic},
      {"rows", std::move(rows)},
      {"fits", std::move(fits)},
      {"advice", accuracy_advice(figures)},
      {"failures", std::ranges::count_if(figures.rows, [](const AccuracyRow& row) { return !row.failure.empty(); })},
      {"interrupted", figures.interrupted},
  };
}

std::vector<plot::Chart> accuracy_charts(const AccuracyArguments& arguments, const AccuracySetup& setup,
                                         const AccuracyFigures& figures) {
  plot::Chart error = chart_of(figures, &AccuracyRow::error, accuracy_fits(figures)), energy = chart_of(figures, &AccuracyRow::band, {});
  error.title = fmt::format("What accuracy costs: {}", printable(setup.model->names.model));
  error.subtitle =
      fmt::format("{:.6g} s, {}; start {}; beside the points: step h [ms]; reference: {}", figures.duration, gravity_text(setup.options),
                  start_text(arguments), reference_text(figures));
  error.y.label = fmt::format("error at {:.4g} s [rad, m]", figures.reference.horizon);
  energy.title = "Energy";
  energy.subtitle = fmt::format("largest less smallest total energy over {:.6g} s; beside the points: step h [ms]", figures.duration);
  energy.y.label = "energy band, share of the largest kinetic energy";
  std::vector<plot::Chart> charts;
  for (plot::Chart* chart : {&error, &energy}) {
    if (std::ranges::any_of(chart->series, [](const plot::Series& series) { return !series.x.empty(); })) charts.push_back(std::move(*chart));
  }
  return charts;
}

}  // namespace linden
