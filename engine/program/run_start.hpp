// engine/program/run_start.hpp
// From what a command is told to the state that its first step begins in.
#pragma once

#include <memory>

#include "engine/program/randomize.hpp"
#include "engine/program/run_command.hpp"
#include "engine/simulation.hpp"

namespace linden {

/// Makes model and scene those of the one instance that there is; what was drawn for it.
DrawnNumbers randomize(RunArguments& arguments, std::shared_ptr<const Model>& model);

/// Puts the simulation where the run is to begin: a checkpoint, the scene's start, or one drawn at random.
void begin_run(const RunArguments& arguments, Simulation& simulation);

}  // namespace linden
