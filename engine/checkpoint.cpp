// Checkpoints of a Simulation: one line of text, then the raw numbers.
//
//   "linden checkpoint 6\n"
//   header: model hash, step, gravity, counts, steps taken, valid rows of history, order, count of the stepper's numbers, bytes of the text
//   that follows (little endian, as laid out below)
//   kinds of effects and what they act on (engine/effects/effect_owners.hpp); their numbers may be others
//   fields of State in the order of LINDEN_STATE_FIELDS, 8 bytes a number
//   where a step has sub-steps, what their first guesses know (engine/guess/stage_guess.hpp): counts, numbers
//   what effects or the solver keep from step to step, 8 bytes a number
//   FNV-1a over all of it
//
// Raw bits, so that a run continued from it is bit-identical. Written beside the target and renamed: nothing half-written stays.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "engine/effects/effect_owners.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/files/output_file.hpp"
#include "engine/simulation.hpp"
#include "engine/solve/stepper.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr std::string_view kMagic = "linden checkpoint 6\n", kAnyFormat = "linden checkpoint ";
constexpr std::int64_t kMostText = 1 << 26;  // bytes
constexpr std::int64_t kMostSteps = std::int64_t{1} << 53;  // beyond it their count times the step has no double of its own

struct Header {
  std::uint64_t model_hash;
  double step;
  double gravity[3];
  std::int64_t positions, velocities;
  std::int64_t steps;
  std::int64_t history;
  std::int64_t order;
  std::int64_t kept;     // numbers that effects or the solver keep
  std::int64_t effects;  // bytes
};
static_assert(sizeof(Header) == 96, "a checkpoint's header has no padding");

std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t state = 14695981039346656037ull;
  for (const char byte : bytes) state = (state ^ static_cast<unsigned char>(byte)) * 1099511628211ull;
  return state;
}

template <class T>
void append(std::string& bytes, const T* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

std::int64_t count_of(const std::vector<std::span<double>>& memory) {
  std::size_t count = 0;
  for (const std::span<double> numbers : memory) count += numbers.size();
  return static_cast<std::int64_t>(count);
}

/// A checkpoint's file, read no farther than can be of use: it may be any file, and have no end.
class CheckpointFile {
 public:
  explicit CheckpointFile(const std::string& file) : file_(file) {
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(file, ignored);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {  // opening a pipe waits for who writes to it
      throw InputError(fmt::format("{}: this is not an ordinary file; expected a checkpoint that linden saved", file));
    }
    in_.open(file, std::ios::binary);
    if (!in_) throw InputError(fmt::format("{}: the checkpoint cannot be read; does the file exist?", file));
  }

  Header header() {
    const std::size_t size = kMagic.size() + sizeof(Header);
    read_to(size);
    if (!bytes_.starts_with(kMagic) && bytes_.starts_with(kAnyFormat)) {
      throw InputError(fmt::format("{}: this checkpoint was saved by another version of linden, in another format; expected one that begins "
                                   "with \"{}\"; continue its run with that version, or begin anew",
                                   file_, kMagic.substr(0, kMagic.size() - 1)));
    }
    if (!bytes_.starts_with(kMagic)) throw InputError(fmt::format("{}: this is no checkpoint of linden", file_));
    require(size);
    Header header{};
    std::memcpy(&header, bytes_.data() + kMagic.size(), sizeof(Header));
    return header;
  }

  /// So many bytes of text that follow.
  std::string text(std::int64_t size) {
    if (size < 0 || size > kMostText) {
      throw InputError(fmt::format("{}: the checkpoint is damaged: it holds {} bytes about effects; load another", file_, size));
    }
    const std::size_t begin = bytes_.size();
    read_to(begin + static_cast<std::size_t>(size));
    require(begin + static_cast<std::size_t>(size));
    return bytes_.substr(begin);
  }

  /// The numbers that follow, of so many bytes, and the sum over all: after it read() takes them one after the other.
  void numbers(std::size_t size) {
    next_ = bytes_.size();
    const std::size_t expected = next_ + size + sizeof(std::uint64_t);
    read_to(expected + 1);
    if (bytes_.size() != expected) {
      throw InputError(fmt::format("{}: the checkpoint is damaged: it holds {} bytes, expected {}; load another", file_,
                                   bytes_.size() > expected ? "more" : std::to_string(bytes_.size()), expected));
    }
    std::uint64_t sum = 0;
    std::memcpy(&sum, bytes_.data() + bytes_.size() - sizeof(sum), sizeof(sum));
    if (sum != checksum(std::string_view(bytes_).substr(0, bytes_.size() - sizeof(sum)))) {
      throw InputError(fmt::format("{}: the checkpoint is damaged: its checksum is not that of its numbers; load another", file_));
    }
  }
  void read(auto numbers) {  // a span; copy_n, as none may be there
    const auto to = std::as_writable_bytes(std::span(numbers));
    std::ranges::copy_n(bytes_.data() + next_, static_cast<std::ptrdiff_t>(to.size()), reinterpret_cast<char*>(to.data()));
    next_ += to.size();
  }

  [[noreturn]] void impossible(const std::string& what) const {
    throw InputError(fmt::format("{}: the checkpoint holds {}; expected what a simulation saved; save it again", file_, what));
  }

 private:
  void read_to(std::size_t size) {
    const std::size_t before = bytes_.size();
    bytes_.resize(size);
    in_.read(bytes_.data() + before, static_cast<std::streamsize>(size - before));
    bytes_.resize(before + static_cast<std::size_t>(in_.gcount()));
  }
  void require(std::size_t size) const {
    if (bytes_.size() < size) throw InputError(fmt::format("{}: the checkpoint is cut short", file_));
  }

  const std::string& file_;
  std::ifstream in_;
  std::string bytes_;
  std::size_t next_ = 0;
};

/// Throws InputError where the run that was saved is not one that this model would continue.
void check_model(const std::string& file, const Header& header, const Model& model) {
  if (header.model_hash == model.hash()) return;
  throw InputError(fmt::format("{}: this checkpoint belongs to another model ({} positions, {} velocities) than {} ({}, {}), "
                               "or to one with other masses or lengths",
                               file, header.positions, header.velocities, quoted(model.names.model), model.tree.shape.positions,
                               model.tree.shape.velocities));
}

void check_order(const std::string& file, const Header& header, const Options& options) {
  if (header.order == options.order) return;
  throw InputError(fmt::format("{}: this checkpoint was made with order {}; the simulation has order {}, so it would not continue the "
                               "same run",
                               file, header.order, options.order));
}

void check_step(const std::string& file, const Header& header, const Options& options) {
  const bool same_gravity = std::equal(std::begin(header.gravity), std::end(header.gravity), options.gravity.begin());
  if (header.step == options.step && same_gravity) return;
  throw InputError(fmt::format("{}: this checkpoint was made with a step of {} s and gravity {} {} {}; the simulation has {} s and {} "
                               "{} {}, so it would not continue the same run",
                               file, header.step, header.gravity[0], header.gravity[1], header.gravity[2], options.step,
                               options.gravity[0], options.gravity[1], options.gravity[2]));
}

void check_effects(const std::string& file, const std::string& saved, const std::string& here) {
  if (const auto other = first_difference(saved, here)) {
    throw InputError(fmt::format("{}: this checkpoint was saved with {}, the simulation has {}, so it would not continue the same run; load it "
                                 "with the effects that it was saved with (their numbers may be others)",
                                 file, other->saved, other->here));
  }
}

void check_memory_size(const std::string& file, std::int64_t saved, std::int64_t here) {
  if (saved == here) return;
  throw InputError(fmt::format("{}: this checkpoint was made with another way to solve than the simulation has, so it would not "
                               "continue the same run; load it with the options that it was made with",
                               file));
}

}  // namespace

void Simulation::save(const std::string& file) {
  const std::string effects = effect_owners(*plan_, model_->names);
  const Header header{model_->hash(),
                      options_.step,
                      {options_.gravity[0], options_.gravity[1], options_.gravity[2]},
                      model_->tree.shape.positions,
                      model_->tree.shape.velocities,
                      steps_,
                      history_,
                      options_.order,
                      count_of(stepper_->memory()),
                      static_cast<std::int64_t>(effects.size())};
  std::string bytes(kMagic);
  append(bytes, &header, 1);
  bytes += effects;
  State<double>::each(state_, [&](const char*, const auto& field, Rows, const char*) {
    append(bytes, field.flat().data(), field.flat().size());
  });
  if (stage_guess_) {
    append(bytes, stage_guess_->known().data(), stage_guess_->known().size());
    append(bytes, stage_guess_->numbers().data(), stage_guess_->numbers().size());
  }
  for (const std::span<double> numbers : stepper_->memory()) append(bytes, numbers.data(), numbers.size());
  const std::uint64_t sum = checksum(bytes);
  append(bytes, &sum, 1);

  write_file(file, bytes);
}

void Simulation::load(const std::string& file) {
  CheckpointFile in(file);
  const Header header = in.header();
  check_model(file, header, *model_);
  check_order(file, header, options_);
  check_effects(file, in.text(header.effects), effect_owners(*plan_, model_->names));
  const std::vector<std::span<double>> memory = stepper_->memory();
  check_memory_size(file, header.kept, count_of(memory));
  check_step(file, header, options_);

  State<double> loaded;
  loaded.allocate(model_->tree.shape);
  std::optional<StageGuess> stage_guess = stage_guess_;
  std::size_t size = 0;
  State<double>::each(loaded, [&](const char*, auto& field, Rows, const char*) { size += field.bytes(); });
  if (stage_guess) size += stage_guess->known().size_bytes() + stage_guess->numbers().size_bytes();
  for (const std::span<double> numbers : memory) size += numbers.size_bytes();
  in.numbers(size);

  if (header.steps < 0 || header.steps > kMostSteps) in.impossible(fmt::format("{} steps", header.steps));
  if (header.history < 0 || header.history > kHistory) in.impossible(fmt::format("the displacements of {} steps", header.history));
  State<double>::each(loaded, [&](const char*, auto& field, Rows, const char*) { in.read(field.flat()); });
  for (const auto& numbers : {loaded.q.flat(), loaded.p.flat(), loaded.history.flat()}) {
    const bool finite = std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
    if (!finite) in.impossible("a number that is not finite");
  }
  if (stage_guess) {
    in.read(stage_guess->known());
    for (const std::int64_t rows : stage_guess->known()) {
      if (rows < 0 || rows > StageGuess::kRows) in.impossible(fmt::format("the displacements of {} steps", rows));
    }
    in.read(stage_guess->numbers());
  }
  // nothing can go wrong any more
  for (const std::span<double> numbers : memory) in.read(numbers);
  state_ = loaded;
  stage_guess_ = std::move(stage_guess);
  steps_ = header.steps;
  history_ = static_cast<int>(header.history);
  effect_work_ = {};
  if (impulses_) impulses_->clear();
  watch_.emplace(*model_, plan_->effects);
  stepper_->refresh(state_);
}

}  // namespace linden
