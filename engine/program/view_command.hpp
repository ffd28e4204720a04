// engine/program/view_command.hpp
// `linden view`: shows what there is of it.
//
//   MODEL      one frame, in its zero configuration or where --seed puts it; with --duration its motion
//   SCENE      its motion, as `linden run` simulates it
//   recording  the positions that --record wrote, with every array of numbers beside them as curves
//   --live     MODEL or SCENE as it runs (engine/program/live_view.hpp)
#pragma once

#include <string>

#include "engine/program/live_server.hpp"
#include "engine/program/run_command.hpp"

namespace linden {

struct ViewCommandArguments : RunArguments {
  std::string recording;    // what --record wrote of the model; empty: none
  std::int64_t shown = 16;  // instances of it, from the first on
  bool moves = false;       // is simulated; else one frame is shown
  LiveAddress address;      // of a simulation that is shown while it runs
};

/// What is written where nothing was asked for: models/humanoid.urdf -> humanoid.html, chain:10 -> chain-10.html.
std::string usual_view(const std::string& model);

/// Returns the exit code, as run_command does. Throws InputError for bad input.
int view_command(const ViewCommandArguments& arguments);

}  // namespace linden
