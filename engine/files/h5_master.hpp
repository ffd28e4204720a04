// engine/files/h5_master.hpp
// A recording in parts: FILE.h5 holds names, and of the arrays where in which other file each frame and instance lies (HDF5's virtual
// datasets), so that it reads like the recording of one process, and a folder beside it the numbers.
//
//   run.h5                              the master: what people and programs open
//   run.h5.1f3a9c02.parts/0.2-of-4.h5   a part (parts_folder.hpp): an ordinary recording of some frames of some instances
//
// Paths are relative: both may be moved together. Where a part is not there HDF5 gives NaN, and of the status 255.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/files/array_file.hpp"
#include "engine/files/h5_output.hpp"

namespace linden {

/// Frames and instances that lie in a file of their own, whose path is relative to the master's folder. It may have more frames.
struct RecordingPart {
  std::string file;
  std::int64_t first_frame, frames, first_instance, instances;
};

/// The arrays of numbers have as many rows as the parts have frames, and are fixed arrays those of the parts that begin with the first frame.
class H5Master final : public ArrayLayout {
 public:
  H5Master(const std::string& file, std::vector<RecordingPart> parts);

  void add_numbers(const std::string& name, ElementType type, std::vector<std::int64_t> row, std::vector<std::string> columns) override;
  void describe(std::span<const std::string> names, const std::string& units) override;
  /// The numbers are in the parts; none are read here.
  void add_fixed(const std::string& name, std::vector<std::int64_t> shape, std::span<const double> numbers) override;
  void add_words(const std::string& name, std::span<const std::string> words) override;
  /// Puts it in place, where `before` has given the parts the names that it refers to.
  void commit(const std::function<void()>& before);

 private:
  /// Of an array [sizes]: gives it the fill value and its places in a part, from `start` on.
  void map(const Handle& creation, const Handle& space, const std::string& name, const std::string& file, std::span<const hsize_t> start,
           std::span<const hsize_t> count) const;
  void fill(const Handle& creation, ElementType type) const;

  H5Output out_;
  std::vector<RecordingPart> parts_;
  hsize_t frames_ = 0;
  Handle last_;  // dataset of numbers
};

/// The folder that a master's parts lie in, by its name beside the master; empty for any other file, or none.
std::string parts_folder_of(const std::string& file);
/// Parts that a master of this name no longer refers to, in the folder of that name; nothing for an empty one.
void remove_parts(const std::string& file, const std::string& folder);

/// Bytes that a master takes for a part of an array, at most.
inline constexpr std::size_t kMasterBytesPerPart = 512;

}  // namespace linden
