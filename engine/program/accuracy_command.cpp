#include "engine/program/accuracy_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/files/output_file.hpp"
#include "engine/files/report_files.hpp"
#include "engine/program/accuracy_report.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/progress.hpp"
#include "engine/program/start_report.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

constexpr double kMostBudget = 1e6;  // [s]

Outputs checked_outputs(const AccuracyArguments& arguments) {
  check(arguments.options);
  (void)step_count(arguments, arguments.options.step);
  if (!(arguments.budget > 0) || arguments.budget > kMostBudget) {
    throw InputError(fmt::format("--budget {}: expected seconds above zero, at most {:.0e}", arguments.budget, kMostBudget));
  }
  return {{"--json", arguments.json, {".json"}}, {"--plot", arguments.plot, {".svg", ".png"}}};
}

AccuracySetup setup_of(const AccuracyArguments& arguments, const Outputs& outputs) {
  AccuracySetup setup;
  setup.options = arguments.options;
  setup.duration = arguments.duration;
  setup.budget = arguments.budget;
  setup.model = arguments.loaded(outputs);
  setup.effects = arguments.effects();
  if (arguments.scene) {
    setup.start = arguments.scene->initial;
  } else if (const auto random = randomness(arguments)) {
    setup.start = random_state(*setup.model, random->seed, random->spread);
  }
  return setup;
}

AccuracyFigures measure(const AccuracySetup& setup, const Interrupt& interrupt, int& signal) {
  constexpr double kTick = 0.1;  // [s]
  Progress progress(std::max<std::int64_t>(1, std::llround(setup.budget / kTick)), kTick, "s of the budget");
  const auto go_on = [&](double gone) {
    progress.update(std::llround(std::min(gone, setup.budget) / kTick), Progress::Clock::now());
    return interrupt.signal() == 0;
  };
  AccuracyFigures figures = measure_accuracy(setup, go_on);
  signal = figures.interrupted ? interrupt.signal() : 0;
  return figures;
}

}  // namespace

int accuracy_command(const AccuracyArguments& arguments) {
  const AccuracySetup setup = setup_of(arguments, checked_outputs(arguments));
  print_warnings(*setup.model);
  look_at_start(arguments, *setup.model, arguments.options);
  const Interrupt interrupt;
  int signal = 0;
  const AccuracyFigures figures = measure(setup, interrupt, signal);
  bool written = true;
  if (!arguments.json.empty()) {
    written &= attempt([&] { write_json(arguments.json, accuracy_json(arguments, setup, figures)); });
  }
  const bool any = std::ranges::any_of(figures.rows, &AccuracyRow::done);
  if (!arguments.plot.empty() && any) {
    written &= attempt([&] { plot::draw(arguments.plot, accuracy_charts(arguments, setup, figures)); });
  }
  say_text(accuracy_summary(arguments, setup, figures));
  if (signal != 0) {
    tell("interrupted after {}", counted(std::ranges::count_if(figures.rows, &AccuracyRow::done), "row"));
    return 128 + signal;
  }
  if (!figures.reference.failure.empty()) {
    tell("there is nothing to judge by: {}; try a smaller --dt, a shorter --duration or a larger --budget",
         figures.reference.failure);
    return 1;
  }
  if (!any) {
    tell("no run came to its end within the budget; try a shorter --duration or a larger --budget");
    return 1;
  }
  return written ? 0 : 1;
}

}  // namespace linden
