#include "engine/files/temporary_folder.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace linden {
namespace {

std::string hidden_beside(const std::string& target) {
  std::filesystem::path path = target;
  path.replace_filename(fmt::format(".{}.{:08x}.part", path.filename().string(), std::random_device{}()));
  return path.string();
}

}  // namespace

void cannot_be_written(const std::string& file, std::string_view reason) {
  throw std::runtime_error(fmt::format("{}: cannot be written: {}", file, reason));
}

void cannot_be_written(const std::string& file, int error) {
  cannot_be_written(file, error != 0 ? std::generic_category().message(error) : "unknown reason");
}

TemporaryFolder::TemporaryFolder(std::string target) : target_(std::move(target)), folder_(hidden_beside(target_)) {
  if (::mkdir(folder_.c_str(), 0777) != 0) cannot_be_written(target_, errno);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string TemporaryFolder::file(std::string_view name) const { return fmt::format("{}/{}", folder_, name); }

void TemporaryFolder::publish(std::string_view name) {
  if (std::rename(file(name).c_str(), target_.c_str()) != 0) cannot_be_written(target_, errno);
}

}  // namespace linden
