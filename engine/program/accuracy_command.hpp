// engine/program/accuracy_command.hpp
// `linden accuracy`: what accuracy costs on a person's own scene, and which method and step to take (engine/program/accuracy.hpp).
#pragma once

#include <string>

#include "engine/program/motion_arguments.hpp"

namespace linden {

struct AccuracyArguments : MotionArguments {
  Options options;         // step: in the middle of those that are tried
  double budget = 60;      // [s]
  std::string json, plot;  // files; empty = none
};

/// Returns the exit code: 0, 1 where no reference was found, every run failed or a file could not be written, 130 after Ctrl-C.
/// Throws InputError for bad input.
int accuracy_command(const AccuracyArguments& arguments);

}  // namespace linden
