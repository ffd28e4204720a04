// engine/files/destination.hpp
// Where an output comes to lie, and how it gets there: written whole under a hidden name beside it, then renamed onto it.
//
//   kind      an ordinary file, or a name that is free; folders, devices, pipes and sockets are never replaced
//   links     a symbolic link is followed: what it leads to is replaced, the link stays
//   replaced  the new file has the mode of the old one, and its owner and group where that is permitted
//   disk      the bytes are on the disk before the name is theirs, and the name is before publish returns
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace linden {

/// Throws std::runtime_error: `FILE: cannot be written: reason`.
[[noreturn]] void cannot_be_written(const std::string& file, std::string_view reason);
/// The reason is an errno.
[[noreturn]] void cannot_be_written(const std::string& file, int error);

/// What is in a folder is on the disk by its names too, where the system can do that. Returns an errno.
int sync_folder(const std::filesystem::path& folder);

class Destination {
 public:
  /// Throws InputError where `file` leads to something else than an ordinary file.
  explicit Destination(std::string file);

  /// As it was given.
  const std::string& file() const { return file_; }
  /// With links followed.
  const std::filesystem::path& place() const { return place_; }
  /// A hidden name beside it that nobody else has: .NAME.linden.LETTERS.part
  std::string temporary() const { return temporary(letters()); }
  std::string temporary(std::string_view letters) const;
  /// So many digits from 0 to f that nobody else has.
  static constexpr std::size_t kDigits = 8;
  static std::string letters();
  /// Whether a file of that name in its folder is such a one.
  bool is_temporary(std::string_view name) const;
  /// Renames what is ready onto it. Throws cannot_be_written.
  void publish(const std::string& temporary) const;

  /// Whether both names lead to one place: by device and inode where there are files, else by folder and name.
  static bool same(const std::string& a, const std::string& b);

 private:
  std::string file_;
  std::filesystem::path place_;
};

}  // namespace linden
