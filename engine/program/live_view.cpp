#include "engine/program/live_view.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "engine/program/animator.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/live_simulation.hpp"
#include "engine/program/run_start.hpp"
#include "engine/program/start_report.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "engine/view/live.hpp"

namespace linden {
namespace {

constexpr double kShownSeconds = 10;  // of the curves of a page

LiveOutlet outlet_to(LiveServer& server) {
  return {.frame = [&](std::string bytes) { server.send_frame(std::move(bytes)); },
          .status = [&](std::string text) { server.send_status(std::move(text)); },
          .answer = [&](std::uint64_t watcher, std::string text) { server.answer(watcher, std::move(text)); },
          .failure = [](const std::string& message) { tell("the simulation has failed: {}; reset begins again", message); }};
}

}  // namespace

int live_view(const ViewCommandArguments& given) {
  ViewCommandArguments arguments = given;
  check(arguments.options);
  auto listening = std::make_unique<LiveServer>(arguments.address);  // a port that is taken is told before a large model is read
  std::shared_ptr<const Model> model = arguments.loaded(Outputs(std::vector<Output>()));
  print_warnings(*model);
  randomize(arguments, model);
  look_at_start(arguments, *model, arguments.options);
  Simulation simulation(model, arguments.options, arguments.effects());
  begin_run(arguments, simulation);

  Animator animator(simulation, arguments.views, std::max<std::int64_t>(1, std::llround(kShownSeconds / arguments.options.step)), arguments.observe);
  animator.look();
  tell_drawing(animator.animation().drawing);
  const double fps = 1 / (static_cast<double>(animator.stride()) * arguments.options.step);
  LiveSimulation live(simulation, animator, std::min(arguments.views.fps, fps));
  const Interrupt interrupt;
  const LiveOutlet outlet = outlet_to(*listening);
  const std::unique_ptr<LiveServer> server = std::move(listening);  // goes before what it calls
  server->serve(live_page_of(animator.animation(), live.facts()), [&](const LiveEvent& event) { live.hear(event, outlet); });
  say("{:<11} {}\n", "model", model_text(arguments, *model));
  say("{:<11} {}   it begins when somebody looks; Ctrl-C ends it\n", "live", server->address());
  flush_standard_output();
  if (server->reachable()) tell("warning: whoever reaches {} can watch and steer this simulation; without --bind only this machine can", server->address());
  live.run(outlet, interrupt);
  return 0;
}

}  // namespace linden
