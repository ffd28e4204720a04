// tests/engine/folder.hpp
// A scratch folder with a look at what a program left in it.
#pragma once

#include <set>
#include <string>

#include "tests/scratch_folder.hpp"

namespace linden {

class Folder : public ScratchFolder {
 public:
  std::filesystem::path operator/(const std::string& name) const { return path() / name; }

  /// Names of all there is, in folders within too.
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path())) names.insert(entry.path().filename().string());
    return names;
  }
  /// What a listing shows: hidden entries are temporary.
  std::set<std::string> visible() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path())) {
      if (const std::string name = entry.path().filename().string(); name[0] != '.') names.insert(name);
    }
    return names;
  }
};

}  // namespace linden
