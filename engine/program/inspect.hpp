// engine/program/inspect.hpp
// `linden inspect`: what a model or scene is once it is loaded, and what a step of it computes.
//
//   effects      of a scene, a line each, and what each costs a step on this machine
//   bodies       slot, body, parent, joint and its axis, rows in q and v, mass, limits; which are massless, which joints are tied; links merged into them; mimic joints
//   conventions  which row is which, order of quaternions and twists, frames
//   totals       counts, mass, and what of it is fixed to the world, centre of mass, levels, runs, memory
//   sweeps       of one step in order, with what each reads and writes
#pragma once

#include <string>

#include "engine/program/motion_arguments.hpp"

namespace linden {

struct InspectArguments : ModelArguments {
  Options options;    // gravity and solver decide which sweeps there are
  bool all = false;   // print long tables whole
  std::string json;   // file; empty = none
};

/// Returns the exit code. Throws InputError for bad input.
int inspect(const InspectArguments& arguments);

}  // namespace linden
