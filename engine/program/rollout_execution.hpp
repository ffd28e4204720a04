// engine/program/rollout_execution.hpp
// A rollout from its start to its files, as `linden rollout` has it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "engine/batch.hpp"
#include "engine/distributed/parted_recording.hpp"
#include "engine/distributed/ranks.hpp"
#include "engine/files/rollout_file.hpp"
#include "engine/initial_state.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/progress.hpp"
#include "engine/program/quantities.hpp"
#include "engine/program/randomize.hpp"
#include "engine/program/rollout_checkpoint.hpp"
#include "engine/program/rollout_command.hpp"
#include "engine/program/rollout_report.hpp"
#include "engine/queries/observations.hpp"
#include "engine/scene/scene.hpp"
#include "engine/view/animation_recorder.hpp"

namespace linden {

/// One rollout from its start to its files.
template <class Real>
class RolloutExecution {
 public:
  /// Of the rank's share of the instances. checkpoints: null where none are kept.
  RolloutExecution(Ranks& ranks, const RolloutArguments& arguments, std::shared_ptr<const Model> model, std::int64_t steps,
                   RolloutCheckpoints* checkpoints);

  // each by all ranks

  /// The files that are written while it goes on.
  void begin();

  void steps(const Interrupt& interrupt);

  /// Complaints go to stderr; true where there were none.
  bool write_files();

  RolloutFigures& figures() { return figures_; }

 private:
  /// What is drawn and how to step are the command line's; the start was looked at (look_at_start).
  static Scene scene_of(const RolloutArguments& arguments, const Model& model, std::int64_t first);
  // i: among the instances of all ranks
  std::uint64_t seed_of(std::int64_t i) const { return randomness(arguments_)->seed + static_cast<std::uint64_t>(i); }
  InitialState start_of(std::int64_t i) const;
  DrawnNumbers drawn_of(std::int64_t i) const { return draw(arguments_.randomization, *model_, effects_, seed_of(i)); }

  /// Of the first instance that runs.
  void account_of_one(const Interrupt& interrupt);

  /// All steps of a stretch.
  void advance(std::int64_t end, Progress& progress);

  /// What was asked for, but observations.
  std::vector<RecordedArray> arrays_of_what();
  bool records() const { return !arguments_.record.empty(); }
  void recording(const std::function<void()>& work);

  /// Energies of all instances, and a frame of the file.
  void look();

  /// What the instances are now goes into a checkpoint, and what was recorded of them is put in place; nothing where a rank has failed.
  void keep(bool failed);
  /// The instances are what they were in the checkpoint.
  void resume();
  /// Of the recording, after the steps that were taken.
  std::int64_t frames_due() const { return figures_.steps / arguments_.every + 1; }

  void begin_views();

  /// A frame of the instances that are shown.
  void look_at_shown();

  /// What was asked for beside what_, an array of each behind those.
  void observe();

  /// What is told of the instances of all ranks.
  void gather_figures();

  Ranks& ranks_;
  const InstanceRange own_;
  const RolloutArguments& arguments_;
  RolloutCheckpoints* const checkpoints_;
  std::shared_ptr<const Model> model_;
  const Effects effects_;
  const std::optional<Observations> observations_;
  BatchOf<Real> batch_;
  RolloutFigures figures_;
  DrawnArrays drawn_;
  std::vector<double> first_energy_, last_energy_, most_kinetic_;  // of each of the own instances [J]
  std::optional<RolloutFile<Real>> file_;       // of one rank
  std::optional<PartedRecording<Real>> parts_;  // of several, or with checkpoints
  std::vector<Quantity> what_;              // that is recorded
  std::vector<std::vector<Real>> numbers_;   // of it, instance by instance
  std::vector<Real> energy_, observed_;
  std::vector<std::uint8_t> status_;
  std::optional<AnimationRecorder> recorder_;  // of the instances that are shown
  std::int64_t frame_stride_ = 1;
  std::vector<double> shown_positions_;
  std::int64_t looked_at_ = -1;
};

}  // namespace linden
