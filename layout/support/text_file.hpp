// layout/support/text_file.hpp
// All of a text file, or one message why not; and which files were read.
#pragma once

#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

namespace linden {

/// Far more than any robot, mesh or table; what is longer, such as /dev/zero, may have no end.
inline constexpr std::size_t kMostBytes = std::size_t{1} << 30;

/// All of a file, of at most `most_bytes`. `what` says in messages what it should be.
/// Throws InputError: `file: what was found; what was expected; what to do`.
std::string read_text(const std::string& file, const std::string& what, std::size_t most_bytes = kMostBytes);

/// The files that this thread reads while it lives, models and meshes and tables alike: what must not be written over.
class FilesRead {
 public:
  FilesRead();
  ~FilesRead();
  FilesRead(const FilesRead&) = delete;
  FilesRead& operator=(const FilesRead&) = delete;

  const std::vector<std::string>& names() const { return names_; }

 private:
  friend std::ifstream open_to_read(const std::string& file);

  FilesRead* const around_;  // lived before and lives on: it is told too
  std::vector<std::string> names_;
};

/// Every reader of models, scenes and what they name opens its files so.
std::ifstream open_to_read(const std::string& file);

}  // namespace linden
