#include "engine/files/output_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "engine/files/leftovers.hpp"
#include "engine/standard_streams.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

OutputFile::OutputFile(std::string target)
    : target_(std::move(target)), temporary_(target_.temporary()), file_(temporary_, target_.file()) {}

OutputFile::~OutputFile() {
  if (!temporary_.empty()) std::remove(temporary_.c_str());
}

void OutputFile::write(std::string_view record) { file_.append(record); }

void OutputFile::commit() {
  file_.flush();
  target_.publish(temporary_);
  temporary_.clear();
}

void write_file(const std::string& file, std::string_view bytes) {
  OutputFile out(file);
  out.write(bytes);
  out.commit();
}

namespace {

void require_writable(const Output& output) {
  const auto& [option, file, endings] = output;
  const std::string ending = std::filesystem::path(file).extension().string();
  if (!endings.empty() && std::ranges::find(endings, ending) == endings.end()) {
    throw InputError(fmt::format("{} {}: the file's name ends in \"{}\"; expected {}", option, file, ending, fmt::join(endings, " or ")));
  }
  try {
    const Destination destination(file);
    const std::filesystem::path folder = destination.place().parent_path();
    std::error_code ignored;
    if (!folder.empty() && !std::filesystem::is_directory(folder, ignored)) {
      throw InputError(fmt::format("{}: there is no folder {}; create it first", file, folder.string()));
    }
    if (std::filesystem::exists(file, ignored) && ::access(file.c_str(), W_OK) != 0) {
      throw InputError(fmt::format("{}: the file exists and may not be overwritten: {}", file, std::generic_category().message(errno)));
    }
    OutputFile probe(file);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{} {}", option, error.what()));
  } catch (const std::runtime_error& error) {
    throw InputError(fmt::format("{} {}; choose a folder that you may write to", option, error.what()));
  }
}

}  // namespace

Outputs::Outputs(const std::vector<Output>& outputs) {
  for (const Output& output : outputs) {
    if (output.file.empty()) continue;
    require_writable(output);
    for (const Output& other : outputs_) {
      if (!Destination::same(output.file, other.file)) continue;
      throw InputError(fmt::format("{} {} and {} {} name one file; expected two; give each a file of its own", other.option, other.file,
                                   output.option, output.file));
    }
    outputs_.push_back(output);
  }
  for (const Output& output : outputs_) {
    for (const std::string& left : remove_leftovers(Destination(output.file))) {
      tell("{}: removed; it was left by a process that was killed while it wrote {}", left, output.file);
    }
  }
}

void Outputs::spare(const std::vector<std::string>& read) const {
  for (const Output& output : outputs_) {
    for (const std::string& file : read) {
      if (!Destination::same(output.file, file)) continue;
      throw InputError(fmt::format("{} {} would overwrite {}, which is read; expected another file; choose another name", output.option,
                                   output.file, file));
    }
  }
}

}  // namespace linden
