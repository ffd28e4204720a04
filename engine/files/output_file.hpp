// engine/files/output_file.hpp
// Files that appear whole or not at all: a temporary file beside the target is renamed onto it when all is written.
#pragma once

#include <cstdio>
#include <initializer_list>
#include <string>
#include <string_view>

namespace linden {

class OutputFile {
 public:
  /// Throws std::runtime_error, as write and commit do: `FILE: cannot be written: reason`.
  explicit OutputFile(std::string target);
  /// What was not committed is deleted.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view bytes);
  void commit();

 private:
  [[noreturn]] void fail();

  std::string target_, temporary_;
  std::FILE* file_ = nullptr;
};

/// Writes a whole file.
void write_file(const std::string& file, std::string_view bytes);

/// Whether both names lead to the same place, be there a file or not.
bool same_file(const std::string& a, const std::string& b);

/// Before long work: throws InputError where `file` has none of the endings (if there are any), is a folder or cannot be written.
void require_writable(const std::string& option, const std::string& file, std::initializer_list<std::string_view> endings);

}  // namespace linden
