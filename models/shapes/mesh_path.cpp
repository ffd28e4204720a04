#include "models/shapes/mesh_path.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

namespace linden {
namespace {

using std::filesystem::path;

/// The folders that an environment variable lists.
std::vector<path> folders_in(const char* variable) {
  std::vector<path> folders;
  const char* value = std::getenv(variable);
  for (std::string_view rest = value ? value : ""; !rest.empty();) {
    const std::string_view folder = rest.substr(0, rest.find(':'));
    rest.remove_prefix(std::min(folder.size() + 1, rest.size()));
    if (!folder.empty()) folders.emplace_back(folder);
  }
  return folders;
}

std::vector<path> places_of_package(const path& package, const path& rest, const path& folder) {
  std::vector<path> places;
  for (path above = folder;; above = above.parent_path()) {
    places.push_back(above / package / rest);
    if (above == above.parent_path()) break;
  }
  for (const path& listed : folders_in("ROS_PACKAGE_PATH")) {
    places.push_back(listed / package / rest);
    if (listed.filename() == package) places.push_back(listed / rest);
  }
  for (const path& prefix : folders_in("AMENT_PREFIX_PATH")) places.push_back(prefix / "share" / package / rest);
  return places;
}

}  // namespace

std::optional<std::string> find_mesh(const std::string& name, const std::string& source) {
  constexpr std::string_view kPackage = "package://", kFile = "file://";
  std::error_code ignored;
  const path folder = std::filesystem::absolute(source, ignored).parent_path();
  std::vector<path> places;
  if (name.starts_with(kPackage)) {
    // some files write package:/// as one writes file:///
    const std::string in_package = name.substr(std::min(name.find_first_not_of('/', kPackage.size()), name.size()));
    const std::size_t slash = in_package.find('/');
    if (slash == in_package.npos) return std::nullopt;
    places = places_of_package(in_package.substr(0, slash), path(in_package.substr(slash)).relative_path(), folder);
  } else {
    places = {folder / (name.starts_with(kFile) ? name.substr(kFile.size()) : name)};
  }
  for (const path& place : places) {
    if (std::filesystem::is_regular_file(place, ignored)) return place.lexically_normal().string();
  }
  return std::nullopt;
}

}  // namespace linden
