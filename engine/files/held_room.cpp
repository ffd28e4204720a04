#include "engine/files/held_room.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace linden {

int allocate(int file, std::size_t bytes) {
  while (::fallocate(file, 0, 0, static_cast<off_t>(bytes)) != 0) {
    if (errno == EOPNOTSUPP || errno == ENOSYS) return 0;
    if (errno != EINTR) return errno;
  }
  return 0;
}

int HeldRoom::grow(std::size_t bytes) {
  if (bytes <= held_) return 0;
  if (file_ < 0) file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file_ < 0) return errno;
  const std::size_t ahead = bytes + bytes / 8;  // a call for some rows, not for each
  if (allocate(file_, ahead) == 0) {
    held_ = ahead;
    return 0;
  }
  const int error = allocate(file_, bytes);
  if (error == 0) held_ = bytes;
  return error;
}

void HeldRoom::release() {
  if (file_ < 0) return;
  ::close(std::exchange(file_, -1));
  ::unlink(path_.c_str());
  held_ = 0;
}

}  // namespace linden
