#include "engine/files/destination.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "layout/support/input_error.hpp"

namespace linden {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kAfterNumber = ".part";

std::string before_number(const fs::path& place) { return fmt::format(".{}.linden.", place.filename().string()); }

/// The end of a chain of symbolic links, be there a file or not.
fs::path followed(fs::path path) {
  constexpr int kMostLinks = 40;  // of Linux
  std::error_code none;
  for (int links = 0; links < kMostLinks && fs::is_symlink(path, none); ++links) {
    path = path.parent_path() / fs::read_symlink(path, none);
  }
  return path;
}

/// What there is that is no ordinary file; empty where there is one, or nothing.
std::string obstacle(const std::string& file) {
  std::error_code error;
  switch (fs::status(file, error).type()) {
    case fs::file_type::regular: return "";
    case fs::file_type::not_found: return fs::path(file).filename().empty() ? "a folder" : "";
    case fs::file_type::directory: return "a folder";
    case fs::file_type::character:
    case fs::file_type::block: return "a device";
    case fs::file_type::fifo: return "a pipe";
    case fs::file_type::socket: return "a socket";
    default: break;
  }
  if (error == std::errc::too_many_symbolic_link_levels) return "a symbolic link that leads in a circle";
  return fmt::format("a place that cannot be looked at ({})", error.message());
}

}  // namespace

int sync_folder(const fs::path& folder) {
  const int file = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return 0;  // it may be written to and not be read
  const int error = ::fsync(file) != 0 && errno != EINVAL ? errno : 0;
  ::close(file);
  return error;
}

void cannot_be_written(const std::string& file, std::string_view reason) {
  throw std::runtime_error(fmt::format("{}: cannot be written: {}", file, reason));
}

void cannot_be_written(const std::string& file, int error) {
  cannot_be_written(file, error != 0 ? std::generic_category().message(error) : "unknown reason");
}

Destination::Destination(std::string file) : file_(std::move(file)), place_(followed(file_)) {
  const std::string found = obstacle(file_);
  if (found.empty()) return;
  throw InputError(fmt::format("{}: this is {}; expected an ordinary file, or a name that is free; choose another", file_, found));
}

std::string Destination::letters() { return fmt::format("{:0{}x}", std::random_device{}(), kDigits); }

std::string Destination::temporary(std::string_view letters) const {
  fs::path path = place_;
  path.replace_filename(fmt::format("{}{}{}", before_number(place_), letters, kAfterNumber));
  return path.string();
}

bool Destination::is_temporary(std::string_view name) const {
  const std::string before = before_number(place_);
  if (name.size() != before.size() + kDigits + kAfterNumber.size() || !name.starts_with(before) || !name.ends_with(kAfterNumber)) return false;
  return name.substr(before.size(), kDigits).find_first_not_of("0123456789abcdef") == name.npos;
}

void Destination::publish(const std::string& temporary) const {
  const int ready = ::open(temporary.c_str(), O_RDONLY | O_CLOEXEC);
  if (ready < 0) cannot_be_written(file_, errno);
  int error = 0;
  struct stat old {};
  if (::stat(place_.c_str(), &old) == 0) {
    // first the owner, as a change of owner may clear bits of the mode; only root may give files away
    if (::fchown(ready, old.st_uid, old.st_gid) != 0 && errno != EPERM) error = errno;
    if (error == 0 && ::fchmod(ready, old.st_mode & 0777) != 0) error = errno;
  }
  if (error == 0 && ::fsync(ready) != 0 && errno != EINVAL) error = errno;  // EINVAL: a file system that has no such thing
  ::close(ready);
  if (error == 0 && std::rename(temporary.c_str(), place_.c_str()) != 0) error = errno;
  if (error == 0) error = sync_folder(place_.parent_path());
  if (error != 0) cannot_be_written(file_, error);
}

bool Destination::same(const std::string& a, const std::string& b) {
  std::error_code none;
  if (fs::equivalent(a, b, none)) return true;
  const auto place = [&](const std::string& file) {
    const fs::path path = fs::absolute(followed(file), none);
    return fs::weakly_canonical(path.parent_path(), none) / path.filename();
  };
  return place(a) == place(b);
}

}  // namespace linden
