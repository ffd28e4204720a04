// engine/distributed/parted_recording.hpp
// A recording that ranks write together, each the instances of its share (instance_range.hpp) into a file of its own, and that grows by
// segments of time: what was recorded before the end of a segment outlives whatever happens later, and is gone on with. Nothing but the
// number of frames goes from rank to rank; rank 0 writes the master (engine/files/h5_master.hpp), which shows all as one.
//
//   PartedRecording<double> recording(*ranks, "run.h5", instances, arrays, fixed);
//   recording.add(time, ...);          frames of the own instances
//   recording.end_segment();           at a checkpoint: what there is so far is in place and whole
//   recording.add(time, ...);
//   recording.commit();
//
// A master shows the frames that all ranks have. Until there is one the recording of that name that was there before stays as it was, and
// its parts go when it is replaced.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/distributed/ranks.hpp"
#include "engine/files/h5_master.hpp"
#include "engine/files/held_room.hpp"
#include "engine/files/parts_folder.hpp"
#include "engine/files/rollout_file.hpp"

namespace linden {

/// All functions but add, frames and parts are called by all ranks. They throw std::runtime_error: `FILE: cannot be written: reason`, and
/// where it is thrown at one rank the same is at all; add throws it at the rank whose disk is full alone, after which commit keeps the frames
/// before, as a RolloutFile does.
template <class Real>
class PartedRecording {
 public:
  /// instances: of all ranks. fixed: of the own ones. packers: as a RolloutFile has them. Throws InputError for a name that does not end in .h5.
  PartedRecording(Ranks& ranks, std::string file, std::int64_t instances, std::vector<RecordedArray> arrays, std::vector<FixedArray> fixed = {},
                  int packers = 0);
  /// Goes on behind these segments, of whatever number of ranks; the numbers of fixed arrays are those of the first segment and are not read.
  /// What was recorded behind them is dropped.
  PartedRecording(Ranks& ranks, std::string file, std::int64_t instances, std::vector<RecordedArray> arrays, std::vector<FixedArray> fixed,
                  RecordedParts done, int packers = 0);
  ~PartedRecording();

  /// A frame of the own instances, as RolloutFile::add.
  void add(double time, std::span<const std::span<const Real>> arrays, std::span<const Real> energy, std::span<const std::uint8_t> status);
  /// Puts all frames in place and begins another segment; where there are no new ones nothing happens.
  void end_segment();
  /// Puts all frames in place. Throws where there are none because the first one did not fit.
  void commit();

  /// After end_segment or commit: those in place; between them those of the own part are counted too.
  std::int64_t frames() const;
  /// That are in place.
  const RecordedParts& parts() const { return done_; }

 private:
  void begin_segment();
  void put_in_place();
  void write_master();
  std::vector<RecordingPart> parts_of_master() const;
  std::size_t bytes_of_master() const;
  /// Does `work`, and returns what it throws.
  std::string fault_of(const std::function<void()>& work) const;
  /// A message with the recording's name in place of the part's.
  std::string of_recording(std::string text) const;

  Ranks& ranks_;
  std::string file_;
  std::int64_t instances_;
  std::vector<RecordedArray> arrays_;
  std::vector<FixedArray> fixed_;
  int packers_;
  RecordedParts done_;
  PartsFolder folder_;
  std::optional<HeldRoom> room_;  // for the master, at rank 0
  std::string part_file_;
  std::optional<RolloutFile<Real>> part_;
};

}  // namespace linden
