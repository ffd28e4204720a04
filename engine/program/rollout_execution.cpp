#include "engine/program/rollout_execution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "engine/files/report_files.hpp"
#include "engine/program/effects_text.hpp"
#include "engine/program/progress.hpp"
#include "engine/program/run_report.hpp"
#include "engine/program/start_report.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "engine/view/curves.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

namespace {

using Clock = Progress::Clock;

}  // namespace

template <class Real>
RolloutExecution<Real>::RolloutExecution(const RolloutArguments& arguments, std::shared_ptr<const Model> model, std::int64_t steps, Ranks& ranks,
                                         RolloutCheckpoints* checkpoints)
    : arguments_(arguments),
      ranks_(ranks),
      checkpoints_(checkpoints),
      model_(std::move(model)),
      effects_(arguments.effects()),
      observations_(observations_of(*model_, effects_, arguments.observe)),
      batch_(scene_of(arguments, *model_), arguments.instances, arguments.computed) {
  figures_.steps_planned = steps;
  figures_.lanes = batch_.lanes();
  figures_.threads = batch_.threads();
  DrawnArrays drawn(arguments.record.empty() ? Randomization() : arguments.randomization, *model_, effects_, arguments.instances);
  batch_.reset_all([&](std::int64_t i, std::span<double> positions, std::span<double> velocities) {
    const InitialState state = start_of(i);
    std::ranges::copy(state.positions, positions.begin());
    std::ranges::copy(state.velocities, velocities.begin());
    if (!drawn.arrays().empty()) drawn.set(i, drawn_of(i));
  });
  look_at_instances(arguments, arguments.options, arguments.instances, [&](std::int64_t i) {
    const auto rows = batch_.positions().instance(i);
    return std::vector<double>(rows.begin(), rows.end());
  });
  figures_.bytes = batch_.bytes();
  energy_.resize(static_cast<std::size_t>(arguments.instances));
  if (!arguments.record.empty()) begin_recording(drawn.arrays());
  if (checkpoints && checkpoints->resumed()) resume();
  if (arguments.views.any()) begin_views();
}

template <class Real>
void RolloutExecution<Real>::begin_recording(const std::vector<FixedArray>& drawn) {
  what_ = arguments_.what.empty() ? usual_quantities(arguments_.record) : arguments_.what;
  const Names& names = batch_.model().names;
  std::vector<RecordedArray> arrays;
  for (const Quantity quantity : what_) {
    arrays.push_back(quantity == Quantity::positions    ? recorded_positions(names)
                     : quantity == Quantity::velocities ? recorded_velocities(names)
                                                        : RecordedArray{"energies", "energy_names", {"kinetic", "potential"}, "energy."});
    numbers_.emplace_back(static_cast<std::size_t>(arguments_.instances) * arrays.back().rows.size());
  }
  if (observations_) {
    for (RecordedArray& array : recorded_observations(*observations_)) arrays.push_back(std::move(array));
    observed_.resize(static_cast<std::size_t>(arguments_.instances * observations_->width()));
    observe();  // refuses accelerations where there are none
  }
  status_.resize(static_cast<std::size_t>(arguments_.instances));
  const int packers = arguments_.compress ? batch_.threads() : 0;
  if (!checkpoints_) {
    file_.emplace(arguments_.record, arguments_.instances, std::move(arrays), drawn, packers);
  } else if (checkpoints_->recorded().segments.empty()) {
    parts_.emplace(ranks_, arguments_.record, arguments_.instances, std::move(arrays), drawn, packers);
  } else {
    parts_.emplace(ranks_, arguments_.record, arguments_.instances, std::move(arrays), drawn, checkpoints_->recorded(), packers);
  }
}

template <class Real>
void RolloutExecution<Real>::steps(const Interrupt& interrupt) {
  Progress progress(figures_.steps_planned, arguments_.options.step);
  std::int64_t stretch = 1;  // steps between two looks at the clock
  if (looked_at_ < 0) look();
  look_at_shown();
  while (figures_.steps < figures_.steps_planned && figures_.lost.empty() && interrupt.signal() == 0) {
    std::int64_t end = std::min(figures_.steps_planned, figures_.steps + stretch);
    if (file_ || parts_) end = std::min(end, (figures_.steps / arguments_.every + 1) * arguments_.every);
    if (recorder_) end = std::min(end, (figures_.steps / frame_stride_ + 1) * frame_stride_);
    const Clock::time_point begin = Clock::now();
    batch_.step(end - figures_.steps);
    const Clock::time_point now = Clock::now();
    const double taken = seconds(now - begin);
    figures_.step_seconds += taken;
    figures_.steps = end;
    if (taken > 0.4) stretch = std::max<std::int64_t>(1, stretch / 2);
    if (taken < 0.1) stretch = std::min(2 * stretch, figures_.steps_planned);
    if ((file_ || parts_) && figures_.steps % arguments_.every == 0) look();
    if (recorder_ && figures_.steps % frame_stride_ == 0) look_at_shown();
    if (checkpoints_ && checkpoints_->due(now)) keep();
    progress.update(figures_.steps, now);
  }
  // before the last frame, which one that goes on from here does not have
  if (checkpoints_) keep();
  if (looked_at_ != figures_.steps) look();
  if (recorder_ && figures_.steps % frame_stride_ != 0) look_at_shown();
  if (figures_.steps < figures_.steps_planned && figures_.lost.empty()) figures_.signal = interrupt.signal();
  finish();
  if (figures_.signal == 0 && figures_.lost.empty()) account_of_one(interrupt);
}

template <class Real>
bool RolloutExecution<Real>::write_files() {
  bool fine = true;
  recording([&] {
    if (file_) file_->commit();
    if (parts_) parts_->commit();
  });
  figures_.frames = file_ ? file_->frames() : parts_ ? parts_->parts().frames() : 0;
  fine = figures_.lost.empty();
  if (recorder_) {
    WrittenViews views = write_views(arguments_.views, recorder_->animation());
    figures_.views = std::move(views.lines);
    fine = fine && views.fine;
  }
  if (!arguments_.json.empty()) {
    fine = attempt([&] { write_json(arguments_.json, rollout_json(arguments_, batch_.model(), figures_)); }) && fine;
  }
  return fine;
}

template <class Real>
Scene RolloutExecution<Real>::scene_of(const RolloutArguments& arguments, const Model& model) {
  Scene scene;
  if (arguments.scene) scene = *arguments.scene;
  else scene.model = model;
  scene.options = arguments.options;
  scene.randomization = arguments.randomization;
  scene.seed = randomness(arguments)->seed;
  scene.start_as_given = true;
  return scene;
}

template <class Real>
InitialState RolloutExecution<Real>::start_of(std::int64_t i) const {
  const double spread = randomness(arguments_)->spread;
  if (!arguments_.scene) return random_state(*model_, seed_of(i), spread);
  return random_around(*model_, arguments_.scene->initial, seed_of(i), spread, effects_.limits);
}

template <class Real>
void RolloutExecution<Real>::account_of_one(const Interrupt& interrupt) {
  constexpr std::int64_t kMostAccounted = 10'000, kSamples = 2'000;
  if (effect_lines(effects_, *model_).empty()) return;
  AccountOfOne one;
  while (one.instance < arguments_.instances && batch_.record(one.instance).status != StepStatus::converged) ++one.instance;
  if (one.instance == arguments_.instances) return;
  std::shared_ptr<const Model> model = model_;
  Effects effects = effects_;
  if (arguments_.randomization.any()) {
    const auto own = std::make_shared<Model>(*model_);
    apply(drawn_of(one.instance), *own, effects);
    model = own;
  }
  Simulation alone(model, arguments_.options, effects);
  const InitialState start = start_of(one.instance);
  alone.set_positions(start.positions);
  alone.set_velocities(start.velocities);
  const std::int64_t steps = std::min(figures_.steps, kMostAccounted), stretch = (steps + kSamples - 1) / kSamples;
  one.energy = EnergyDrift(steps / stretch + 1);
  const auto sample = [&] {
    one.taken = alone.effect_work().taken();
    one.given = alone.effect_work().given();
    one.energy.add(alone.time(), alone.energy(), one.taken, one.given);
  };
  sample();
  while (one.steps < steps) {
    if (interrupt.signal() != 0) return;
    const StepsReport report = alone.run(std::min(stretch, steps - one.steps));
    one.steps += report.steps;
    sample();
    if (!report.ok()) {
      one.warnings.push_back(alone.describe(report.last));
      break;
    }
  }
  for (std::string& warning : energy_warnings(alone, one.energy)) one.warnings.push_back(std::move(warning));
  figures_.account = std::move(one);
}

template <class Real>
void RolloutExecution<Real>::recording(const std::function<void()>& work) {
  try {
    work();
  } catch (const std::runtime_error& error) {
    if (figures_.lost.empty()) figures_.lost = error.what();
  }
}

template <class Real>
void RolloutExecution<Real>::look() {
  const auto seen = batch_.observe();
  const auto velocities = seen.velocities(), energies = seen.energies();
  const auto positions = batch_.positions();
  const bool first = looked_at_ < 0;
  if (first) {
    figures_.first_energy.resize(energy_.size());
    figures_.most_kinetic.resize(energy_.size());
  }
  for (std::int64_t i = 0; i < arguments_.instances; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto kinetic = static_cast<double>(energies(i, 0));
    const double total = kinetic + static_cast<double>(energies(i, 1));
    energy_[at] = static_cast<Real>(total);
    if (first) figures_.first_energy[at] = total;
    figures_.most_kinetic[at] = std::max(figures_.most_kinetic[at], kinetic);
    if (!file_ && !parts_) continue;
    for (std::size_t k = 0; k < what_.size(); ++k) {
      const auto& from = what_[k] == Quantity::positions ? positions : what_[k] == Quantity::velocities ? velocities : energies;
      std::ranges::copy(from.instance(i), numbers_[k].begin() + i * from.rows());
    }
    status_[at] = static_cast<std::uint8_t>(batch_.record(i).status);
  }
  if ((file_ || parts_) && figures_.lost.empty()) {
    if (observations_) observe();
    const std::vector<std::span<const Real>> arrays(numbers_.begin(), numbers_.end());
    const double time = static_cast<double>(figures_.steps) * arguments_.options.step;
    recording([&] {
      if (file_) file_->add(time, arrays, energy_, status_);
      else parts_->add(time, arrays, energy_, status_);
    });
  }
  looked_at_ = figures_.steps;
}

template <class Real>
void RolloutExecution<Real>::keep() {
  if (parts_) {
    recording([&] { parts_->end_segment(); });
    // what goes on from here makes up for the frame of this moment alone
    const bool last_missing = figures_.steps % arguments_.every == 0;
    if (parts_->parts().frames() < frames_due() - (last_missing ? 1 : 0)) return;
  }
  RolloutPart part;
  part.steps = figures_.steps;
  part.looked_at = looked_at_;
  part.step_seconds = figures_.step_seconds;
  part.first_energy = figures_.first_energy;
  part.most_kinetic = figures_.most_kinetic;
  part.last_energy.assign(energy_.begin(), energy_.end());
  part.batch = batch_.checkpoint();
  figures_.kept = checkpoints_->keep(part, parts_ ? parts_->parts() : RecordedParts());
}

template <class Real>
void RolloutExecution<Real>::resume() {
  const RolloutPart part = checkpoints_->part_of(share_of(arguments_.instances, ranks_.rank(), ranks_.count()));
  if (part.steps > figures_.steps_planned) {
    throw InputError(fmt::format("--resume {}: its checkpoint is after {}, the rollout is to end after {}; expected a --duration that is no "
                                 "shorter",
                                 arguments_.resume, counted(part.steps, "step"), grouped(figures_.steps_planned)));
  }
  batch_.restore(part.batch, arguments_.resume);
  figures_.steps = part.steps;
  figures_.step_seconds = part.step_seconds;
  figures_.first_energy = part.first_energy;
  figures_.most_kinetic = part.most_kinetic;
  looked_at_ = part.looked_at;
  std::ranges::transform(part.last_energy, energy_.begin(), [](double energy) { return static_cast<Real>(energy); });
  tell("goes on after {} of {} steps, from {}", grouped(figures_.steps), grouped(figures_.steps_planned), arguments_.resume);
  if (parts_ && parts_->frames() < frames_due()) look();  // the frame for which there was no room
}

template <class Real>
void RolloutExecution<Real>::begin_views() {
  const std::int64_t shown = std::min(arguments_.shown, arguments_.instances);
  const FrameStride stride = frame_stride(figures_.steps_planned, arguments_.options.step, arguments_.views.fps,
                                          shown * model_->tree.bodies());
  frame_stride_ = stride.steps;
  recorder_.emplace(*model_, effects_, model_->names.model, shown);
  if (!stride.note.empty()) recorder_->add_note(stride.note);
  if (shown < arguments_.instances) {
    recorder_->add_note(fmt::format("the first {} of {} instances", grouped(shown), grouped(arguments_.instances)));
  }
  constexpr std::int64_t kMostCurves = 2000;
  for (std::int64_t i = 0; i < shown && shown * model_->tree.shape.positions <= kMostCurves; ++i) {
    recorder_->add_curves(position_curves(*model_, i));
  }
}

template <class Real>
void RolloutExecution<Real>::look_at_shown() {
  if (!recorder_) return;
  shown_positions_.clear();
  for (std::int64_t i = 0; i < std::min(arguments_.shown, arguments_.instances); ++i) {
    const auto rows = batch_.positions().instance(i);
    shown_positions_.insert(shown_positions_.end(), rows.begin(), rows.end());
  }
  recorder_->add(static_cast<double>(figures_.steps) * arguments_.options.step, shown_positions_, shown_positions_);
}

template <class Real>
void RolloutExecution<Real>::observe() {
  batch_.observe(*observations_, std::span<Real>(observed_));
  const auto width = static_cast<std::size_t>(observations_->width());
  numbers_.resize(what_.size());
  for (const Observed& entry : observations_->layout()) {
    std::vector<Real>& to = numbers_.emplace_back();
    for (std::size_t at = static_cast<std::size_t>(entry.offset); at < observed_.size(); at += width) {
      to.insert(to.end(), observed_.begin() + static_cast<std::ptrdiff_t>(at),
                observed_.begin() + static_cast<std::ptrdiff_t>(at) + entry.width);
    }
  }
}

template <class Real>
void RolloutExecution<Real>::finish() {
  constexpr std::size_t kMostTexts = 5;
  figures_.summary = batch_.summary();
  figures_.last_energy.assign(energy_.begin(), energy_.end());
  for (std::int64_t i = 0; i < arguments_.instances && figures_.failures.size() < kMostTexts; ++i) {
    const InstanceRecord& record = batch_.record(i);
    if (record.status == StepStatus::converged) continue;
    figures_.failures.push_back(fmt::format("instance {} at {:.6g} s: {}", i,
                                            static_cast<double>(record.steps) * arguments_.options.step, batch_.describe(i)));
  }
}

template class RolloutExecution<double>;
template class RolloutExecution<float>;

}  // namespace linden
