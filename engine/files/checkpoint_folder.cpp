#include "engine/files/checkpoint_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "engine/files/leftovers.hpp"
#include "engine/files/output_file.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "layout/support/checksum.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"

namespace linden {
namespace {

constexpr const char* kManifest = "manifest.json";
constexpr const char* kManifestKind = "linden rollout checkpoint 1";
constexpr std::size_t kStepDigits = 13, kMostPartBytes = std::size_t{1} << 40;

std::string hexadecimal(std::uint64_t number) { return fmt::format("{:016x}", number); }

nlohmann::ordered_json manifest_json(const CheckpointManifest& manifest) {
  nlohmann::ordered_json of = nlohmann::ordered_json::object(), parts = nlohmann::ordered_json::array();
  for (const auto& [what, text] : manifest.of) of[what] = text;
  for (const CheckpointPart& part : manifest.parts) {
    parts.push_back({{"file", part.file}, {"first", part.first}, {"last", part.last}, {"bytes", part.bytes}, {"checksum", hexadecimal(part.checksum)}});
  }
  nlohmann::ordered_json segments = nlohmann::ordered_json::array();
  for (const RecordedSegment& segment : manifest.recorded.segments) segments.push_back({{"frames", segment.frames}, {"ranks", segment.ranks}});
  return {{"kind", kManifestKind},
          {"steps", manifest.steps},
          {"of", of},
          {"parts", parts},
          {"recording", {{"letters", manifest.recorded.letters}, {"segments", segments}}}};
}

std::string checked_text(nlohmann::ordered_json json) {
  const auto text = [&] { return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n'; };
  const std::string sum = hexadecimal(checksum(text()));
  json["checksum"] = sum;
  return text();
}

}  // namespace

std::string manifest_text(const CheckpointManifest& manifest) { return checked_text(manifest_json(manifest)); }

CheckpointManifest manifest_from(const std::string& text, const std::string& name) {
  const auto damaged = [&](std::string_view found) {
    throw InputError(fmt::format("{}: the manifest is damaged: {}; expected what a rollout wrote", name, found));
  };
  try {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(text);
    if (json.at("kind") != kManifestKind) {
      throw InputError(fmt::format("{}: this is {}; expected \"{}\"; go on with the version of linden that wrote it", name,
                                   json.at("kind").dump(), kManifestKind));
    }
    json.erase("checksum");
    if (checked_text(json) != text) damaged("its checksum is not that of its text");
    CheckpointManifest manifest;
    json.at("steps").get_to(manifest.steps);
    for (const auto& [what, value] : json.at("of").items()) manifest.of.emplace_back(what, value.get<std::string>());
    for (const auto& part : json.at("parts")) {
      manifest.parts.push_back({part.at("file"), part.at("first"), part.at("last"), part.at("bytes"),
                                std::stoull(part.at("checksum").get<std::string>(), nullptr, 16)});
    }
    const auto& recording = json.at("recording");
    recording.at("letters").get_to(manifest.recorded.letters);
    for (const auto& segment : recording.at("segments")) manifest.recorded.segments.push_back({segment.at("frames"), segment.at("ranks")});
    return manifest;
  } catch (const nlohmann::json::exception&) {
    damaged("it does not read as JSON of its kind");
  } catch (const std::logic_error&) {
    damaged("a checksum that is no number");
  }
  return {};
}

namespace {

/// Makes the folder, which there may be already, and its name last on the disk.
void make_folder(const std::string& path) {
  if (::mkdir(path.c_str(), 0777) != 0 && errno != EEXIST) cannot_be_written(path, errno);
  if (const int error = sync_folder(std::filesystem::path(path).parent_path())) cannot_be_written(path, error);
}

/// A checkpoint, its manifest first, so that what is left of it is none.
void remove_checkpoint(const std::string& folder) {
  std::remove(fmt::format("{}/{}", folder, kManifest).c_str());
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
}

}  // namespace

CheckpointFolder::~CheckpointFolder() {
  if (held_ >= 0) ::close(held_);
}

std::string CheckpointFolder::of_step(std::int64_t steps) const { return fmt::format("{}/{:0{}}", path_, steps, kStepDigits); }

std::vector<std::int64_t> CheckpointFolder::steps_there(bool whole) const {
  namespace fs = std::filesystem;
  std::vector<std::int64_t> steps;
  std::error_code none;
  for (fs::directory_iterator entry(path_, none), end; !none && entry != end; entry.increment(none)) {
    const std::string name = entry->path().filename().string();
    if (name.size() != kStepDigits || name.find_first_not_of("0123456789") != name.npos) continue;
    std::error_code ignored;
    if (fs::exists(entry->path() / kManifest, ignored) == whole) steps.push_back(std::stoll(name));
  }
  std::ranges::sort(steps, std::greater<>());
  return steps;
}

void CheckpointFolder::check_free() const {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path around = fs::path(path_).parent_path();
  if (fs::exists(path_, ignored) && !fs::is_directory(path_, ignored)) {
    throw InputError(fmt::format("--checkpoint {}: this is no folder; expected one, or a name that is free; choose another", path_));
  }
  if (!around.empty() && !fs::is_directory(around, ignored)) {
    throw InputError(fmt::format("--checkpoint {}: there is no folder {}; create it first", path_, around.string()));
  }
  if (::access(fs::exists(path_, ignored) ? path_.c_str() : around.empty() ? "." : around.c_str(), W_OK) != 0) {
    throw InputError(fmt::format("--checkpoint {}: cannot be written: {}; choose a folder that you may write to", path_,
                                 std::generic_category().message(errno)));
  }
  const std::vector<std::int64_t> there = steps_there(true);
  if (there.empty()) return;
  throw InputError(fmt::format("--checkpoint {0}: this folder holds checkpoints of a rollout, the newest after {1}; expected none; "
                               "--resume {0} goes on from it; for another rollout choose another folder, or remove this one",
                               path_, counted(there.front(), "step")));
}

void CheckpointFolder::check_there() const {
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored)) return;
  throw InputError(fmt::format("--resume {0}: this is no folder; expected one with the checkpoints of a rollout; to begin one, leave --resume "
                               "out and give --checkpoint DIR",
                               path_));
}

void CheckpointFolder::open() {
  make_folder(path_);
  held_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (held_ < 0) cannot_be_written(path_, errno);
  if (!hold(held_)) {
    throw InputError(fmt::format("{}: another process keeps its checkpoints there; expected a folder that nobody works with; wait for its "
                                 "end, or choose another",
                                 path_));
  }
  for (const std::int64_t steps : steps_there(false)) {
    remove_checkpoint(of_step(steps));
    tell("{}: removed; it was left by a process that was killed while it wrote this checkpoint", of_step(steps));
  }
}

CheckpointManifest CheckpointFolder::manifest_of(std::int64_t steps) const {
  const std::string file = fmt::format("{}/{}", of_step(steps), kManifest);
  CheckpointManifest manifest = manifest_from(read_text(file, "the manifest of a checkpoint"), file);
  if (manifest.steps != steps) throw InputError(fmt::format("{}: it is of {} steps", file, manifest.steps));
  return manifest;
}

CheckpointManifest CheckpointFolder::newest() const {
  std::error_code ignored;
  for (const std::int64_t steps : steps_there(true)) {
    try {
      CheckpointManifest manifest = manifest_of(steps);
      for (const CheckpointPart& part : manifest.parts) read(manifest, part);
      return manifest;
    } catch (const InputError& error) {
      const std::string aside = of_step(steps) + ".damaged";
      std::filesystem::remove_all(aside, ignored);
      const bool moved = std::rename(of_step(steps).c_str(), aside.c_str()) == 0;
      tell("{}; the checkpoint before it is taken{}", error.what(), moved ? fmt::format("; this one is now {}", aside) : "");
    }
  }
  throw InputError(fmt::format("--resume {0}: this folder holds no checkpoint that is whole; expected one; begin anew without --resume, and "
                               "with --checkpoint {0}",
                               path_));
}

std::string CheckpointFolder::read(const CheckpointManifest& manifest, const CheckpointPart& part) const {
  const std::string file = fmt::format("{}/{}", of_step(manifest.steps), part.file);
  std::string bytes = read_text(file, "a part of a checkpoint", kMostPartBytes);
  if (bytes.size() != part.bytes) {
    throw InputError(fmt::format("{}: this part of a checkpoint is damaged: it has {} bytes, expected {}", file, bytes.size(), part.bytes));
  }
  if (checksum(bytes) != part.checksum) {
    throw InputError(fmt::format("{}: this part of a checkpoint is damaged: its checksum is not that of its bytes", file));
  }
  return bytes;
}

CheckpointPart CheckpointFolder::write(std::int64_t steps, std::int64_t number, std::int64_t first, std::int64_t last,
                                       std::string_view bytes) const {
  make_folder(of_step(steps));
  CheckpointPart part{fmt::format("part-{}", number), first, last, bytes.size(), checksum(bytes)};
  write_file(fmt::format("{}/{}", of_step(steps), part.file), bytes);
  return part;
}

void CheckpointFolder::complete(const CheckpointManifest& manifest) const {
  write_file(fmt::format("{}/{}", of_step(manifest.steps), kManifest), manifest_text(manifest));
  const std::vector<std::int64_t> there = steps_there(true);
  for (std::size_t k = static_cast<std::size_t>(kept_); k < there.size(); ++k) remove_checkpoint(of_step(there[k]));
}

bool CheckpointFolder::drop_oldest() const {
  const std::vector<std::int64_t> there = steps_there(true);
  if (there.size() < 2) return false;
  remove_checkpoint(of_step(there.back()));
  return true;
}

void CheckpointFolder::abandon(std::int64_t steps) const { remove_checkpoint(of_step(steps)); }

}  // namespace linden
