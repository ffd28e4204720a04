#include "engine/program/rollout_execution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "engine/distributed/stretches.hpp"
#include "engine/files/report_files.hpp"
#include "engine/program/effects_text.hpp"
#include "engine/program/energy_change.hpp"
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
RolloutExecution<Real>::RolloutExecution(Ranks& ranks, const RolloutArguments& arguments, std::shared_ptr<const Model> model,
                                         std::int64_t steps, RolloutCheckpoints* checkpoints)
    : ranks_(ranks),
      own_(share_of(arguments.instances, ranks.rank(), ranks.count())),
      arguments_(arguments),
      checkpoints_(checkpoints),
      model_(std::move(model)),
      effects_(arguments.effects()),
      observations_(observations_of(*model_, effects_, arguments.observe)),
      batch_(scene_of(arguments, *model_, own_.first), own_.count, arguments.computed),
      drawn_(records() ? arguments.randomization : Randomization(), *model_, effects_, own_.count) {
  figures_.steps_planned = steps;
  batch_.reset_all([&](std::int64_t i, std::span<double> positions, std::span<double> velocities) {
    const InitialState state = start_of(own_.first + i);
    std::ranges::copy(state.positions, positions.begin());
    std::ranges::copy(state.velocities, velocities.begin());
    if (!drawn_.arrays().empty()) drawn_.set(i, drawn_of(own_.first + i));
  });
  if (records() && observations_) {
    observed_.resize(static_cast<std::size_t>(own_.count * observations_->width()));
    observe();  // refuses accelerations where there are none
  }
  status_.resize(static_cast<std::size_t>(own_.count));
  energy_.resize(static_cast<std::size_t>(own_.count));
}

template <class Real>
void RolloutExecution<Real>::begin() {
  look_at_instances(arguments_, arguments_.options, arguments_.instances, ranks_, own_, [&](std::int64_t i) {
    const auto rows = batch_.positions().instance(i);
    return std::vector<double>(rows.begin(), rows.end());
  });
  if (records()) {
    std::vector<RecordedArray> arrays = arrays_of_what();
    if (observations_) {
      for (RecordedArray& array : recorded_observations(*observations_)) arrays.push_back(std::move(array));
    }
    const int packers = arguments_.compress ? batch_.threads() : 0;
    if (checkpoints_ && !checkpoints_->recorded().segments.empty()) {
      parts_.emplace(ranks_, arguments_.record, arguments_.instances, std::move(arrays), drawn_.arrays(), checkpoints_->recorded(), packers);
    } else if (checkpoints_ || ranks_.several()) {
      parts_.emplace(ranks_, arguments_.record, arguments_.instances, std::move(arrays), drawn_.arrays(), packers);
    } else {
      file_.emplace(arguments_.record, own_.count, std::move(arrays), drawn_.arrays(), packers);
    }
  }
  if (checkpoints_ && checkpoints_->resumed()) resume();
  if (arguments_.views.any() && ranks_.first()) begin_views();
}

template <class Real>
std::vector<RecordedArray> RolloutExecution<Real>::arrays_of_what() {
  what_ = arguments_.what.empty() ? usual_quantities(arguments_.record) : arguments_.what;
  const Names& names = batch_.model().names;
  std::vector<RecordedArray> arrays;
  numbers_.clear();
  for (const Quantity quantity : what_) {
    arrays.push_back(quantity == Quantity::positions    ? recorded_positions(names)
                     : quantity == Quantity::velocities ? recorded_velocities(names)
                                                        : RecordedArray{"energies", "energy_names", {"kinetic", "potential"}, "energy."});
    numbers_.emplace_back(static_cast<std::size_t>(own_.count) * arrays.back().rows.size());
  }
  return arrays;
}

template <class Real>
void RolloutExecution<Real>::steps(const Interrupt& interrupt) {
  Progress progress(figures_.steps_planned, arguments_.options.step);
  Stretches stretches(ranks_, figures_.steps_planned, figures_.steps);
  std::exception_ptr failure;  // the others are told of it before it is thrown
  const auto attempting = [&](const auto& work) {
    try {
      if (!failure) work();
    } catch (const std::exception&) {
      failure = std::current_exception();
    }
  };
  attempting([&] {
    if (looked_at_ < 0) look();
    look_at_shown();
  });
  Clock::time_point begin = Clock::now();
  bool more = true;
  while (more) {
    attempting([&] { advance(stretches.end(), progress); });
    const Clock::time_point now = Clock::now();
    more = stretches.next(seconds(now - begin), interrupt.signal(), failure || !figures_.lost.empty(), checkpoints_ && checkpoints_->due(now));
    if (more && stretches.due()) keep(failure != nullptr);
    begin = now;
  }
  // before the last frame, which one that goes on from here does not have
  if (checkpoints_) keep(failure != nullptr);
  attempting([&] {
    if (looked_at_ != figures_.steps) look();
    if (recorder_ && figures_.steps % frame_stride_ != 0) look_at_shown();
  });
  together(ranks_, [&] {
    if (failure) std::rethrow_exception(failure);
  });
  figures_.lost = first_text(ranks_, figures_.lost);
  if (figures_.steps < figures_.steps_planned && figures_.lost.empty()) figures_.signal = stretches.signal();
  gather_figures();
  if (figures_.signal == 0 && figures_.lost.empty()) account_of_one(interrupt);
}

template <class Real>
void RolloutExecution<Real>::advance(std::int64_t end, Progress& progress) {
  // where the recording is lost, one alone ends there, and of several all after the same step
  while (figures_.steps < end && (figures_.lost.empty() || ranks_.several())) {
    std::int64_t next = end;
    if (records()) next = std::min(next, (figures_.steps / arguments_.every + 1) * arguments_.every);
    if (recorder_) next = std::min(next, (figures_.steps / frame_stride_ + 1) * frame_stride_);
    const Clock::time_point begin = Clock::now();
    batch_.step(next - figures_.steps);
    const Clock::time_point now = Clock::now();
    figures_.step_seconds += seconds(now - begin);
    figures_.steps = next;
    if (records() && figures_.steps % arguments_.every == 0) look();
    if (recorder_ && figures_.steps % frame_stride_ == 0) look_at_shown();
    progress.update(figures_.steps, now);
  }
}

template <class Real>
bool RolloutExecution<Real>::write_files() {
  bool fine = true;
  if (records()) {
    const std::string before = figures_.lost;
    recording([&] {
      if (parts_) parts_->commit();
      else file_->commit();
    });
    figures_.frames = parts_ ? parts_->frames() : file_->frames();
    if (!before.empty()) figures_.lost = before;
    fine = figures_.lost.empty();
  }
  if (recorder_) {
    WrittenViews views = write_views(arguments_.views, recorder_->animation());
    figures_.views = std::move(views.lines);
    fine = fine && views.fine;
  }
  if (!arguments_.json.empty() && ranks_.first()) {
    fine = attempt([&] { write_json(arguments_.json, rollout_json(arguments_, batch_.model(), figures_)); }) && fine;
  }
  return fine;
}

template <class Real>
Scene RolloutExecution<Real>::scene_of(const RolloutArguments& arguments, const Model& model, std::int64_t first) {
  Scene scene;
  if (arguments.scene) scene = *arguments.scene;
  else scene.model = model;
  scene.options = arguments.options;
  scene.randomization = arguments.randomization;
  scene.seed = randomness(arguments)->seed + static_cast<std::uint64_t>(first);
  scene.start_as_given = true;
  return scene;
}

template <class Real>
InitialState RolloutExecution<Real>::start_of(std::int64_t i) const {
  const double spread = randomness(arguments_)->spread;
  if (!arguments_.scene) return random_state(*model_, seed_of(i), spread);
  return random_around(*model_, arguments_.scene->initial, seed_of(i), spread, effects_);
}

template <class Real>
void RolloutExecution<Real>::account_of_one(const Interrupt& interrupt) {
  constexpr std::int64_t kMostAccounted = 10'000, kSamples = 2'000;
  if (effect_lines(effects_, *model_).empty()) return;
  AccountOfOne one;
  one.instance = arguments_.instances;
  for (std::int64_t i = own_.count; i-- > 0;) {
    if (batch_.record(i).status == StepStatus::converged) one.instance = own_.first + i;
  }
  ranks_.least({&one.instance, 1});
  if (one.instance == arguments_.instances || !ranks_.first()) return;
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
    first_energy_.resize(energy_.size());
    most_kinetic_.resize(energy_.size());
  }
  for (std::int64_t i = 0; i < own_.count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto kinetic = static_cast<double>(energies(i, 0));
    const double total = kinetic + static_cast<double>(energies(i, 1));
    energy_[at] = static_cast<Real>(total);
    if (first) first_energy_[at] = total;
    most_kinetic_[at] = std::max(most_kinetic_[at], kinetic);
    if (!records()) continue;
    for (std::size_t k = 0; k < what_.size(); ++k) {
      const auto& from = what_[k] == Quantity::positions ? positions : what_[k] == Quantity::velocities ? velocities : energies;
      std::ranges::copy(from.instance(i), numbers_[k].begin() + i * from.rows());
    }
    status_[at] = static_cast<std::uint8_t>(batch_.record(i).status);
  }
  if (records() && figures_.lost.empty()) {
    if (observations_) observe();
    const std::vector<std::span<const Real>> arrays(numbers_.begin(), numbers_.end());
    const double time = static_cast<double>(figures_.steps) * arguments_.options.step;
    recording([&] {
      if (parts_) parts_->add(time, arrays, energy_, status_);
      else file_->add(time, arrays, energy_, status_);
    });
  }
  looked_at_ = figures_.steps;
}

template <class Real>
void RolloutExecution<Real>::keep(bool failed) {
  std::int64_t any = failed ? 1 : 0;
  ranks_.most({&any, 1});
  if (any != 0) return;
  if (parts_) {
    recording([&] { parts_->end_segment(); });
    // what goes on from here makes up for the frame of this moment alone
    const bool last_missing = figures_.steps % arguments_.every == 0;
    if (parts_->parts().frames() < frames_due() - (last_missing ? 1 : 0)) return;
  }
  RolloutPart part;
  part.first = own_.first;
  part.steps = figures_.steps;
  part.looked_at = looked_at_;
  part.step_seconds = figures_.step_seconds;
  part.first_energy = first_energy_;
  part.most_kinetic = most_kinetic_;
  part.last_energy.assign(energy_.begin(), energy_.end());
  part.batch = batch_.checkpoint();
  figures_.kept = checkpoints_->keep(part, parts_ ? parts_->parts() : RecordedParts());
}

template <class Real>
void RolloutExecution<Real>::resume() {
  const RolloutPart part = checkpoints_->part_of(own_);
  if (part.steps > figures_.steps_planned) {
    throw InputError(fmt::format("--resume {}: its checkpoint is after {}, the rollout is to end after {}; expected a --duration that is no "
                                 "shorter",
                                 arguments_.resume, counted(part.steps, "step"), grouped(figures_.steps_planned)));
  }
  batch_.restore(part.batch, arguments_.resume);
  figures_.steps = part.steps;
  figures_.step_seconds = part.step_seconds;
  first_energy_ = part.first_energy;
  most_kinetic_ = part.most_kinetic;
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
void RolloutExecution<Real>::gather_figures() {
  constexpr std::size_t kMostTexts = 5;
  constexpr char kEnd = '\0';
  const BatchSummary own = batch_.summary();
  std::int64_t sums[] = {own.frozen, own.steps, own.evaluations, own.factors, own.rescued,
                         batch_.threads(), static_cast<std::int64_t>(batch_.bytes())};
  ranks_.sum(sums);
  figures_.summary = {.frozen = sums[0], .steps = sums[1], .evaluations = sums[2], .factors = sums[3], .rescued = sums[4]};
  figures_.threads = static_cast<int>(sums[5]), figures_.bytes = static_cast<std::size_t>(sums[6]);
  figures_.ranks = ranks_.count(), figures_.lanes = batch_.lanes();
  ranks_.most({&figures_.step_seconds, 1});
  last_energy_.assign(energy_.begin(), energy_.end());
  figures_.energy = energy_change(ranks_, own_, arguments_.instances, first_energy_, last_energy_, most_kinetic_);

  std::string failures;
  std::size_t count = 0;
  for (std::int64_t i = 0; i < own_.count && count < kMostTexts; ++i) {
    const InstanceRecord& record = batch_.record(i);
    if (record.status == StepStatus::converged) continue;
    failures += fmt::format("instance {} at {:.6g} s: {}", own_.first + i, static_cast<double>(record.steps) * arguments_.options.step,
                            batch_.describe(i));
    failures += kEnd;
    count += 1;
  }
  for (const std::string& of_rank : ranks_.gather(failures)) {
    for (std::size_t at = 0; at < of_rank.size() && figures_.failures.size() < kMostTexts;) {
      const std::size_t end = of_rank.find(kEnd, at);
      figures_.failures.push_back(of_rank.substr(at, end - at));
      at = end + 1;
    }
  }
}

template class RolloutExecution<double>;
template class RolloutExecution<float>;

}  // namespace linden
