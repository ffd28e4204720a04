#include "engine/program/scaling_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/program/motion_arguments.hpp"
#include "engine/text.hpp"
#include "engine/version.hpp"

namespace linden {
namespace {

constexpr double kFitFrom = 100;  // degrees of freedom: below, what a step costs whatever the size counts too

std::string solvers_text(const ScalingArguments& arguments) {
  std::vector<std::string_view> names;
  for (const Solver solver : arguments.solvers) names.push_back(name(solver));
  return fmt::format("{}", fmt::join(names, " and "));
}

std::string method_text(const ScalingArguments& arguments) {
  const Options& options = arguments.options;
  return fmt::format("{}, step {:g} s, tolerance {:g} ({}), first guess {}, {}", solvers_text(arguments), options.step, options.tolerance,
                     name(options.stop), name(options.guess), gravity_text(options));
}

std::string start_text(const ScalingArguments& arguments) {
  return fmt::format("random positions and speeds, seed {}, spread {:g}", arguments.seed, arguments.spread);
}

/// Four digits, whole numbers in groups: "6.124", "1,234".
std::string four_digits(double value) {
  if (value >= 999.95) return grouped(std::llround(value));
  return fmt::format("{:.{}f}", value, value < 9.9995 ? 3 : value < 99.995 ? 2 : 1);
}

std::vector<std::string> cells(const ScalingRow& row) {
  std::vector<std::string> result{std::string(name(row.solver)), grouped(row.bodies), grouped(row.dofs), fmt::format("{}", row.threads),
                                  grouped(row.run.steps)};
  if (row.failed()) {
    result.insert(result.end(), {"failed", "-", "-", "-", "-", "-"});
  } else {
    result.insert(result.end(), {four_digits(1e6 * row.seconds_per_step()), fmt::format("{:.0f}", row.ns_per_body()),
                                 fmt::format("{:.2f}", row.evaluations_mean()), fmt::format("{:.2f}", row.iterations_mean()),
                                 fmt::format("{}", row.run.most_iterations), grouped(row.run.split_steps)});
  }
  result.push_back(memory_text(row.bytes));
  const double change = row.energy_change();
  result.push_back(!row.failed() && std::isfinite(change) ? fmt::format("{:+.1e}", change) : "-");
  return result;
}

/// "1.014 ± 0.003", or without an error where two points leave none.
std::string exponent_text(const PowerLaw& law) {
  return fmt::format("{:.3f}{}", law.exponent, std::isfinite(law.error) ? fmt::format(" \u00b1 {:.3f}", law.error) : "");
}

std::string fit_text(Solver solver, const PowerLaw& law) {
  if (law.points < 2) return fmt::format("{}: {}", name(solver), law.points == 0 ? "no size to fit" : "nothing to fit to one size");
  return fmt::format("{}: time ~ DOFs^{}, {} sizes from {} DOFs on", name(solver), exponent_text(law), law.points,
                     grouped(std::llround(law.least)));
}

}  // namespace

double ScalingRow::seconds_per_step() const {
  if (failed() || seconds.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted = seconds;
  std::ranges::sort(sorted);
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
}

PowerLaw scaling_fit(const ScalingFigures& figures, Solver solver) {
  std::vector<double> dofs, seconds;
  for (const ScalingRow& row : figures.rows) {
    if (row.solver != solver || row.failed()) continue;
    dofs.push_back(row.dofs);
    seconds.push_back(row.seconds_per_step());
  }
  return power_law(dofs, seconds, kFitFrom);
}

std::string scaling_summary(const ScalingArguments& arguments, const ScalingFigures& figures) {
  std::string text;
  const auto row = [&](const char* label, const std::string& value) { text += fmt::format("{:<11} {}\n", label, value); };
  row("shape", fmt::format("{}, {} to {} of freedom", arguments.shape.name, grouped(arguments.sizes.least),
                           counted(arguments.sizes.most, "degree")));
  row("start", start_text(arguments));
  row("method", method_text(arguments));
  if (figures.rows.empty()) return text;

  using enum Table::Align;
  Table table({{"solver", left},
               {"bodies", right},
               {"DOFs", right},
               {"threads", right},
               {"steps", right},
               {"\u00b5s/step", right},
               {"ns/body", right},
               {"evaluations", right},
               {"iterations", right},
               {"most", right},
               {"split", right},
               {"memory", right},
               {"energy", right}});
  for (const Solver solver : arguments.solvers) {
    for (const ScalingRow& measured : figures.rows) {
      if (measured.solver == solver) table.add(cells(measured));
    }
  }
  text += '\n' + table.text() + '\n';
  for (std::size_t k = 0; k < arguments.solvers.size(); ++k) {
    row(k == 0 ? "exponent" : "", fit_text(arguments.solvers[k], scaling_fit(figures, arguments.solvers[k])));
  }
  text += "Time per step is the median of the stretches; evaluations of the residual and iterations are means over steps. energy: change\n"
          "from the first measured step to the last, relative to the largest kinetic energy.\n";
  const char* label = "failed";
  for (const ScalingRow& measured : figures.rows) {
    if (!measured.failed()) continue;
    row(label, printable(fmt::format("{}, {}: {}", name(measured.solver), measured.model, measured.failure)));
    label = "";
  }
  return text;
}

nlohmann::ordered_json scaling_json(const ScalingArguments& arguments, const ScalingFigures& figures) {
  using Json = nlohmann::ordered_json;
  const Options& options = arguments.options;
  const auto if_any = [](bool any, double value) { return any && std::isfinite(value) ? Json(value) : Json(nullptr); };
  Json rows = Json::array(), fits = Json::array();
  for (const ScalingRow& row : figures.rows) {
    const bool ran = !row.failed() && !row.seconds.empty();
    rows.push_back({{"solver", name(row.solver)},
                    {"model", row.model},
                    {"bodies", row.bodies},
                    {"dofs", row.dofs},
                    {"threads", row.threads},
                    {"steps", row.run.steps},
                    {"seconds_per_step", if_any(ran, row.seconds_per_step())},
                    {"seconds_per_step_least", if_any(ran, ran ? std::ranges::min(row.seconds) : 0)},
                    {"seconds_per_step_most", if_any(ran, ran ? std::ranges::max(row.seconds) : 0)},
                    {"ns_per_body_step", if_any(ran, row.ns_per_body())},
                    {"evaluations_mean", if_any(ran, row.evaluations_mean())},
                    {"iterations_mean", if_any(ran, row.iterations_mean())},
                    {"iterations_max", row.run.most_iterations},
                    {"split_steps", row.run.split_steps},
                    {"bytes", row.bytes},
                    {"energy_change", if_any(ran, row.energy_change())},
                    {"failure", row.failed() ? Json(row.failure) : Json(nullptr)}});
  }
  for (const Solver solver : arguments.solvers) {
    const PowerLaw law = scaling_fit(figures, solver);
    fits.push_back({{"solver", name(solver)},
                    {"exponent", if_any(true, law.exponent)},
                    {"exponent_error", if_any(true, law.error)},
                    {"points", law.points},
                    {"dofs_from", if_any(law.points > 0, law.least)}});
  }
  return Json{
      {"command", "scaling"},
      {"version", kVersion},
      {"shape", arguments.shape.name},
      {"dofs", {arguments.sizes.least, arguments.sizes.most}},
      {"guess", name(options.guess)},
      {"stop", name(options.stop)},
      {"tolerance", options.tolerance},
      {"step", options.step},
      {"gravity", options.gravity},
      {"seed", arguments.seed},
      {"spread", arguments.spread},
      {"seconds_per_step_is", "median over stretches of the measured steps"},
      {"energy_change_is", "from the first measured step to the last, relative to the largest kinetic energy"},
      {"rows", std::move(rows)},
      {"fits", std::move(fits)},
      {"rows_planned", figures.rows_planned},
      {"failures", std::ranges::count_if(figures.rows, &ScalingRow::failed)},
      {"interrupted", figures.signal != 0},
  };
}

plot::Chart scaling_chart(const ScalingArguments& arguments, const ScalingFigures& figures) {
  plot::Chart chart;
  chart.title = fmt::format("Time per step over size: {}", arguments.shape.name);
  chart.subtitle = fmt::format("{}; start {}", method_text(arguments), start_text(arguments));
  chart.x = {"degrees of freedom", true};
  chart.y = {"time per step [\u00b5s]", true};
  double begin = std::numeric_limits<double>::infinity(), end = 0, least_per_dof = begin;
  for (const Solver solver : arguments.solvers) {
    const PowerLaw law = scaling_fit(figures, solver);
    plot::Series series{.label = std::string(name(solver)), .x = {}, .y = {}, .mark = plot::Mark::both};
    if (law.points >= 2) series.label += fmt::format(", slope {}", exponent_text(law));
    std::vector<std::string> failed;
    for (const ScalingRow& row : figures.rows) {
      if (row.solver != solver) continue;
      if (row.failed()) failed.push_back(grouped(row.dofs));
      const double time = 1e6 * row.seconds_per_step();  // NaN where it failed: a gap
      series.x.push_back(row.dofs);
      series.y.push_back(time);
      if (!std::isfinite(time)) continue;
      begin = std::min<double>(begin, row.dofs);
      end = std::max<double>(end, row.dofs);
      least_per_dof = std::min(least_per_dof, time / row.dofs);
    }
    if (!failed.empty()) series.label += fmt::format(", failed at {} DOFs", fmt::join(failed, "; "));
    chart.series.push_back(std::move(series));
  }
  if (begin < end) {
    const double beside = 0.6 * least_per_dof;  // below all curves
    chart.series.push_back({"linear, slope 1", {begin, end}, {beside * begin, beside * end}, plot::Mark::guide});
  }
  return chart;
}

}  // namespace linden
