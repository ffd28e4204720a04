// engine/program/rollout_report.hpp
// How a rollout went: for people and for scripts.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/drift.hpp"
#include "engine/program/energy_change.hpp"
#include "engine/program/rollout_command.hpp"

namespace linden {

/// Of an instance on its own, from the same start: where effects act, a batch keeps no account of their work.
struct AccountOfOne {
  std::int64_t instance = 0, steps = 0;
  EnergyDrift energy;  // of H plus what effects took less what they gave
  double taken = 0, given = 0;        // [J]
  std::vector<std::string> warnings;  // where its motion is not to be trusted
};

/// Counted while a rollout goes on.
struct RolloutFigures {
  std::int64_t steps_planned = 0, steps = 0;  // of each instance
  double step_seconds = 0, total_seconds = 0;  // by the clock: within Batch::step, and everything
  int ranks = 1, lanes = 0, threads = 0;  // threads: of all ranks
  std::size_t bytes = 0;  // kept of the instances
  BatchSummary summary;
  EnergyChange energy;
  std::vector<std::string> failures;                            // the first few, one sentence each
  std::optional<AccountOfOne> account;                          // where effects act
  int signal = 0;                                               // that ended the rollout
  std::int64_t frames = 0;                                      // recorded
  std::vector<std::string> views;                               // files that show the motion, and what each holds
  bool kept = true;                                             // the checkpoint that was to be written last
  std::string checkpoint;                                       // where there are some, and what the newest is
  std::string lost;                                             // why the recording ended early, and the rollout with it

  double steps_per_second() const { return static_cast<double>(summary.steps) / step_seconds; }
};

std::string rollout_summary(const RolloutArguments& arguments, const Model& model, const RolloutFigures& figures);
nlohmann::ordered_json rollout_json(const RolloutArguments& arguments, const Model& model, const RolloutFigures& figures);

}  // namespace linden
