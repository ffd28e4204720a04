// engine/program/run_command.hpp
// `linden run`: simulates one model or scene and writes what it was asked to.
//
//   checks    options, outputs, model: all that can be wrong is found before the first step
//   steps     energy is sampled after every step when recording and in runs of up to 20,000 steps, else about 20,000 times; the time
//             that sampling and writing take is not counted as time of steps
//   records   a row each step, or each of so many, and the last state; FILE.npz and FILE.h5 are rollouts of one instance (rollout_file.hpp)
//   writes    files appear whole or not at all. A run that fails or is interrupted leaves them valid up to its last good step; where the
//             recording finds no room the run ends with the rows that did
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/program/motion_arguments.hpp"
#include "engine/program/quantities.hpp"
#include "engine/program/views.hpp"

namespace linden {

struct RunArguments : MotionArguments {
  Options options;
  std::string record, json, plot, save, load;  // files; empty = none
  std::vector<Quantity> what;                  // to record and to plot; empty: what is usual
  std::vector<std::string> observe;            // names of observations beside it
  std::int64_t every = 1;                      // steps between recorded rows
  ViewArguments views;
};

/// Returns the exit code: 0, 1 where a step failed or a file could not be written, 128 + signal after one. Throws InputError for bad input.
int run_command(const RunArguments& arguments);

}  // namespace linden
