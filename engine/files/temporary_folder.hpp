// engine/files/temporary_folder.hpp
// For files that appear whole or not at all and that take more than one temporary file or a library to write: a hidden folder beside the
// target holds all that is temporary, whatever it is called, and goes with all that is in it. What is ready is renamed onto the target.
#pragma once

#include <string>
#include <string_view>

#include "engine/files/destination.hpp"

namespace linden {

class TemporaryFolder {
 public:
  /// Throws InputError for what is no ordinary file; as publish does, cannot_be_written.
  explicit TemporaryFolder(std::string file);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& target() const { return target_.file(); }
  /// Where a temporary file of that name lies.
  std::string file(std::string_view name) const;
  /// Renames it onto the target.
  void publish(std::string_view name);

 private:
  Destination target_;
  std::string folder_;
  int held_ = -1;  // the folder, locked while it is written (leftovers.hpp)
};

}  // namespace linden
