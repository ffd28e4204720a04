#include "engine/files/output_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "layout/input_error.hpp"

namespace linden {
namespace {

std::string reason() { return errno != 0 ? std::generic_category().message(errno) : "unknown reason"; }

std::string temporary_beside(const std::string& target) {
  std::filesystem::path path = target;
  path.replace_filename(fmt::format(".{}.{:08x}.part", path.filename().string(), std::random_device{}()));
  return path.string();
}

}  // namespace

OutputFile::OutputFile(std::string target) : target_(std::move(target)), temporary_(temporary_beside(target_)) {
  errno = 0;
  file_ = std::fopen(temporary_.c_str(), "wbx");
  if (!file_) fail();
}

OutputFile::~OutputFile() {
  if (!file_) return;
  std::fclose(file_);
  std::remove(temporary_.c_str());
}

void OutputFile::fail() { throw std::runtime_error(fmt::format("{}: cannot be written: {}", target_, reason())); }

void OutputFile::write(std::string_view bytes) {
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail();
}

void OutputFile::commit() {
  errno = 0;
  std::FILE* const file = std::exchange(file_, nullptr);
  if (std::fclose(file) == 0 && std::rename(temporary_.c_str(), target_.c_str()) == 0) return;
  const int kept = errno;
  std::remove(temporary_.c_str());
  errno = kept;
  fail();
}

void write_file(const std::string& file, std::string_view bytes) {
  OutputFile out(file);
  out.write(bytes);
  out.commit();
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return std::filesystem::weakly_canonical(a, ignored) == std::filesystem::weakly_canonical(b, ignored);
}

void require_writable(const std::string& option, const std::string& file, std::initializer_list<std::string_view> endings) {
  const std::filesystem::path path(file), folder = path.parent_path();
  const std::string ending = path.extension().string();
  if (endings.size() > 0 && std::ranges::find(endings, ending) == endings.end()) {
    throw InputError(fmt::format("{} {}: the file's name ends in \"{}\"; expected {}", option, file, ending, fmt::join(endings, " or ")));
  }
  std::error_code ignored;
  if (path.filename().empty() || std::filesystem::is_directory(path, ignored)) {
    throw InputError(fmt::format("{} {}: this is a folder; name a file in it", option, file));
  }
  if (!folder.empty() && !std::filesystem::is_directory(folder, ignored)) {
    throw InputError(fmt::format("{} {}: there is no folder {}; create it first", option, file, folder.string()));
  }
  errno = 0;
  if (std::filesystem::exists(path, ignored) && ::access(file.c_str(), W_OK) != 0) {
    throw InputError(fmt::format("{} {}: the file exists and may not be overwritten: {}", option, file, reason()));
  }
  try {
    OutputFile probe(file);
  } catch (const std::runtime_error& error) {
    throw InputError(fmt::format("{} {}; choose a folder that you may write to", option, error.what()));
  }
}

}  // namespace linden
