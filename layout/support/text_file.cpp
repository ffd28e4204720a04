#include "layout/support/text_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "layout/support/input_error.hpp"

namespace linden {
namespace {

thread_local FilesRead* innermost = nullptr;

}  // namespace

FilesRead::FilesRead() : around_(innermost) { innermost = this; }
FilesRead::~FilesRead() { innermost = around_; }

std::ifstream open_to_read(const std::string& file) {
  for (FilesRead* files = innermost; files; files = files->around_) files->names_.push_back(file);
  return std::ifstream(file, std::ios::binary);
}

std::string read_text(const std::string& file, const std::string& what, std::size_t most_bytes) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(file, ignored);
  if (!std::filesystem::exists(status))
    throw InputError(fmt::format("{}: there is no such file; expected {}; check the path", file, what));
  if (std::filesystem::is_directory(status)) {
    throw InputError(fmt::format("{}: this is a folder; expected {}; name a file in it", file, what));
  }
  std::ifstream stream = open_to_read(file);
  if (!stream) throw InputError(fmt::format("{}: it cannot be opened; expected {}; check its permissions", file, what));
  constexpr std::size_t kChunk = 1 << 16;
  std::string text;
  while (stream) {
    const std::size_t before = text.size();
    text.resize(before + kChunk);
    stream.read(text.data() + before, kChunk);
    text.resize(before + static_cast<std::size_t>(stream.gcount()));
    if (text.size() > most_bytes) {
      throw InputError(
          fmt::format("{}: it is longer than {} bytes; expected {}; check that it is the right file", file, most_bytes, what));
    }
  }
  return text;
}

}  // namespace linden
