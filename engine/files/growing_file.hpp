// engine/files/growing_file.hpp
// A new file that grows record by record. What the disk has no room for is cut off behind the last record that is whole, so that a table
// ends with a whole row whatever happens.
//
// While it is open it is locked: remove_leftovers tells by that what is still being written (engine/files/leftovers.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace linden {

class GrowingFile {
 public:
  /// `path` is new; messages call the file `name`. Throws cannot_be_written, as all do that write.
  GrowingFile(const std::string& path, std::string name);
  ~GrowingFile();
  GrowingFile(GrowingFile&& other) noexcept;
  GrowingFile& operator=(GrowingFile&&) = delete;

  /// Bytes that stay together. After a failure nothing more can be appended.
  void append(std::string_view record);
  /// Other bytes in place of the first ones.
  void rewrite(std::string_view first);
  /// Without what follows the first `bytes`, which are whole records.
  void cut(std::int64_t bytes, std::int64_t records);
  /// What has been appended is given to the system. After a failure what it did not take is kept, for settle.
  void flush();
  /// The same once more; what finds no room is forgotten.
  void settle();

  /// Bytes that are still to be given to the system.
  std::size_t buffered() const { return buffer_.size(); }
  /// That are kept.
  std::int64_t records() const { return records_ + static_cast<std::int64_t>(ends_.size()); }

 private:
  [[noreturn]] void fail(int error);

  std::string name_;
  int file_;
  int error_ = 0;               // that came first
  std::int64_t size_ = 0;       // bytes that the system has
  std::int64_t records_ = 0;    // that the system has
  std::string buffer_;          // what follows
  std::vector<std::size_t> ends_;  // of the records in it
};

}  // namespace linden
