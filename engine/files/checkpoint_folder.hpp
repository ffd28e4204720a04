// engine/files/checkpoint_folder.hpp
// A folder of checkpoints of one rollout, the newest few of them:
//
//   DIR/0000000012000/part-0              what one process holds after 12,000 steps, as many parts as there are processes
//   DIR/0000000012000/manifest.json       what it belongs to, and of each part its instances, size and checksum
//
// The manifest is written last, when all parts are on the disk: with it there is a checkpoint, without it none. Older ones than are to be
// kept are removed after that, their manifests first. So whatever happens at whatever moment, the newest that has a manifest is whole, and a
// disk that loses bytes of it later loses what was between it and the one before.
//
// While a process works with the folder it is locked (engine/files/leftovers.hpp), so that no two write there.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/files/parts_folder.hpp"

namespace linden {

struct CheckpointPart {
  std::string file;                 // within the folder of the checkpoint
  std::int64_t first = 0, last = 0;  // instances first to last - 1
  std::uint64_t bytes = 0, checksum = 0;
};

struct CheckpointManifest {
  std::int64_t steps = -1;  // -1: there is no checkpoint
  std::vector<std::pair<std::string, std::string>> of;  // what has to be the same for it to go on: what it is called, what it is
  std::vector<CheckpointPart> parts;
  RecordedParts recorded;  // that belong to it
};

/// As the file of a manifest has it. manifest_from throws InputError for a text that is no such thing, or not as it was written.
std::string manifest_text(const CheckpointManifest& manifest);
CheckpointManifest manifest_from(const std::string& text, const std::string& name);

class CheckpointFolder {
 public:
  /// The folder is neither made nor looked at.
  CheckpointFolder(std::string path, std::int64_t kept) : path_(std::move(path)), kept_(kept) {}
  ~CheckpointFolder();
  CheckpointFolder(const CheckpointFolder&) = delete;
  CheckpointFolder& operator=(const CheckpointFolder&) = delete;

  const std::string& path() const { return path_; }
  /// Of the checkpoint after so many steps.
  std::string of_step(std::int64_t steps) const;

  /// Throws InputError for a folder that can be none, may not be written, or that holds checkpoints already.
  void check_free() const;
  /// Throws InputError where there is no such folder.
  void check_there() const;
  /// Makes the folder where there is none, and locks it. What a killed process left of a checkpoint is told and removed. Throws InputError
  /// where another process works with it, cannot_be_written where it cannot be made.
  void open();

  /// The newest checkpoint that is whole. One that is not is told, and put aside as NUMBER.damaged. Throws InputError where there is none.
  CheckpointManifest newest() const;
  /// Bytes of a part. Throws InputError where they are not those that were written.
  std::string read(const CheckpointManifest& manifest, const CheckpointPart& part) const;

  /// One part of the checkpoint after so many steps, the number-th. Throws cannot_be_written.
  CheckpointPart write(std::int64_t steps, std::int64_t number, std::int64_t first, std::int64_t last, std::string_view bytes) const;
  /// All parts are there: from now on it is a checkpoint. Those beyond the newest few are removed. Throws cannot_be_written.
  void complete(const CheckpointManifest& manifest) const;
  /// What there is of one that could not be written goes.
  void abandon(std::int64_t steps) const;
  /// Removes the oldest, to make room. False where there is one alone, which stays.
  bool drop_oldest() const;

 private:
  /// Steps of those that have a manifest, or of those that have none, the newest first.
  std::vector<std::int64_t> steps_there(bool whole) const;
  CheckpointManifest manifest_of(std::int64_t steps) const;

  std::string path_;
  std::int64_t kept_;
  int held_ = -1;  // the folder, locked
};

}  // namespace linden
