#include "engine/files/growing_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <utility>

#include "engine/files/destination.hpp"
#include "engine/files/leftovers.hpp"

namespace linden {
namespace {

constexpr std::size_t kWriteAtOnce = 1 << 16;  // bytes

/// Bytes that were written, and the errno of what stopped it; 0: nothing did.
std::pair<std::size_t, int> write_at(int file, std::string_view bytes, std::int64_t at) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::pwrite(file, bytes.data() + done, bytes.size() - done, at + static_cast<std::int64_t>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return {done, errno};
    if (count == 0) return {done, EIO};
    done += static_cast<std::size_t>(count);
  }
  return {done, 0};
}

}  // namespace

GrowingFile::GrowingFile(const std::string& path, std::string name) : name_(std::move(name)), file_(-1) {
  do {
    if (file_ >= 0) ::close(file_);
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file_ < 0) cannot_be_written(name_, errno);
  } while (!hold(file_));
}

GrowingFile::~GrowingFile() {
  if (file_ >= 0) ::close(file_);
}

GrowingFile::GrowingFile(GrowingFile&& other) noexcept
    : name_(std::move(other.name_)), file_(std::exchange(other.file_, -1)), error_(other.error_), size_(other.size_),
      records_(other.records_), buffer_(std::move(other.buffer_)), ends_(std::move(other.ends_)) {}

void GrowingFile::append(std::string_view record) {
  if (error_ != 0) cannot_be_written(name_, error_);
  buffer_ += record;
  ends_.push_back(buffer_.size());
  if (buffer_.size() >= kWriteAtOnce) flush();
}

void GrowingFile::flush() {
  const auto [written, error] = write_at(file_, buffer_, size_);
  const auto rest = std::ranges::upper_bound(ends_, written);
  const std::size_t whole = rest == ends_.begin() ? 0 : rest[-1];
  records_ += rest - ends_.begin();
  size_ += static_cast<std::int64_t>(whole);
  buffer_.erase(0, whole);
  ends_.erase(ends_.begin(), rest);
  for (std::size_t& end : ends_) end -= whole;
  if (error != 0) fail(error);
}

void GrowingFile::settle() {
  try {
    flush();
  } catch (const std::runtime_error&) {
    buffer_.clear();
    ends_.clear();
  }
}

void GrowingFile::rewrite(std::string_view first) {
  flush();
  if (const int error = write_at(file_, first, 0).second) fail(error);
}

void GrowingFile::cut(std::int64_t bytes, std::int64_t records) {
  flush();
  if (::ftruncate(file_, bytes) != 0) cannot_be_written(name_, errno);
  size_ = bytes;
  records_ = records;
}

void GrowingFile::fail(int error) {
  error_ = error;
  while (::ftruncate(file_, size_) != 0 && errno == EINTR) continue;
  cannot_be_written(name_, error);
}

}  // namespace linden
