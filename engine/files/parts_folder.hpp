// engine/files/parts_folder.hpp
// The folder beside a recording FILE.h5 that holds its parts: a grid of segments of time, one after another, and of ranks, each with a share
// of the instances (engine/distributed/instance_range.hpp).
//
//   .run.h5.linden.1f3a9c02.part/   while there is no master yet; it goes with whoever gives up, and is removed where that was killed
//   run.h5.1f3a9c02.parts/          from then on
//     0.2-of-4.h5                   segment 0 of rank 2 of 4
//
// One process makes it and holds its lock (leftovers.hpp); others may write into it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/files/destination.hpp"

namespace linden {

/// Frames one after another that the same ranks have recorded.
struct RecordedSegment {
  std::int64_t frames;
  int ranks;
  bool operator==(const RecordedSegment&) const = default;
};

/// What is in place of a recording: all that is needed to go on with it.
struct RecordedParts {
  std::string letters;  // of the folder of its parts
  std::vector<RecordedSegment> segments;

  std::int64_t frames() const {
    std::int64_t frames = 0;
    for (const RecordedSegment& segment : segments) frames += segment.frames;
    return frames;
  }
};

/// Whether this is how such a folder is called once there is a master.
bool is_parts_folder(std::string_view name);

/// All functions throw cannot_be_written, naming FILE.
class PartsFolder {
 public:
  /// A new one, which is not there yet.
  explicit PartsFolder(const std::string& file);
  /// That another process has made, or that an earlier one has kept.
  PartsFolder(const std::string& file, std::string letters, bool kept);
  /// Removes the folder where this is who made it, and it was not kept.
  ~PartsFolder();
  PartsFolder(const PartsFolder&) = delete;
  PartsFolder& operator=(const PartsFolder&) = delete;

  /// That tell it from the folders of other recordings.
  const std::string& letters() const { return letters_; }
  /// Where it is now.
  std::string path() const;
  /// Where a part is now, and as the master refers to it.
  std::string part(std::size_t segment, int rank, int ranks) const;
  std::string part_of_master(std::size_t segment, int rank, int ranks) const;

  /// Makes the folder and holds it.
  void make();
  /// Holds one that was kept. Throws where another process writes there, and where a part of these segments is not there.
  void take(std::span<const RecordedSegment> segments);
  /// Removes all that is in it but the parts of these segments: what was begun and is not needed.
  void clear_but(std::span<const RecordedSegment> segments) const;
  /// From now on it bears the name that the master refers to; who made it renames it, and others know of it afterwards.
  void keep();

 private:
  std::string name() const;  // when it is kept

  Destination target_;
  std::string letters_;
  bool kept_;
  int held_ = -1;  // the folder, locked (leftovers.hpp)
};

}  // namespace linden
