// engine/program/rollout_checkpoint.hpp
// Rollouts that survive: `--checkpoint DIR` keeps the state of all instances every so many seconds (engine/files/checkpoint_folder.hpp), and
// `--resume DIR` goes on from the newest one that is whole, to the bit.
//
//   when      --checkpoint-every seconds by the clock after the one before, when the rollout is interrupted, and when it is done
//   what      of each instance what its batch depends on, and what the report at the end says of its beginning
//   for whom  the same command line; how long, how many threads and ranks, and where reports go may differ
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/distributed/ranks.hpp"
#include "engine/files/checkpoint_folder.hpp"
#include "engine/program/rollout_command.hpp"

namespace linden {

/// A command line that goes on from that folder: the words as they were, for a shell, without the folder that checkpoints went to.
std::string command_to_resume(std::span<const char* const> words, const std::string& folder);

/// What a process holds of its instances, first to first + first_energy.size() - 1, after so many steps.
struct RolloutPart {
  std::int64_t first = 0, steps = 0;
  std::int64_t looked_at = -1;  // the step after which energies were taken last
  double step_seconds = 0;      // by the clock, so far
  std::vector<double> first_energy, most_kinetic, last_energy;  // of each instance [J]
  std::string batch;            // Batch::checkpoint

  std::int64_t last() const { return first + static_cast<std::int64_t>(first_energy.size()); }
};

/// All functions but due, resumed and those that return texts are called by all ranks.
class RolloutCheckpoints {
 public:
  using Clock = std::chrono::steady_clock;

  /// Looks at the folder before any long work: with --checkpoint it may hold no checkpoint, with --resume it has to hold one of the same
  /// rollout, and instructions that the arguments do not name are set to those that it was computed with. Throws InputError.
  RolloutCheckpoints(RolloutArguments& arguments, const Model& model, Ranks& ranks);

  bool resumed() const { return resumed_; }
  /// These instances as the checkpoint has them that the rollout goes on from, and what is recorded of all up to there.
  RolloutPart part_of(InstanceRange own) const;
  const RecordedParts& recorded() const { return newest_.recorded; }

  /// Whether the time has come for another one.
  bool due(Clock::time_point now) const { return now >= due_; }
  /// Keeps what the own instances are, and which recording belongs to it. Where that cannot be written it is told, and what there was before
  /// stays. False then.
  bool keep(const RolloutPart& part, const RecordedParts& recorded);

  /// "DIR: the newest after 12,000 steps".
  std::string text() const;
  /// What goes on from it; empty where there is none.
  std::string command() const { return newest_.steps < 0 ? "" : command_; }

 private:
  void begin(RolloutArguments& arguments, const Model& model);
  /// What it threw at the first rank where it did; empty: the checkpoint is there.
  std::string write(const RolloutPart& part, CheckpointManifest& manifest) const;

  Ranks& ranks_;
  CheckpointFolder folder_;
  std::chrono::duration<double> every_;
  CheckpointManifest newest_;
  bool resumed_;
  Clock::time_point due_;
  std::string command_;
};

}  // namespace linden
