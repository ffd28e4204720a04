// engine/files/recorded_arrays.hpp
// A recording read back: arrays of numbers and lists of words, as engine/files/rollout_file.hpp writes them, or NumPy and h5py do.
//
//   .npz  arrays of '<f8', '<f4', '|u1', '<i8', '<i4' in C order, and lists of '<U' text
//   .h5   datasets in the root of numbers, and of text of fixed length
//   .csv  a table with a line of names: `time` [F], and all other columns as q [F, 1, columns] with their names as `positions`
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace linden {

struct NumberArray {
  std::vector<std::int64_t> shape;
  std::vector<double> numbers;
};

struct RecordedArrays {
  std::map<std::string, NumberArray> numbers;
  std::map<std::string, std::vector<std::string>> words;
  std::map<std::string, std::string> unread;  // arrays of other types, and these
};

/// Whether a file's name says that it is a recording.
bool is_recording(const std::string& file);

/// Throws InputError for what cannot be read or is no such file: `FILE: what was found; what was expected; what to do`; MemoryError where an
/// array is larger than this machine holds.
RecordedArrays read_recording(const std::string& file);

}  // namespace linden
