#include "engine/program/rollout_checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "engine/batch_instances.hpp"
#include "engine/program/effects_text.hpp"
#include "engine/program/randomize.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "engine/version.hpp"
#include "layout/archive.hpp"
#include "layout/support/checksum.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr std::string_view kPartLine = "linden rollout part 1\n", kAnyPart = "linden rollout part ";

template <class T>
std::string sum_of(const T& value) {
  BytesOut out;
  out.add(value);
  return fmt::format("{:016x}", checksum(out.bytes()));
}

std::string_view instructions_of(const RolloutArguments& arguments) {
  return name(arguments.computed.instructions.value_or(best_instructions()));
}

/// All that the bits of a rollout depend on, called as people know it.
std::vector<std::pair<std::string, std::string>> belongings(const RolloutArguments& arguments, const Model& model) {
  const Options& options = arguments.options;
  const auto random = randomness(arguments);
  std::vector<std::string> effects;
  for (const EffectLine& line : effect_lines(arguments.effects(), model)) effects.push_back(line.name);
  std::vector<std::string_view> what;
  for (const Quantity quantity : arguments.what) what.push_back(name(quantity));
  const bool recorded = !arguments.record.empty();
  return {
      {"the version of linden", kVersion},
      {"the model", fmt::format("{}, {} ({:016x})", model.names.model, counted(model.tree.bodies(), "body"), model.hash())},
      {"the scene's effects", fmt::format("{} ({})", effects.empty() ? "none" : fmt::format("{}", fmt::join(effects, ", ")), sum_of(arguments.effects()))},
      {"the scene's start", arguments.scene ? sum_of(arguments.scene->initial) : "none"},
      {"--instances", std::to_string(arguments.instances)},
      {"--seed", std::to_string(random->seed)},
      {"--spread", text_of(random->spread)},
      {"--randomize", arguments.randomization.any() ? fmt::format("{} ({})", randomization_text(arguments.randomization), sum_of(arguments.randomization)) : "nothing"},
      {"--dt", text_of(options.step)},
      {"--gravity", fmt::format("{},{},{}", options.gravity[0], options.gravity[1], options.gravity[2])},
      {"--tolerance", text_of(options.tolerance)},
      {"the solver's limits", fmt::format("{} {} {}", options.reduction, options.max_iterations, options.max_splits)},
      {"--float", arguments.single ? "given" : "not given"},
      {"--instructions", std::string(instructions_of(arguments))},
      {"--record", recorded ? "given" : "not given"},
      {"--every", std::to_string(arguments.every)},
      {"--what", fmt::format("{}", fmt::join(what, ","))},
      {"--observe", fmt::format("{}", fmt::join(arguments.observe, ","))},
  };
}

/// One line that names all that differs.
void require_same(const std::string& folder, const CheckpointManifest& found, const std::vector<std::pair<std::string, std::string>>& here) {
  std::vector<std::string> differences;
  const auto shown = [](const std::string& text) { return text.empty() ? std::string("nothing") : text; };
  for (const auto& [what, text] : here) {
    const auto there = std::ranges::find(found.of, what, &std::pair<std::string, std::string>::first);
    if (there == found.of.end()) differences.push_back(fmt::format("{} is not told there", what));
    else if (there->second != text) differences.push_back(fmt::format("{} is {} there and {} here", what, shown(there->second), shown(text)));
  }
  if (differences.empty()) return;
  throw InputError(fmt::format("--resume {}: its checkpoints are of another rollout: {}; expected the same; give the command line that it "
                               "began with",
                               folder, fmt::join(differences, ", ")));
}

/// Instructions that nobody named are those of the checkpoint.
void take_instructions(RolloutArguments& arguments, const CheckpointManifest& found) {
  if (arguments.computed.instructions) return;
  for (const auto& [what, text] : found.of) {
    if (what != "--instructions") continue;
    const Instructions of = instructions_from(text);
    if (!available(of)) {
      throw InputError(fmt::format("--resume {}: it was computed with {} instructions, which this processor or this build of linden does not "
                                   "have; with others its results would differ by rounding; go on where there are such",
                                   arguments.resume, text));
    }
    arguments.computed.instructions = of;
  }
}

void require_whole(const std::string& folder, const CheckpointManifest& manifest, std::int64_t instances) {
  std::int64_t next = 0;
  for (const CheckpointPart& part : manifest.parts) {
    if (part.first != next || part.last <= part.first) break;
    next = part.last;
  }
  if (next == instances) return;
  throw InputError(fmt::format("--resume {}: the parts of its checkpoint end at instance {}; expected {} instances one part after the other",
                               folder, next, instances));
}

/// As a shell takes it for one word.
std::string shell_word(std::string_view text) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=,+%@";
  if (!text.empty() && text.find_first_not_of(kPlain) == text.npos) return std::string(text);
  std::string word = "'";
  for (const char letter : text) word += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  return word + "'";
}

}  // namespace

std::string command_to_resume(std::span<const char* const> words, const std::string& folder) {
  std::string command;
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string_view word = words[k], option = word.substr(0, word.find('='));
    if (option == "--checkpoint" || option == "--resume") {
      if (option == word) ++k;  // its value
      continue;
    }
    command += shell_word(word) + ' ';
  }
  return command + "--resume " + shell_word(folder);
}

RolloutCheckpoints::RolloutCheckpoints(RolloutArguments& arguments, const Model& model, Ranks& ranks)
    : ranks_(ranks), folder_(arguments.checkpoint, arguments.checkpoints_kept), every_(arguments.checkpoint_every),
      resumed_(!arguments.resume.empty()), due_(Clock::now() + std::chrono::duration_cast<Clock::duration>(every_)),
      command_(arguments.command_to_resume) {
  together(ranks_, [&] {
    if (ranks_.first()) begin(arguments, model);
  });
  newest_ = manifest_from(ranks_.broadcast(manifest_text(newest_)), folder_.path());
  if (resumed_) together(ranks_, [&] { take_instructions(arguments, newest_); });
}

void RolloutCheckpoints::begin(RolloutArguments& arguments, const Model& model) {
  if (!resumed_) {
    folder_.check_free();
    folder_.open();
    newest_.of = belongings(arguments, model);
    return;
  }
  folder_.check_there();
  folder_.open();
  newest_ = folder_.newest();
  take_instructions(arguments, newest_);
  require_same(folder_.path(), newest_, belongings(arguments, model));
  require_whole(folder_.path(), newest_, arguments.instances);
}

RolloutPart RolloutCheckpoints::part_of(InstanceRange own) const {
  std::vector<RolloutPart> parts;
  std::vector<InstancesOf> batches;
  RolloutPart all;
  const auto take = [](std::vector<double>& to, const std::vector<double>& from, const InstancesOf& which) {
    to.insert(to.end(), from.begin() + which.first, from.begin() + which.last);
  };
  for (const CheckpointPart& entry : newest_.parts) {
    if (entry.last <= own.first || entry.first >= own.end()) continue;
    const std::string name = fmt::format("{}/{}", folder_.of_step(newest_.steps), entry.file), bytes = folder_.read(newest_, entry);
    RolloutPart part;
    BytesIn in(unsealed(kPartLine, kAnyPart, "part of a checkpoint", bytes, name), name);
    in.read(part);
    in.end();
    if (part.first != entry.first || part.last() != entry.last || part.steps != newest_.steps) in.damaged();
    const InstancesOf which{{}, name, std::max(own.first, part.first) - part.first, std::min(own.end(), part.last()) - part.first};
    take(all.first_energy, part.first_energy, which);
    take(all.most_kinetic, part.most_kinetic, which);
    take(all.last_energy, part.last_energy, which);
    all.looked_at = part.looked_at;
    all.step_seconds = std::max(all.step_seconds, part.step_seconds);
    batches.push_back(which);
    parts.push_back(std::move(part));
  }
  for (std::size_t k = 0; k < parts.size(); ++k) batches[k].bytes = parts[k].batch;
  all.first = own.first;
  all.steps = newest_.steps;
  all.batch = joined_instances(batches);
  return all;
}

bool RolloutCheckpoints::keep(const RolloutPart& part, const RecordedParts& recorded) {
  due_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(every_);
  if (part.steps == newest_.steps) return true;
  CheckpointManifest manifest{part.steps, newest_.of, {}, recorded};
  std::string fault = write(part, manifest);
  for (std::int64_t more = 1; !fault.empty() && more > 0;) {  // the disk may have room where there is one less
    more = ranks_.first() && folder_.drop_oldest() ? 1 : 0;
    ranks_.most({&more, 1});
    if (more > 0) fault = write(part, manifest);
  }
  if (fault.empty()) {
    newest_ = std::move(manifest);
    return true;
  }
  if (ranks_.first()) {
    tell("{}; {}", fault,
         newest_.steps < 0 ? "there is no checkpoint yet" : fmt::format("the newest checkpoint stays that after {}", counted(newest_.steps, "step")));
  }
  return false;
}

std::string RolloutCheckpoints::write(const RolloutPart& part, CheckpointManifest& manifest) const {
  const auto fault_of = [&](const std::function<void()>& work) {
    std::string fault;
    try {
      work();
    } catch (const std::exception& error) {
      fault = error.what();
    }
    return first_text(ranks_, fault);
  };
  BytesOut entry;
  std::string fault = fault_of([&] {
    BytesOut out;
    out.add(part);
    entry.add(folder_.write(part.steps, ranks_.rank(), part.first, part.last(), sealed(kPartLine, out.bytes())));
  });
  const std::vector<std::string> entries = ranks_.gather(entry.bytes());
  if (fault.empty()) {
    fault = fault_of([&] {
      if (!ranks_.first()) return;
      manifest.parts.clear();
      for (const std::string& bytes : entries) BytesIn(bytes, folder_.path()).read(manifest.parts.emplace_back());
      folder_.complete(manifest);
    });
  }
  if (!fault.empty() && ranks_.first()) folder_.abandon(part.steps);
  return fault;
}

std::string RolloutCheckpoints::text() const {
  if (newest_.steps < 0) return fmt::format("{}: none", folder_.path());
  return fmt::format("{}: the newest after {}", folder_.path(), counted(newest_.steps, "step"));
}

}  // namespace linden
