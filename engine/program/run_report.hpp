// engine/program/run_report.hpp
// What a run was and how it went: for people, for scripts, as a picture.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/drift.hpp"
#include "engine/program/plot.hpp"
#include "engine/program/run_command.hpp"
#include "engine/step_report.hpp"

namespace linden {

/// Rows of an array over time, the first few.
struct QuantityTrace {
  std::optional<Quantity> quantity;  // none: an observation
  std::string array, units;
  std::vector<std::string> rows;                 // their names
  std::size_t all = 0;                           // rows that there are
  std::vector<std::vector<plot::Point>> points;  // of each
};

/// Counted while a run goes on.
struct RunFigures {
  DrawnNumbers drawn;  // of what is randomised
  std::int64_t steps_planned = 0;
  StepsReport run;
  std::int64_t sampled_every = 1;  // steps between samples of energy and momentum
  double begin = 0;                // time at the first sample [s]
  std::optional<double> end;       // where steps vary: time at the last one [s]
  std::string steps_why;           // what variable steps, or none, were chosen by; empty where no accuracy was asked for
  double step_seconds = 0;         // by the clock, within Simulation::run
  double total_seconds = 0;        // by the clock, everything
  EnergyDrift energy;          // of H plus what effects took less what they gave
  double taken = 0, given = 0;  // by effects since the first sample [J]
  std::optional<MomentumDrift> momentum;
  std::vector<plot::Point> trace;  // drift of that energy [J] over time, for the picture
  std::vector<QuantityTrace> traces;  // of what is to be plotted in its place
  std::string failure;             // what Simulation::describe says of the step that failed
  int signal = 0;                  // that ended the run
  std::int64_t rows = 0;           // of the recording
  std::vector<std::string> views;  // files that show the motion, and what each holds
  std::string lost;                // why the recording ended early, and the run with it

  bool complete() const { return failure.empty() && signal == 0 && lost.empty(); }
  double simulated(double step) const { return end ? *end - begin : static_cast<double>(run.steps) * step; }
};

/// What to say of a run whose motion cannot be trusted: passive effects that gave energy, each by name; or energy that strays far. None for
/// others.
std::vector<std::string> energy_warnings(const Simulation& simulation, const EnergyDrift& energy);

std::string run_summary(const RunArguments& arguments, const Simulation& simulation, const RunFigures& figures);
nlohmann::ordered_json run_json(const RunArguments& arguments, const Simulation& simulation, const RunFigures& figures);
/// What is plotted: the drift of energy, or what was asked for, a panel each.
std::vector<plot::Chart> run_charts(const RunArguments& arguments, const Simulation& simulation, const RunFigures& figures);

}  // namespace linden
