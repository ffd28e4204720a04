#include "engine/files/temporary_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "engine/files/leftovers.hpp"

namespace linden {

TemporaryFolder::TemporaryFolder(std::string file) : target_(std::move(file)), folder_(target_.temporary()) {
  do {
    if (held_ >= 0) ::close(held_);
    if (::mkdir(folder_.c_str(), 0777) != 0) cannot_be_written(target_.file(), errno);
    held_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  } while (held_ >= 0 ? !hold(held_) : errno == ENOENT);
}

TemporaryFolder::~TemporaryFolder() {
  if (held_ >= 0) ::close(held_);
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string TemporaryFolder::file(std::string_view name) const { return fmt::format("{}/{}", folder_, name); }

void TemporaryFolder::publish(std::string_view name) { target_.publish(file(name)); }

}  // namespace linden
