#include "engine/program/run_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "engine/files/output_file.hpp"
#include "engine/files/recorder.hpp"
#include "engine/files/report_files.hpp"
#include "engine/initial_state.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/progress.hpp"
#include "engine/program/run_report.hpp"
#include "engine/program/start_report.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/text.hpp"

namespace linden {
namespace {

using Clock = Progress::Clock;

constexpr std::int64_t kSamples = 20'000;

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
  Outputs outputs{{"--record", arguments.record, {".csv"}},
                  {"--json", arguments.json, {".json"}},
                  {"--plot", arguments.plot, {".svg", ".png"}},
                  {"--save", arguments.save, {}}};
  if (!arguments.save.empty() && holds_something_else(arguments.save)) {
    throw InputError(fmt::format("--save {}: the file exists and is no checkpoint; choose another name", arguments.save));
  }
  if (!arguments.load.empty()) outputs.spare({arguments.load});
  return outputs;
}

/// Puts the simulation where the run is to begin.
void begin_run(const RunArguments& arguments, Simulation& simulation) {
  if (!arguments.load.empty()) return simulation.load(arguments.load);
  InitialState state;
  if (arguments.scene) {
    state = arguments.scene->initial;
  } else if (const auto random = randomness(arguments)) {
    state = random_state(simulation.model(), random->seed, random->spread);
  }
  if (!state.positions.empty()) simulation.set_positions(state.positions);
  if (!state.velocities.empty()) simulation.set_velocities(state.velocities);
}

/// One run from its first sample to its files.
class Execution {
 public:
  Execution(const RunArguments& arguments, Simulation& simulation, std::int64_t steps) : arguments_(arguments), simulation_(simulation) {
    figures_.steps_planned = steps;
    figures_.sampled_every = arguments.record.empty() ? (steps + kSamples - 1) / kSamples : 1;
    figures_.begin = simulation.time();
    figures_.energy = EnergyDrift(steps / figures_.sampled_every + 1);
    if (!act_from_outside(arguments.effects())) figures_.momentum = MomentumDrift::of(simulation);
    if (!arguments.record.empty()) recorder_.emplace(arguments.record, simulation.model().names);
  }

  void steps() {
    const Interrupt interrupt;
    Progress progress(figures_.steps_planned, simulation_.options().step);
    std::int64_t chunk = 1;  // steps between two looks at the clock
    sample();
    while (figures_.run.steps < figures_.steps_planned && figures_.failure.empty() && interrupt.signal() == 0) {
      const std::int64_t end = std::min({figures_.steps_planned, figures_.run.steps + chunk, next_sample_});
      const Clock::time_point begin = Clock::now();
      figures_.run.add(simulation_.run(end - figures_.run.steps));
      if (!figures_.run.ok()) figures_.failure = simulation_.describe(figures_.run.last);
      const Clock::time_point now = Clock::now();
      const double taken = seconds(now - begin);
      figures_.step_seconds += taken;
      if (taken > 0.04) chunk = std::max<std::int64_t>(1, chunk / 2);
      if (taken < 0.01) chunk = std::min(2 * chunk, figures_.sampled_every);
      if (figures_.run.steps == next_sample_) sample();
      progress.update(figures_.run.steps, now);
    }
    if (last_sample_ != figures_.run.steps) sample();
    if (figures_.run.steps < figures_.steps_planned) figures_.signal = interrupt.signal();
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
    write(arguments_.record, [&] { recorder_->commit(); });
    write(arguments_.save, [&] { simulation_.save(arguments_.save); });
    write(arguments_.plot, [&] { plot::draw(arguments_.plot, energy_chart(arguments_, simulation_, figures_)); });
    write(arguments_.json, [&] { write_json(arguments_.json, run_json(arguments_, simulation_, figures_)); });
    return fine;
  }

  RunFigures& figures() { return figures_; }
  const std::vector<std::string>& written() const { return written_; }

 private:
  void sample() {
    const Energy energy = simulation_.energy();
    figures_.taken = simulation_.effect_work().taken();
    figures_.given = simulation_.effect_work().given();
    figures_.energy.add(simulation_.time(), energy, figures_.taken, figures_.given);
    if (figures_.momentum) figures_.momentum->add(simulation_, energy);
    if (recorder_) recorder_->add(simulation_.time(), energy.total(), simulation_.positions());
    // what effects took is still in the account, what they gave is not
    if (!arguments_.plot.empty()) trace({simulation_.time(), energy.total() + figures_.taken - figures_.given - figures_.energy.initial()});
    last_sample_ = figures_.run.steps;
    next_sample_ = figures_.run.steps + figures_.sampled_every;
  }

  void trace(plot::Point point) {
    // the picture is some 640 columns wide: of the samples in one 4,000th of the run only the extremes can be seen
    constexpr std::size_t kMostPoints = 1 << 16;
    constexpr double kColumns = 4000;
    figures_.trace.push_back(point);
    if (figures_.trace.size() < kMostPoints) return;
    figures_.trace = plot::thinned(figures_.trace, static_cast<double>(figures_.steps_planned) * simulation_.options().step / kColumns);
  }

  const RunArguments& arguments_;
  Simulation& simulation_;
  RunFigures figures_;
  std::optional<Recorder> recorder_;
  std::int64_t last_sample_ = -1, next_sample_ = 0;
  std::vector<std::string> written_;
};

/// What to say of a run that did not reach its end.
std::string ending(const Execution& run, const RunFigures& figures, const Options& options) {
  const std::int64_t done = figures.run.steps;
  const double time = figures.begin + figures.simulated(options.step);
  const std::string files = run.written().empty() ? "" : fmt::format("; {} {} valid up to there", fmt::join(run.written(), ", "),
                                                                     run.written().size() == 1 ? "is" : "are");
  if (figures.signal != 0) {
    return fmt::format("interrupted at {:.6g} s, after {} of {} steps{}", time, grouped(done), grouped(figures.steps_planned), files);
  }
  return fmt::format("the run failed in step {} of {}: {}; the last good state is that at {:.6g} s{}", grouped(done + 1),
                     grouped(figures.steps_planned), figures.failure, time, files);
}

}  // namespace

int run_command(const RunArguments& arguments) {
  const Clock::time_point begin = Clock::now();
  check(arguments.options);
  const std::int64_t steps = step_count(arguments, arguments.options.step);
  const Outputs outputs = checked_outputs(arguments);

  const std::shared_ptr<const Model> model = arguments.loaded(outputs);
  print_warnings(*model);
  if (arguments.load.empty()) look_at_start(arguments, *model, arguments.options);
  Simulation simulation(model, arguments.options, arguments.effects());
  begin_run(arguments, simulation);

  Execution run(arguments, simulation, steps);
  run.steps();
  RunFigures& figures = run.figures();
  figures.total_seconds = seconds(Clock::now() - begin);
  const bool written = run.write_files();
  fmt::print("{}", run_summary(arguments, simulation, figures));
  std::fflush(stdout);
  for (const std::string& warning : energy_warnings(simulation, figures.energy)) fmt::print(stderr, "linden: warning: {}\n", printable(warning));
  if (!figures.complete()) fmt::print(stderr, "linden: {}\n", printable(ending(run, figures, arguments.options)));
  return figures.signal != 0 ? 128 + figures.signal : written && figures.complete() ? 0 : 1;
}

}  // namespace linden
