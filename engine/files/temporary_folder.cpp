#include "engine/files/temporary_folder.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

namespace linden {

TemporaryFolder::TemporaryFolder(std::string file) : target_(std::move(file)), folder_(target_.temporary()) {
  if (::mkdir(folder_.c_str(), 0777) != 0) cannot_be_written(target_.file(), errno);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string TemporaryFolder::file(std::string_view name) const { return fmt::format("{}/{}", folder_, name); }

void TemporaryFolder::publish(std::string_view name) { target_.publish(file(name)); }

}  // namespace linden
