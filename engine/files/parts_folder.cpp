#include "engine/files/parts_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

#include "engine/files/leftovers.hpp"

namespace linden {
namespace {

constexpr std::string_view kParts = ".parts";

std::string file_of(std::size_t segment, int rank, int ranks) { return fmt::format("{}.{}-of-{}.h5", segment, rank, ranks); }

std::set<std::string> files_of(std::span<const RecordedSegment> segments) {
  std::set<std::string> files;
  for (std::size_t k = 0; k < segments.size(); ++k) {
    for (int rank = 0; rank < segments[k].ranks; ++rank) files.insert(file_of(k, rank, segments[k].ranks));
  }
  return files;
}

}  // namespace

bool is_parts_folder(std::string_view name) {
  if (name.size() < Destination::kDigits + kParts.size() + 2 || !name.ends_with(kParts) || name.find('/') != name.npos) return false;
  name.remove_suffix(kParts.size());
  const std::string_view letters = name.substr(name.size() - Destination::kDigits);
  return name[name.size() - Destination::kDigits - 1] == '.' && letters.find_first_not_of("0123456789abcdef") == letters.npos;
}

PartsFolder::PartsFolder(const std::string& file) : PartsFolder(file, Destination::letters(), false) {}

PartsFolder::PartsFolder(const std::string& file, std::string letters, bool kept)
    : target_(file), letters_(std::move(letters)), kept_(kept) {}

PartsFolder::~PartsFolder() {
  if (held_ < 0) return;
  ::close(held_);
  std::error_code ignored;
  if (!kept_) std::filesystem::remove_all(path(), ignored);
}

std::string PartsFolder::name() const { return fmt::format("{}.{}{}", target_.place().filename().string(), letters_, kParts); }

std::string PartsFolder::path() const {
  return kept_ ? (target_.place().parent_path() / name()).string() : target_.temporary(letters_);
}

std::string PartsFolder::part(std::size_t segment, int rank, int ranks) const {
  return (std::filesystem::path(path()) / file_of(segment, rank, ranks)).string();
}

std::string PartsFolder::part_of_master(std::size_t segment, int rank, int ranks) const {
  return fmt::format("{}/{}", name(), file_of(segment, rank, ranks));
}

void PartsFolder::make() {
  if (::mkdir(path().c_str(), 0777) != 0) cannot_be_written(target_.file(), errno);
  held_ = ::open(path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (held_ < 0 || !hold(held_)) cannot_be_written(target_.file(), errno);
}

void PartsFolder::take(std::span<const RecordedSegment> segments) {
  held_ = ::open(path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (held_ < 0) cannot_be_written(target_.file(), fmt::format("its parts {}: {}", path(), std::generic_category().message(errno)));
  if (!hold(held_)) cannot_be_written(target_.file(), fmt::format("another process writes its parts {}", path()));
  std::error_code ignored;
  for (const std::string& part : files_of(segments)) {
    if (std::filesystem::is_regular_file(std::filesystem::path(path()) / part, ignored)) continue;
    cannot_be_written(target_.file(), fmt::format("its part {}/{} is not there; bring it back, or go on from an earlier checkpoint", path(), part));
  }
}

void PartsFolder::clear_but(std::span<const RecordedSegment> segments) const {
  namespace fs = std::filesystem;
  const std::set<std::string> needed = files_of(segments);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path(), error)) {
    if (!needed.contains(entry.path().filename().string())) fs::remove_all(entry.path(), error);
  }
}

void PartsFolder::keep() {
  if (kept_) return;
  const std::string before = path();
  kept_ = true;
  if (held_ < 0) return;
  int error = ::fsync(held_) != 0 && errno != EINVAL ? errno : 0;
  if (error == 0 && std::rename(before.c_str(), path().c_str()) != 0) error = errno;
  if (error == 0) error = sync_folder(target_.place().parent_path());
  if (error == 0) return;
  kept_ = false;
  cannot_be_written(target_.file(), error);
}

}  // namespace linden
