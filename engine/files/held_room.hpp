// engine/files/held_room.hpp
// Room on the disk that is held for what is written at the end, so that a full disk is met while there still is enough to finish with.
#pragma once

#include <cstddef>
#include <string>

namespace linden {

/// Gives an open file so many bytes of the disk, or some more. Returns an errno, 0 where it has them or where the file system cannot do that.
int allocate(int file, std::size_t bytes);

/// As a file of its own that is never written.
class HeldRoom {
 public:
  explicit HeldRoom(std::string path) : path_(std::move(path)) {}
  ~HeldRoom() { release(); }
  HeldRoom(const HeldRoom&) = delete;
  HeldRoom& operator=(const HeldRoom&) = delete;

  /// To so many bytes in all. Returns an errno; 0: it is held.
  int grow(std::size_t bytes);
  void release();

 private:
  std::string path_;
  int file_ = -1;
  std::size_t held_ = 0;
};

}  // namespace linden
