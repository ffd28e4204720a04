#include "engine/checkpoint_bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "engine/effects/effect_owners.hpp"
#include "layout/support/checksum.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr std::int64_t kMostTold = 1 << 26;  // bytes that a checkpoint's header may say come

}  // namespace

CheckpointOf checkpoint_of(const Model& model, const Options& options) {
  return {model.hash(), options.step, {options.gravity[0], options.gravity[1], options.gravity[2]}, model.tree.shape.positions,
          model.tree.shape.velocities};
}

CheckpointBytes::CheckpointBytes(const std::string& file) : name_(file) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(file, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {  // opening a pipe waits for who writes to it
    throw InputError(fmt::format("{}: this is not an ordinary file; expected a checkpoint that linden saved", file));
  }
  in_.open(file, std::ios::binary);
  if (!in_) throw InputError(fmt::format("{}: the checkpoint cannot be read; does the file exist?", file));
}

std::string_view CheckpointBytes::first(std::size_t size) {
  if (!in_.is_open()) return given_.substr(0, size);
  const std::size_t before = read_.size();
  if (size > before) {
    read_.resize(size);
    in_.read(read_.data() + before, static_cast<std::streamsize>(size - before));
    read_.resize(before + static_cast<std::size_t>(in_.gcount()));
  }
  return std::string_view(read_).substr(0, size);
}

void CheckpointReader::begin(std::size_t header) {
  next_ = kind_.line.size() + header;
  bytes_ = source_.first(next_);
  for (const CheckpointKind& other : {kOfSimulation, kOfBatch}) {
    if (other.any_version == kind_.any_version || !bytes_.starts_with(other.any_version)) continue;
    throw InputError(fmt::format("{}: this checkpoint was saved by a {}; expected one of a {}", source_.name(), other.of, kind_.of));
  }
  if (!bytes_.starts_with(kind_.line) && bytes_.starts_with(kind_.any_version)) {
    throw InputError(fmt::format("{}: this checkpoint was saved by another version of linden, in another format; expected one that begins "
                                 "with \"{}\"; continue its run with that version, or begin anew",
                                 source_.name(), kind_.line.substr(0, kind_.line.size() - 1)));
  }
  if (!bytes_.starts_with(kind_.line)) throw InputError(fmt::format("{}: this is no checkpoint of linden", source_.name()));
  if (bytes_.size() < next_) throw InputError(fmt::format("{}: the checkpoint is cut short", source_.name()));
}

void CheckpointReader::check_model(const CheckpointOf& saved, const Model& model) const {
  if (saved.model_hash == model.hash()) return;
  throw InputError(fmt::format("{}: this checkpoint belongs to another model ({} positions, {} velocities) than {} ({}, {}), "
                               "or to one with other masses or lengths",
                               source_.name(), saved.positions, saved.velocities, quoted(model.names.model), model.tree.shape.positions,
                               model.tree.shape.velocities));
}

void CheckpointReader::check_step(const CheckpointOf& saved, const Options& options) const {
  const bool same_gravity = std::equal(std::begin(saved.gravity), std::end(saved.gravity), options.gravity.begin());
  if (saved.step == options.step && same_gravity) return;
  throw InputError(fmt::format("{}: this checkpoint was made with a step of {} s and gravity {} {} {}; the {} has {} s and {} "
                               "{} {}, so it would not continue the same run",
                               source_.name(), saved.step, saved.gravity[0], saved.gravity[1], saved.gravity[2], kind_.of, options.step,
                               options.gravity[0], options.gravity[1], options.gravity[2]));
}

std::size_t CheckpointReader::size_of(const char* what, std::int64_t told) const {
  if (told >= 0 && told <= kMostTold) return static_cast<std::size_t>(told);
  throw InputError(fmt::format("{}: the checkpoint is damaged: it holds {} bytes about {}; load another", source_.name(), told, what));
}

void CheckpointReader::check_effects(std::int64_t told, const std::string& here) {
  const std::size_t size = size_of("effects", told);
  bytes_ = source_.first(next_ + size);
  if (bytes_.size() < next_ + size) throw InputError(fmt::format("{}: the checkpoint is cut short", source_.name()));
  const std::string_view saved = next(size);
  if (const auto other = first_difference(saved, here)) {
    throw InputError(fmt::format("{}: this checkpoint was saved with {}, the {} has {}, so it would not continue the same run; load it "
                                 "with the effects that it was saved with (their numbers may be others)",
                                 source_.name(), other->saved, kind_.of, other->here));
  }
}

void CheckpointReader::numbers(std::size_t size) {
  const std::size_t expected = next_ + size + sizeof(std::uint64_t);
  bytes_ = source_.first(expected + 1);
  if (bytes_.size() != expected) {
    throw InputError(fmt::format("{}: the checkpoint is damaged: it holds {} bytes, expected {}; load another", source_.name(),
                                 bytes_.size() > expected ? "more" : std::to_string(bytes_.size()), expected));
  }
  std::uint64_t sum = 0;
  std::memcpy(&sum, bytes_.data() + bytes_.size() - sizeof(sum), sizeof(sum));
  if (sum != checksum(bytes_.substr(0, bytes_.size() - sizeof(sum)))) {
    throw InputError(fmt::format("{}: the checkpoint is damaged: its checksum is not that of its numbers; load another", source_.name()));
  }
}

std::string_view CheckpointReader::next(std::size_t size) {
  next_ += size;
  return bytes_.substr(next_ - size, size);
}

void CheckpointReader::impossible(const std::string& what) const {
  throw InputError(fmt::format("{}: the checkpoint holds {}; expected what a {} saved; save it again", source_.name(), what, kind_.of));
}

}  // namespace linden
