// Checkpoints of a Simulation (engine/checkpoint_bytes.hpp):
//
//   "linden checkpoint 9\n"
//   header: what it belongs to, steps taken, valid rows of history, order, count of the stepper's numbers, bytes of the text that follows and
//   of what was set, whether steps vary
//   kinds of effects and what they act on (engine/effects/effect_owners.hpp); their numbers may be others
//   fields of State in the order of LINDEN_STATE_FIELDS, 8 bytes a number
//   where a step has sub-steps, what their first guesses know (engine/guess/stage_guess.hpp): counts, numbers
//   what effects or the solver keep from step to step, 8 bytes a number
//   what was set from outside, and what was counted (Continued, by layout/archive.hpp)
//   FNV-1a over all of it
//
// A file is written beside the target and renamed: nothing half-written stays.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <type_traits>

#include "engine/checkpoint_bytes.hpp"
#include "engine/effects/effect_owners.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/effects/own_numbers.hpp"
#include "engine/files/output_file.hpp"
#include "engine/simulation.hpp"
#include "engine/solve/stepper.hpp"
#include "engine/variable_steps.hpp"
#include "layout/archive.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/members.hpp"

namespace linden {

/// What goes on beside the state. Of what was set only what is not as the effects have it, so that it may be continued with other numbers
/// of these.
struct Simulation::Continued {
  std::vector<double> forces;  // [nv], or none
  std::vector<std::optional<double>> targets, gains, friction;
  std::optional<double> ground_friction;
  std::vector<std::optional<std::array<double, 6>>> wrenches;  // force, moment
  EffectWork work;
  PassiveWatch::Known watched;
  std::optional<StepImpulses> impulses;
  std::optional<Varying::Known> varying;
  std::optional<LastStep> step_from;
};

namespace {

constexpr std::int64_t kMostSteps = std::int64_t{1} << 53;  // beyond it their count times the step has no double of its own

struct Header {
  CheckpointOf of;
  std::int64_t steps;
  std::int64_t history;
  std::int64_t order;
  std::int64_t kept;       // numbers that effects or the solver keep
  std::int64_t effects;    // bytes
  std::int64_t continued;  // bytes
  std::int64_t vary;       // 1 where steps do
};
static_assert(sizeof(Header) == 112, "a checkpoint's header has no padding");

template <class T>
void append(std::string& bytes, std::span<T> values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

std::int64_t count_of(const std::vector<std::span<double>>& memory) {
  std::size_t count = 0;
  for (const std::span<double> numbers : memory) count += numbers.size();
  return static_cast<std::int64_t>(count);
}

/// Where a number is not its own.
std::optional<double> set(double number, double own) {
  const bool same = number == own || (std::isnan(number) && std::isnan(own));
  return same ? std::nullopt : std::optional(number);
}

bool is_finite(double number) { return std::isfinite(number); }

/// Sizes of all that is kept of a step's impulses.
/// But for touches, which are as many as there are in a step.
std::vector<std::size_t> sizes_of(const StepImpulses& impulses) {
  std::vector<std::size_t> sizes;
  each_member(impulses, [&](const auto& numbers) {
    if constexpr (!std::is_same_v<std::decay_t<decltype(numbers)>, std::vector<TouchImpulse>>) sizes.push_back(numbers.size());
  });
  return sizes;
}

}  // namespace

Simulation::Continued Simulation::continued() {
  const Effects& effects = plan_->effects;
  const EffectControls controls = stepper_->controls();
  Continued now;
  now.forces = applied_;
  for (std::size_t k = 0; k < effects.servos.size(); ++k) {
    now.targets.push_back(set(controls.servo_targets()[k], own_target(effects.servos[k])));
    now.gains.push_back(set(controls.gain(static_cast<Index>(k)), 1));
  }
  for (std::size_t k = 0; k < effects.friction.size(); ++k) {
    now.friction.push_back(set(controls.friction_forces()[k], effects.friction[k].force));
  }
  if (effects.ground) now.ground_friction = set(controls.ground_friction(), effects.ground->friction);
  for (std::size_t k = 0; k < effects.wrenches.size(); ++k) {
    const std::array<double, 6> acts = numbers_of(effects.wrenches[k]);
    now.wrenches.push_back(acts == own_wrenches_[k] ? std::nullopt : std::optional(acts));
  }
  now.work = effect_work_;
  now.watched = watch_->known();
  now.impulses = impulses_;
  if (varying_) {
    const std::span<const double> twists = varying_->twists.flat();
    now.varying = Varying::Known{varying_->choice.law(), varying_->choice.lengths(), *clock_, last_step_, varying_->apart, {twists.begin(), twists.end()}};
  }
  if (step_from_) now.step_from = *step_from_;
  return now;
}

/// Throws InputError by `impossible` where this simulation cannot have it.
void Simulation::check_continued(const Continued& from, const std::function<void(const std::string&)>& impossible) {
  const Effects& effects = plan_->effects;
  const auto nv = static_cast<std::size_t>(model_->tree.shape.velocities);
  if (!from.forces.empty() && from.forces.size() != nv) impossible(fmt::format("forces on {} rows", from.forces.size()));
  if (!std::ranges::all_of(from.forces, is_finite)) impossible("a force that is not finite");
  const auto look = [&](const char* what, const auto& numbers, std::size_t expected, auto sound) {
    if (numbers.size() != expected) impossible(fmt::format("{} for {} of them", what, numbers.size()));
    const auto unsound = [&](const std::optional<double>& number) { return number && !sound(*number); };
    if (std::ranges::any_of(numbers, unsound)) impossible(fmt::format("{} that cannot be", what));
  };
  const auto not_negative = [](double number) { return std::isfinite(number) && number >= 0; };
  look("targets of servos", from.targets, effects.servos.size(), is_finite);
  look("gains of servos", from.gains, effects.servos.size(), not_negative);
  look("forces of friction", from.friction, effects.friction.size(), not_negative);
  look("friction of the ground", std::array{from.ground_friction}, 1, [&](double mu) { return effects.ground && not_negative(mu); });
  if (from.wrenches.size() != effects.wrenches.size()) impossible(fmt::format("{} wrenches", from.wrenches.size()));
  for (const auto& wrench : from.wrenches) {
    if (wrench && !std::ranges::all_of(*wrench, is_finite)) impossible("a wrench that is not finite");
  }
  for (const auto& watched : from.watched.watched) {
    if (watched.gift < -1 || watched.gift >= static_cast<int>(from.watched.gifts.size())) impossible("an effect's gift that there is not");
  }
  if (from.step_from) {
    const LastStep& last = *from.step_from;
    const bool whole = last.positions.size() == state_.q.flat().size() && last.velocities.size() == nv && std::isfinite(last.time);
    if (!whole || !std::ranges::all_of(last.positions, is_finite) || !std::ranges::all_of(last.velocities, is_finite)) {
      impossible("a beginning of the last step that cannot be");
    }
  }
  if (from.varying) {
    const Varying::Known& known = *from.varying;
    bool sound = known.twists.size() == varying_->twists.flat().size() && std::ranges::all_of(known.twists, is_finite);
    for (const double number : {known.clock, known.last_step, known.apart, known.law.theta}) sound = sound && not_negative(number);
    each_member(known.law, [&](auto number) { sound = sound && std::isfinite(static_cast<double>(number)); });
    if (!sound || known.law.theta == 0) impossible("lengths of steps that cannot be");
  }
  if (!from.impulses) return;
  stepper_->keep_impulses();
  if (sizes_of(*from.impulses) != sizes_of(stepper_->impulses())) impossible("forces of other effects");
  const std::size_t pairs = effects.contact ? effects.contact->pairs.size() : 0;
  const auto is_slot = [&](Index slot) { return slot >= 0 && slot < model_->tree.shape.slots; };
  for (const TouchImpulse& touch : from.impulses->touches) {
    if (touch.pair >= pairs || !is_slot(touch.slot_a) || !is_slot(touch.slot_b)) impossible("contacts of other bodies");
  }
}

void Simulation::check_accuracy_of(const Continued& from, const std::string& name) const {
  const auto said = [](bool varies, double accuracy) { return varies ? fmt::format("variable steps of accuracy {:g}", accuracy) : "fixed steps"; };
  const double saved = from.varying ? from.varying->lengths.accuracy : 0, here = varying_ ? *options_.accuracy : 0;
  if (from.varying.has_value() == (varying_ != nullptr) && saved == here) return;
  throw InputError(fmt::format("{}: this checkpoint was made with {}; the simulation has {}, so it would not continue the same run", name,
                               said(from.varying.has_value(), saved), said(varying_ != nullptr, here)));
}

void Simulation::go_on(const Continued& from) {
  const Effects& effects = plan_->effects;
  const EffectControls controls = stepper_->controls();
  applied_ = from.forces;
  stepper_->apply(applied_);
  for (std::size_t k = 0; k < effects.servos.size(); ++k) {
    controls.servo_targets()[k] = from.targets[k].value_or(own_target(effects.servos[k]));
    controls.set_gain(static_cast<Index>(k), from.gains[k].value_or(1));
  }
  for (std::size_t k = 0; k < effects.friction.size(); ++k) {
    controls.friction_forces()[k] = from.friction[k].value_or(effects.friction[k].force);
  }
  if (effects.ground) controls.set_ground_friction(from.ground_friction.value_or(effects.ground->friction));
  for (std::size_t k = 0; k < effects.wrenches.size(); ++k) {
    const std::array<double, 6> acts = from.wrenches[k].value_or(own_wrenches_[k]);
    BodyWrench& wrench = plan_->effects.wrenches[k];
    std::copy_n(acts.begin(), 3, wrench.force.begin());
    std::copy_n(acts.begin() + 3, 3, wrench.moment.begin());
  }
  effect_work_ = from.work;
  watch_->go_on(from.watched);
  if (from.varying) {
    varying_->choice.law() = from.varying->law;
    varying_->choice.lengths() = from.varying->lengths;
    clock_ = from.varying->clock;
    last_step_ = from.varying->last_step;
    varying_->apart = from.varying->apart;
    std::ranges::copy(from.varying->twists, varying_->twists.flat().begin());
  }
  step_from_ = from.step_from ? std::make_unique<LastStep>(*from.step_from) : nullptr;
  if (from.impulses) {
    impulses_ = from.impulses;
  } else if (impulses_) {
    impulses_->clear();
  }
}

std::array<double, 6> Simulation::numbers_of(const BodyWrench& wrench) {
  return {wrench.force[0], wrench.force[1], wrench.force[2], wrench.moment[0], wrench.moment[1], wrench.moment[2]};
}

std::string Simulation::checkpoint() {
  const std::string effects = effect_owners(*plan_, model_->names);
  BytesOut continued_bytes;
  continued_bytes.add(continued());
  const Header header{checkpoint_of(*model_, options_),
                      steps_,
                      history_,
                      options_.order,
                      count_of(stepper_->memory()),
                      static_cast<std::int64_t>(effects.size()),
                      static_cast<std::int64_t>(continued_bytes.bytes().size()),
                      varying_ ? 1 : 0};
  std::string bytes;
  append(bytes, std::span(&header, 1));
  bytes += effects;
  State<double>::each(state_, [&](const char*, const auto& field, Rows, const char*) { append(bytes, field.flat()); });
  if (stage_guess_) {
    append(bytes, stage_guess_->known());
    append(bytes, stage_guess_->numbers());
  }
  for (const std::span<double> numbers : stepper_->memory()) append(bytes, numbers);
  bytes += continued_bytes.bytes();
  return sealed(kOfSimulation.line, bytes);
}

void Simulation::save(const std::string& file) { write_file(file, checkpoint()); }

Simulation::SavedSteps Simulation::saved_steps(const std::string& file) {
  CheckpointBytes bytes(file);
  const auto header = CheckpointReader(bytes, kOfSimulation).header<Header>();
  return {header.vary != 0, header.of.step};
}

void Simulation::load(const std::string& file) {
  CheckpointBytes bytes(file);
  restore(bytes);
}

void Simulation::restore(std::string_view bytes, const std::string& name) {
  CheckpointBytes given(bytes, name);
  restore(given);
}

void Simulation::restore(CheckpointBytes& bytes) {
  CheckpointReader in(bytes, kOfSimulation);
  const auto header = in.header<Header>();
  in.check_model(header.of, *model_);
  if (header.order != options_.order) {
    throw InputError(fmt::format("{}: this checkpoint was made with order {}; the simulation has order {}, so it would not continue the "
                                 "same run",
                                 bytes.name(), header.order, options_.order));
  }
  in.check_effects(header.effects, effect_owners(*plan_, model_->names));
  const std::vector<std::span<double>> memory = stepper_->memory();
  if (header.kept != count_of(memory)) {
    throw InputError(fmt::format("{}: this checkpoint was made with another way to solve than the simulation has, so it would not "
                                 "continue the same run; load it with the options that it was made with",
                                 bytes.name()));
  }
  in.check_step(header.of, options_);

  State<double> loaded;
  loaded.allocate(model_->tree.shape);
  std::optional<StageGuess> stage_guess = stage_guess_;
  const std::size_t continued_size = in.size_of("what was set", header.continued);
  std::size_t size = continued_size;
  State<double>::each(loaded, [&](const char*, auto& field, Rows, const char*) { size += field.bytes(); });
  if (stage_guess) size += stage_guess->known().size_bytes() + stage_guess->numbers().size_bytes();
  for (const std::span<double> numbers : memory) size += numbers.size_bytes();
  in.numbers(size);

  if (header.steps < 0 || header.steps > kMostSteps) in.impossible(fmt::format("{} steps", header.steps));
  if (header.history < 0 || header.history > kHistory) in.impossible(fmt::format("the displacements of {} steps", header.history));
  State<double>::each(loaded, [&](const char*, auto& field, Rows, const char*) { in.read(field.flat()); });
  for (const auto& numbers : {loaded.q.flat(), loaded.p.flat(), loaded.history.flat()}) {
    if (!std::ranges::all_of(numbers, is_finite)) in.impossible("a number that is not finite");
  }
  if (stage_guess) {
    in.read(stage_guess->known());
    for (const std::int64_t rows : stage_guess->known()) {
      if (rows < 0 || rows > StageGuess::kRows) in.impossible(fmt::format("the displacements of {} steps", rows));
    }
    in.read(stage_guess->numbers());
  }
  const std::string_view kept = in.next(static_cast<std::size_t>(header.kept) * sizeof(double));
  Continued continued;
  BytesIn more(in.next(continued_size), bytes.name());
  more.read(continued);
  more.end();
  check_accuracy_of(continued, bytes.name());
  check_continued(continued, [&](const std::string& what) { in.impossible(what); });
  // nothing can go wrong any more
  const char* from = kept.data();
  for (const std::span<double> numbers : memory) {
    if (!numbers.empty()) std::memcpy(numbers.data(), from, numbers.size_bytes());
    from += numbers.size_bytes();
  }
  state_ = loaded;
  stage_guess_ = std::move(stage_guess);
  steps_ = header.steps;
  history_ = static_cast<int>(header.history);
  go_on(continued);
  stepper_->refresh(state_);
  assembly_ = stepper_->openness();
}

}  // namespace linden
