#include "engine/program/view_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "engine/initial_state.hpp"
#include "engine/program/animator.hpp"
#include "engine/program/live_view.hpp"
#include "engine/program/recording_view.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

int finish(const ViewCommandArguments& arguments, const Model& model, const Animation& animation) {
  check_views(arguments.views, model, animation.times.back() - animation.times.front());
  const WrittenViews written = write_views(arguments.views, animation);
  say("{:<11} {}\n", "model", model_text(arguments, model));
  for (const std::string& line : written.lines) say("{:<11} {}\n", "", printable(line));
  return written.fine ? 0 : 1;
}

/// What --record wrote. `arguments` are of its model.
int show_recording(const ViewCommandArguments& arguments, const std::string& file) {
  const Outputs outputs(outputs_of(arguments.views));
  outputs.spare({file});
  const std::shared_ptr<const Model> model = arguments.loaded(outputs);
  print_warnings(*model);
  return finish(arguments, *model, animation_of(read_recording(file), file, *model, arguments.effects(), arguments.views, arguments.shown));
}

/// A model that stands still.
int show_model(const ViewCommandArguments& arguments) {
  check(arguments.options);
  const Outputs outputs(outputs_of(arguments.views));
  const std::shared_ptr<const Model> model = arguments.loaded(outputs);
  print_warnings(*model);
  Simulation simulation(model, arguments.options);
  if (const auto random = randomness(arguments)) {
    simulation.set_positions(random_state(*model, random->seed, random->spread).positions);
  }
  Animator animator(simulation, arguments.views, 0, arguments.observe);
  animator.look();
  return finish(arguments, *model, animator.animation());
}

}  // namespace

std::string usual_view(const std::string& model) {
  std::string name = std::filesystem::path(model).stem().string();
  std::ranges::replace(name, ':', '-');
  return name + ".html";
}

int view_command(const ViewCommandArguments& arguments) {
  if (arguments.views.live) return live_view(arguments);
  if (!arguments.recording.empty()) return show_recording(arguments, arguments.recording);
  return arguments.moves ? run_command(arguments) : show_model(arguments);
}

}  // namespace linden
