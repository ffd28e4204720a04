// engine/program/scaling_report.hpp
// Time per step over the size of the model: for people, for scripts, and as a picture.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "engine/program/plot.hpp"
#include "engine/program/power_law.hpp"
#include "engine/program/scaling_command.hpp"
#include "engine/step_report.hpp"

namespace linden {

/// One size and solver. Counts and energies are of the measured steps.
struct ScalingRow {
  Solver solver{};
  std::string model;
  Index bodies = 0, dofs = 0;
  int threads = 1;  // that step it
  std::size_t bytes = 0;  // state, workspace, constants and tree
  StepsReport run;
  std::vector<double> seconds;                            // per step, of each stretch
  double first_energy = 0, last_energy = 0, kinetic = 0;  // [J]; kinetic: the largest between two stretches
  std::string failure;                                    // empty where every step converged

  bool failed() const { return !failure.empty(); }
  double seconds_per_step() const;  // median over the stretches; NaN where a step failed
  double ns_per_body() const { return 1e9 * seconds_per_step() / bodies; }
  double iterations_mean() const { return static_cast<double>(run.iterations) / static_cast<double>(run.steps); }
  double evaluations_mean() const { return static_cast<double>(run.evaluations) / static_cast<double>(run.steps); }
  double energy_change() const { return (last_energy - first_energy) / kinetic; }
};

struct ScalingFigures {
  std::vector<ScalingRow> rows;
  std::size_t rows_planned = 0;
  int signal = 0;  // that ended the measurement
};

PowerLaw scaling_fit(const ScalingFigures& figures, Solver solver);

std::string scaling_summary(const ScalingArguments& arguments, const ScalingFigures& figures);
nlohmann::ordered_json scaling_json(const ScalingArguments& arguments, const ScalingFigures& figures);
/// Time per step over degrees of freedom, both logarithmic, with the slope of linear growth beside the curves.
plot::Chart scaling_chart(const ScalingArguments& arguments, const ScalingFigures& figures);

}  // namespace linden
