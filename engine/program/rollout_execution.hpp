// engine/program/rollout_execution.hpp
// A rollout from its start to its files, as `linden rollout` has it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "engine/batch.hpp"
#include "engine/distributed/parted_recording.hpp"
#include "engine/files/rollout_file.hpp"
#include "engine/initial_state.hpp"
#include "engine/program/interrupt.hpp"
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
  /// checkpoints: null where none are kept.
  RolloutExecution(const RolloutArguments& arguments, std::shared_ptr<const Model> model, std::int64_t steps, Ranks& ranks,
                   RolloutCheckpoints* checkpoints);

  void steps(const Interrupt& interrupt);

  /// Complaints go to stderr; true where there were none.
  bool write_files();

  RolloutFigures& figures() { return figures_; }

 private:
  /// What is drawn and how to step are the command line's; the start was looked at (look_at_start).
  static Scene scene_of(const RolloutArguments& arguments, const Model& model);
  std::uint64_t seed_of(std::int64_t i) const { return randomness(arguments_)->seed + static_cast<std::uint64_t>(i); }
  InitialState start_of(std::int64_t i) const;
  DrawnNumbers drawn_of(std::int64_t i) const { return draw(arguments_.randomization, *model_, effects_, seed_of(i)); }

  /// Of the first instance that runs.
  void account_of_one(const Interrupt& interrupt);

  void begin_recording(const std::vector<FixedArray>& drawn);
  void recording(const std::function<void()>& work);

  /// Energies of all instances, and a frame of the file.
  void look();

  /// What the instances are now goes into a checkpoint, and what was recorded of them is put in place.
  void keep();
  /// The instances are what they were in the checkpoint.
  void resume();
  /// Of the recording, after the steps that were taken.
  std::int64_t frames_due() const { return figures_.steps / arguments_.every + 1; }

  void begin_views();

  /// A frame of the instances that are shown.
  void look_at_shown();

  /// What was asked for beside what_, an array of each behind those.
  void observe();

  void finish();

  const RolloutArguments& arguments_;
  Ranks& ranks_;
  RolloutCheckpoints* const checkpoints_;
  std::shared_ptr<const Model> model_;
  const Effects effects_;
  const std::optional<Observations> observations_;
  BatchOf<Real> batch_;
  RolloutFigures figures_;
  std::optional<RolloutFile<Real>> file_;
  std::optional<PartedRecording<Real>> parts_;  // in its place where there are checkpoints
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
