#include "engine/program/run_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "engine/files/output_file.hpp"
#include "engine/files/report_files.hpp"
#include "engine/files/rollout_file.hpp"
#include "engine/initial_state.hpp"
#include "engine/program/animator.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/progress.hpp"
#include "engine/program/randomize.hpp"
#include "engine/program/run_report.hpp"
#include "engine/program/run_start.hpp"
#include "engine/program/start_report.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/standard_streams.hpp"
#include "engine/step_pilot.hpp"
#include "engine/text.hpp"

namespace linden {
namespace {

using Clock = Progress::Clock;

/// Whether the file holds something that is no checkpoint: a slip of the hand should not cost anyone a file.
bool holds_something_else(const std::string& file) {
  constexpr std::string_view kBegins = "linden checkpoint";
  std::ifstream in(file, std::ios::binary);
  std::string begins(kBegins.size(), '\0');
  in.read(begins.data(), static_cast<std::streamsize>(begins.size()));
  return in.gcount() > 0 && begins != kBegins;
}

/// Every file that is to be written can be.
Outputs checked_outputs(const RunArguments& arguments) {
  if (arguments.every < 1) throw InputError(fmt::format("--every {}: expected 1 step or more between rows", arguments.every));
  if (arguments.every != 1 && arguments.record.empty()) throw InputError("--every thins what --record writes: give a --record file too");
  if (!arguments.what.empty() && arguments.record.empty() && arguments.plot.empty()) {
    throw InputError("--what says what --record and --plot take: give one of them too");
  }
  if (!arguments.observe.empty() && arguments.record.empty() && arguments.plot.empty() && !arguments.views.any()) {
    throw InputError("--observe says what --record, --plot and --view take beside what is usual: give one of them too");
  }
  std::vector<Output> files{{"--record", arguments.record, {".csv", ".npz", ".h5"}},
                            {"--json", arguments.json, {".json"}},
                            {"--plot", arguments.plot, {".svg", ".png"}},
                            {"--save", arguments.save, {}}};
  for (const Output& file : outputs_of(arguments.views)) files.push_back(file);
  const Outputs outputs(files);
  if (!arguments.save.empty() && holds_something_else(arguments.save)) {
    throw InputError(fmt::format("--save {}: the file exists and is no checkpoint; choose another name", arguments.save));
  }
  if (!arguments.load.empty()) outputs.spare({arguments.load});
  return outputs;
}

/// Between two nodes positions alone are known.
std::vector<Quantity> recorded_quantities(const RunArguments& arguments, const Simulation& simulation) {
  if (!simulation.step_lengths()) return arguments.what.empty() ? usual_quantities(arguments.record) : arguments.what;
  const bool more = !arguments.observe.empty() || std::ranges::any_of(arguments.what, [](Quantity what) { return what != Quantity::positions; });
  if (more) {
    throw InputError("--record with --accuracy: where steps vary positions are recorded, between the steps, and nothing else: leave out --observe and what "
                     "else --what names, or give --dt for fixed steps");
  }
  return {Quantity::positions};
}

/// A run that goes on does so in the steps that it had.
void take_saved_steps(RunArguments& arguments) {
  if (arguments.load.empty() || !arguments.options.varies()) return;
  const Simulation::SavedSteps saved = Simulation::saved_steps(arguments.load);
  if (saved.vary) return;
  arguments.options.vary = false;
  arguments.options.step = saved.step;
}

/// Chooses fixed or variable steps where an accuracy is asked for and no step is named; says why. simulation: ready to go.
std::string choose_steps(RunArguments& arguments, std::unique_ptr<Simulation>& simulation, const std::shared_ptr<const Model>& model) {
  if (!arguments.options.accuracy) return "";
  if (!arguments.load.empty()) return "as in the run that is continued";
  if (!arguments.options.varies()) return "the step is given";
  const StepPilot found = pilot(*simulation, arguments.duration);
  if (found.vary) return found.why;
  arguments.options.vary = false;
  arguments.options.step = found.step;
  simulation = std::make_unique<Simulation>(model, arguments.options, arguments.effects());
  begin_run(arguments, *simulation);
  return found.why;
}

/// One run from its first sample to its files.
class RunExecution {
 public:
  RunExecution(const RunArguments& arguments, Simulation& simulation, std::int64_t steps, const DrawnNumbers& drawn)
      : arguments_(arguments), simulation_(simulation) {
    figures_.drawn = drawn;
    figures_.steps_planned = steps;
    figures_.sampled_every = arguments.record.empty() ? energy_stride(steps) : 1;
    figures_.begin = simulation.time();
    figures_.energy = EnergyDrift(steps / figures_.sampled_every + 1);
    if (!act_from_outside(arguments.effects())) figures_.momentum = MomentumDrift::of(simulation);
    if (!arguments.record.empty()) {
      observer_.emplace(simulation, recorded_quantities(arguments, simulation), arguments.observe);
      DrawnArrays arrays(arguments.randomization, simulation.model(), simulation.effects(), 1);
      arrays.set(0, drawn);
      file_.emplace(arguments.record, 1, observer_->arrays(), arrays.arrays());
    }
    if (!arguments.plot.empty() && !(arguments.what.empty() && arguments.observe.empty())) begin_traces();
    if (arguments.views.any()) animator_.emplace(simulation, arguments.views, steps, arguments.observe);
  }

  /// Variable steps, rows and frames every so many seconds; energy is looked at in every node.
  void variable_steps(const Interrupt& interrupt, double duration) {
    const double step = arguments_.options.step, end = figures_.begin + duration;
    const auto count = [&](double time) { return std::llround((time - figures_.begin) / step); };
    Progress progress(count(end), step);
    const auto time_of = [&](std::int64_t steps) { return figures_.begin + static_cast<double>(steps) * step; };
    constexpr double kAt = 1e-9;  // of a step
    sample();
    record_rows(figures_.begin);
    look();
    std::int64_t row = arguments_.every;
    while (simulation_.time() < end - kAt * step && figures_.failure.empty() && figures_.lost.empty() && interrupt.signal() == 0) {
      const Clock::time_point begin = Clock::now();
      // what is just beyond the node is one step away; only where rows are to lie within it is its beginning kept
      const StepsReport report = file_ ? simulation_.advance_to(simulation_.time() + 2 * kAt * simulation_.last_step()) : simulation_.run(1);
      figures_.run.add(report);
      if (!report.ok()) figures_.failure = simulation_.describe(report.last);
      const Clock::time_point now = Clock::now();
      figures_.step_seconds += seconds(now - begin);
      figures_.end = simulation_.time();
      if (!report.ok()) break;
      sample();
      for (; time_of(row) <= std::min(simulation_.time(), end + kAt * step); row += arguments_.every) record_rows(time_of(row));
      if (animator_ && simulation_.time() >= time_of(next_frame_)) {
        animator_->look();
        while (simulation_.time() >= time_of(next_frame_)) next_frame_ += animator_->stride();
      }
      progress.update(count(simulation_.time()), now);
    }
    if (simulation_.time() < end - kAt * step && figures_.lost.empty() && figures_.failure.empty()) figures_.signal = interrupt.signal();
  }

  void steps(const Interrupt& interrupt) {
    Progress progress(figures_.steps_planned, simulation_.options().step);
    std::int64_t chunk = 1;  // steps between two looks at the clock
    sample();
    look();
    while (figures_.run.steps < figures_.steps_planned && figures_.failure.empty() && figures_.lost.empty() && interrupt.signal() == 0) {
      const std::int64_t end = std::min({figures_.steps_planned, figures_.run.steps + chunk, next_sample_, next_frame_});
      const Clock::time_point begin = Clock::now();
      figures_.run.add(simulation_.run(end - figures_.run.steps));
      if (!figures_.run.ok()) figures_.failure = simulation_.describe(figures_.run.last);
      const Clock::time_point now = Clock::now();
      const double taken = seconds(now - begin);
      figures_.step_seconds += taken;
      if (taken > 0.04) chunk = std::max<std::int64_t>(1, chunk / 2);
      if (taken < 0.01) chunk = std::min(2 * chunk, figures_.sampled_every);
      if (figures_.run.steps == next_sample_) sample();
      if (figures_.run.steps == next_frame_) look();
      progress.update(figures_.run.steps, now);
    }
    if (last_sample_ != figures_.run.steps) sample();
    if (last_record_ != figures_.run.steps) record(simulation_.energy());
    if (animator_ && last_frame_ != figures_.run.steps) look();
    if (figures_.run.steps < figures_.steps_planned && figures_.lost.empty()) figures_.signal = interrupt.signal();
  }

  /// Everything that was asked for. Complaints go to stderr; true where there were none.
  bool write_files() {
    bool fine = true;
    const auto write = [&](const std::string& file, const std::function<void()>& action) {
      if (file.empty()) return;
      if (attempt(action)) {
        written_.push_back(file);
      } else {
        fine = false;
      }
    };
    if (file_) {
      keep_recording();
      if (figures_.rows > 0) written_.push_back(arguments_.record);
      fine = figures_.lost.empty();
    }
    write(arguments_.save, [&] { simulation_.save(arguments_.save); });
    write(arguments_.plot, [&] { plot::draw(arguments_.plot, run_charts(arguments_, simulation_, figures_)); });
    if (animator_) {
      WrittenViews views = write_views(arguments_.views, animator_->animation());
      figures_.views = std::move(views.lines);
      fine = fine && views.fine;
    }
    write(arguments_.json, [&] { write_json(arguments_.json, run_json(arguments_, simulation_, figures_)); });
    return fine;
  }

  RunFigures& figures() { return figures_; }
  const std::vector<std::string>& written() const { return written_; }

 private:
  void recording(const std::function<void()>& work) {
    try {
      work();
    } catch (const std::runtime_error& error) {
      figures_.lost = error.what();
    }
  }

  /// Rows that were recorded before the disk was full are kept.
  void keep_recording() {
    const std::string before = figures_.lost;
    recording([&] { file_->commit(); });
    if (!before.empty()) figures_.lost = before;
    figures_.rows = file_->frames();
  }

  void begin_traces() {
    if (!observer_) observer_.emplace(simulation_, arguments_.what, arguments_.observe);
    constexpr std::size_t kMostRows = 64;  // kept; what is drawn of them says run_charts
    for (std::size_t k = 0; k < observer_->arrays().size(); ++k) {
      const RecordedArray& array = observer_->arrays()[k];
      const std::optional<Quantity> quantity = observer_->quantity_of_array()[k];
      if (quantity && arguments_.what.empty()) continue;  // recorded because it is usual
      traced_.push_back(k);
      QuantityTrace& trace = figures_.traces.emplace_back(QuantityTrace{quantity, array.name, array.units, array.rows, array.rows.size(), {}});
      trace.rows.resize(std::min(kMostRows, trace.all));
      trace.points.resize(trace.rows.size());
    }
  }

  void record(const Energy& energy) {
    if (!file_ || !figures_.lost.empty()) return;
    const double total = energy.total();
    const auto status = static_cast<std::uint8_t>(figures_.run.last.status);
    recording([&] { file_->add(simulation_.time(), observer_->look(), {&total, 1}, {&status, 1}); });
    last_record_ = figures_.run.steps;
  }

  /// Positions at a time between two nodes, and the energy of the later one.
  void record_rows(double time) {
    if (!file_ || !figures_.lost.empty()) return;
    const std::vector<double> positions = simulation_.positions_at(time);
    const std::span<const double> row(positions);
    const double total = simulation_.energy().total();
    const auto status = static_cast<std::uint8_t>(figures_.run.last.status);
    recording([&] { file_->add(time, {&row, 1}, {&total, 1}, {&status, 1}); });
  }

  /// Of this run; that of a run which it continues is in the checkpoint.
  EffectWork work_since_begin() const {
    EffectWork work = simulation_.effect_work();
    for (std::size_t k = 0; k < work.each.size(); ++k) work.each[k] -= work_before_.each[k];
    return work;
  }

  void sample() {
    const Energy energy = simulation_.energy();
    const EffectWork work = work_since_begin();
    figures_.taken = work.taken();
    figures_.given = work.given();
    figures_.energy.add(simulation_.time(), energy, figures_.taken, figures_.given);
    if (figures_.momentum) figures_.momentum->add(simulation_, energy);
    if (!simulation_.step_lengths() && figures_.run.steps % arguments_.every == 0) record(energy);
    if (!figures_.traces.empty()) {
      const auto numbers = observer_->look();
      for (std::size_t k = 0; k < figures_.traces.size(); ++k) {
        std::vector<std::vector<plot::Point>>& rows = figures_.traces[k].points;
        for (std::size_t row = 0; row < rows.size(); ++row) trace(rows[row], {simulation_.time(), numbers[traced_[k]][row]});
      }
    } else if (!arguments_.plot.empty()) {
      // what effects took is still in the account, what they gave is not
      trace(figures_.trace, {simulation_.time(), energy.total() + figures_.taken - figures_.given - figures_.energy.initial()});
    }
    last_sample_ = figures_.run.steps;
    next_sample_ = figures_.run.steps + figures_.sampled_every;
  }

  /// A frame of what is to be looked at.
  void look() {
    if (!animator_) return;
    animator_->look();
    last_frame_ = figures_.run.steps;
    next_frame_ = figures_.run.steps + animator_->stride();
  }

  void trace(std::vector<plot::Point>& points, plot::Point point) const {
    // the picture is some 640 columns wide: of the samples in one 4,000th of the run only the extremes can be seen
    constexpr std::size_t kMostPoints = 1 << 16;
    constexpr double kColumns = 4000;
    points.push_back(point);
    if (points.size() < kMostPoints) return;
    points = plot::thinned(points, static_cast<double>(figures_.steps_planned) * simulation_.options().step / kColumns);
  }

  const RunArguments& arguments_;
  Simulation& simulation_;
  EffectWork work_before_ = simulation_.effect_work();
  RunFigures figures_;
  std::optional<Observer> observer_;  // of what is recorded or plotted
  std::vector<std::size_t> traced_;   // arrays of it that are plotted
  std::optional<RolloutFile<double>> file_;
  std::optional<Animator> animator_;
  std::int64_t last_frame_ = -1, next_frame_ = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_sample_ = -1, last_record_ = -1, next_sample_ = 0;
  std::vector<std::string> written_;
};

/// What to say of a run that did not reach its end.
std::string ending(const RunExecution& run, const RunFigures& figures, const Options& options) {
  const std::int64_t done = figures.run.steps;
  const double time = figures.begin + figures.simulated(options.step);
  const std::string planned = figures.end ? counted(done, "step") : fmt::format("{} of {} steps", grouped(done), grouped(figures.steps_planned));
  const std::string files = run.written().empty() ? "" : fmt::format("; {} {} valid up to there", fmt::join(run.written(), ", "),
                                                                     run.written().size() == 1 ? "is" : "are");
  if (figures.signal != 0) {
    return fmt::format("interrupted at {:.6g} s, after {}{}", time, planned, files);
  }
  if (figures.failure.empty()) {
    const std::string kept = figures.rows > 0 ? fmt::format("it holds {}", counted(figures.rows, "row"))
                                              : "no row of it is kept";
    return fmt::format("{}; {}; the run ended at {:.6g} s, after {}", figures.lost, kept, time, planned);
  }
  return fmt::format("the run failed in step {}: {}; the last good state is that at {:.6g} s{}",
                     figures.end ? grouped(done + 1) : fmt::format("{} of {}", grouped(done + 1), grouped(figures.steps_planned)), figures.failure, time,
                     files);
}

}  // namespace

int run_command(const RunArguments& given) {
  const Clock::time_point begin = Clock::now();
  RunArguments arguments = given;
  check(arguments.options);
  (void)step_count(arguments, arguments.options.step);  // looks at the duration
  const Outputs outputs = checked_outputs(arguments);

  std::shared_ptr<const Model> model = arguments.loaded(outputs);
  print_warnings(*model);
  check_views(arguments.views, *model, arguments.duration);
  const DrawnNumbers drawn = randomize(arguments, model);
  if (arguments.load.empty()) look_at_start(arguments, *model, arguments.options);
  take_saved_steps(arguments);
  auto ready = std::make_unique<Simulation>(model, arguments.options, arguments.effects());
  begin_run(arguments, *ready);
  const std::string why = choose_steps(arguments, ready, model);
  Simulation& simulation = *ready;

  const Interrupt interrupt;
  RunExecution run(arguments, simulation, step_count(arguments, arguments.options.step), drawn);
  RunFigures& figures = run.figures();
  figures.steps_why = why;
  if (arguments.options.varies()) {
    run.variable_steps(interrupt, arguments.duration);
  } else {
    run.steps(interrupt);
  }
  figures.total_seconds = seconds(Clock::now() - begin);
  const bool written = run.write_files();
  say_text(run_summary(arguments, simulation, figures));
  for (const std::string& warning : energy_warnings(simulation, figures.energy)) tell("warning: {}", warning);
  if (!figures.complete()) tell_text(ending(run, figures, arguments.options));
  return figures.signal != 0 ? 128 + figures.signal : written && figures.complete() ? 0 : 1;
}

}  // namespace linden
