#include "engine/files/leftovers.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

namespace linden {
namespace fs = std::filesystem;

bool hold(int file) {
  if (::flock(file, LOCK_EX | LOCK_NB) != 0) return errno != EWOULDBLOCK;
  struct stat status {};
  return ::fstat(file, &status) != 0 || status.st_nlink > 0;
}

std::vector<std::string> remove_leftovers(const Destination& destination) {
  const fs::path folder = destination.place().parent_path();
  std::vector<std::string> removed;
  std::error_code none;
  std::vector<fs::path> found;
  for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, none), end; !none && entry != end; entry.increment(none)) {
    if (destination.is_temporary(entry->path().filename().string())) found.push_back(entry->path());
  }
  for (const fs::path& path : found) {
    const int file = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) continue;
    if (::flock(file, LOCK_EX | LOCK_NB) == 0 && fs::remove_all(path, none) > 0 && !none) removed.push_back(path.string());
    ::close(file);
  }
  std::ranges::sort(removed);
  return removed;
}

}  // namespace linden
