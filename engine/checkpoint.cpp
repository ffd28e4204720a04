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
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(file, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {  // opening a pipe waits for who writes to it
    throw InputError(fmt::format("{}: this is not an ordinary file; expected a checkpoint that linden saved", file));
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(fmt::format("{}: the checkpoint cannot be read; does the file exist?", file));
  std::string bytes;
  const auto read_to = [&](std::size_t size) {  // no more than can be of use: the file may be any, and have no end
    const std::size_t before = bytes.size();
    bytes.resize(size);
    in.read(bytes.data() + before, static_cast<std::streamsize>(size - before));
    bytes.resize(before + static_cast<std::size_t>(in.gcount()));
  };
  std::size_t body = kMagic.size() + sizeof(Header);
  read_to(body);
  if (!bytes.starts_with(kMagic) && bytes.starts_with(kAnyFormat)) {
    throw InputError(fmt::format("{}: this checkpoint was saved by another version of linden, in another format; expected one that begins "
                                 "with \"{}\"; continue its run with that version, or begin anew",
                                 file, kMagic.substr(0, kMagic.size() - 1)));
  }
  if (!bytes.starts_with(kMagic)) throw InputError(fmt::format("{}: this is no checkpoint of linden", file));

  State<double> loaded;
  loaded.allocate(model_->tree.shape);
  Header header{};
  if (bytes.size() < body) throw InputError(fmt::format("{}: the checkpoint is cut short", file));
  std::memcpy(&header, bytes.data() + kMagic.size(), sizeof(Header));
  if (header.model_hash != model_->hash()) {
    throw InputError(fmt::format("{}: this checkpoint belongs to another model ({} positions, {} velocities) than {} ({}, {}), "
                                 "or to one with other masses or lengths",
                                 file, header.positions, header.velocities, linden::quoted(model_->names.model),
                                 model_->tree.shape.positions, model_->tree.shape.velocities));
  }
  if (header.order != options_.order) {
    throw InputError(fmt::format("{}: this checkpoint was made with order {}; the simulation has order {}, so it would not continue the "
                                 "same run",
                                 file, header.order, options_.order));
  }
  if (header.effects < 0 || header.effects > kMostText) {
    throw InputError(fmt::format("{}: the checkpoint is damaged: it holds {} bytes about effects; load another", file, header.effects));
  }
  const std::size_t text = body;
  body += static_cast<std::size_t>(header.effects);
  read_to(body);
  if (bytes.size() < body) throw InputError(fmt::format("{}: the checkpoint is cut short", file));
  const std::string_view saved = std::string_view(bytes).substr(text);
  if (const auto other = first_difference(saved, effect_owners(*plan_, model_->names))) {
    throw InputError(fmt::format("{}: this checkpoint was saved with {}, the simulation has {}, so it would not continue the same run; load it "
                                 "with the effects that it was saved with (their numbers may be others)",
                                 file, other->saved, other->here));
  }
  const std::vector<std::span<double>> memory = stepper_->memory();
  if (header.kept != count_of(memory)) {
    throw InputError(fmt::format("{}: this checkpoint was made with another way to solve than the simulation has, so it would not "
                                 "continue the same run; load it with the options that it was made with",
                                 file));
  }
  if (header.step != options_.step || !std::equal(std::begin(header.gravity), std::end(header.gravity), options_.gravity.begin())) {
    throw InputError(fmt::format("{}: this checkpoint was made with a step of {} s and gravity {} {} {}; the simulation has {} s and {} "
                                 "{} {}, so it would not continue the same run",
                                 file, header.step, header.gravity[0], header.gravity[1], header.gravity[2], options_.step,
                                 options_.gravity[0], options_.gravity[1], options_.gravity[2]));
  }
  std::size_t expected = body + sizeof(std::uint64_t);
  State<double>::each(loaded, [&](const char*, auto& field, Rows, const char*) { expected += field.bytes(); });
  std::optional<StageGuess> stage_guess = stage_guess_;
  if (stage_guess) expected += stage_guess->known().size_bytes() + stage_guess->numbers().size_bytes();
  for (const std::span<double> numbers : memory) expected += numbers.size_bytes();
  read_to(expected + 1);
  if (bytes.size() != expected) {
    throw InputError(fmt::format("{}: the checkpoint is damaged: it holds {} bytes, expected {}; load another", file,
                                 bytes.size() > expected ? "more" : std::to_string(bytes.size()), expected));
  }
  std::uint64_t sum = 0;
  std::memcpy(&sum, bytes.data() + bytes.size() - sizeof(sum), sizeof(sum));
  if (sum != checksum(std::string_view(bytes).substr(0, bytes.size() - sizeof(sum)))) {
    throw InputError(fmt::format("{}: the checkpoint is damaged: its checksum is not that of its numbers; load another", file));
  }
  const auto impossible = [&](const std::string& what) {
    throw InputError(fmt::format("{}: the checkpoint holds {}; expected what a simulation saved; save it again", file, what));
  };
  if (header.steps < 0 || header.steps > kMostSteps) impossible(fmt::format("{} steps", header.steps));
  if (header.history < 0 || header.history > kHistory) impossible(fmt::format("the displacements of {} steps", header.history));
  const char* next = bytes.data() + body;
  const auto read = [&next](auto numbers) {  // a span; copy_n, as none may be there
    const auto to = std::as_writable_bytes(std::span(numbers));
    std::ranges::copy_n(next, static_cast<std::ptrdiff_t>(to.size()), reinterpret_cast<char*>(to.data()));
    next += to.size();
  };
  State<double>::each(loaded, [&](const char*, auto& field, Rows, const char*) {
    read(field.flat());
  });
  for (const auto& numbers : {loaded.q.flat(), loaded.p.flat(), loaded.history.flat()}) {
    const bool finite = std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
    if (!finite) impossible("a number that is not finite");
  }
  if (stage_guess) {
    read(stage_guess->known());
    for (const std::int64_t rows : stage_guess->known()) {
      if (rows < 0 || rows > StageGuess::kRows) impossible(fmt::format("the displacements of {} steps", rows));
    }
    read(stage_guess->numbers());
  }
  for (const std::span<double> numbers : memory) read(numbers);
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
