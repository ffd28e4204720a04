// engine/files/output_file.hpp
// Files that appear whole or not at all: a temporary file beside the destination is renamed onto it when all is written.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "engine/files/destination.hpp"
#include "engine/files/growing_file.hpp"

namespace linden {

class OutputFile {
 public:
  /// Throws InputError for what is no ordinary file; std::runtime_error, as write and commit do: `FILE: cannot be written: reason`.
  explicit OutputFile(std::string target);
  /// What was not committed is deleted.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Bytes that stay together: where the disk is full in the midst of them commit puts in place what was whole before.
  void write(std::string_view record);
  void commit();
  /// Of what was written for commit only what finds room.
  void settle() { file_.settle(); }

  /// Records that are kept.
  std::int64_t records() const { return file_.records(); }

 private:
  Destination target_;
  std::string temporary_;  // empty when it is no more
  GrowingFile file_;
};

/// Writes a whole file.
void write_file(const std::string& file, std::string_view bytes);

/// A file that an option of the command line names. Its name has one of the endings, any where there are none.
struct Output {
  const char* option;
  std::string file;  // empty: none is written
  std::vector<std::string_view> endings;
};

/// What a command is to write, looked at before long work.
class Outputs {
 public:
  /// Throws InputError where one cannot be written or two of them are one file. What processes that were killed left of them is told and
  /// removed.
  Outputs(std::initializer_list<Output> outputs) : Outputs(std::vector<Output>(outputs)) {}
  explicit Outputs(const std::vector<Output>& outputs);
  /// Throws InputError where one of them is a file that is read, whatever path or link leads there.
  void spare(const std::vector<std::string>& read) const;

 private:
  std::vector<Output> outputs_;
};

}  // namespace linden
