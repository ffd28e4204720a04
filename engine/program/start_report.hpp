// engine/program/start_report.hpp
// What a command says of a start before its first step.
//
//   a scene that starts outside limits or in the ground   refused, all of it in one message; where it is taken as given, one warning
//   a scene without gravity, where nobody left it out     one note, where springs, servos or a ground suggest a load
//   a model alone whose zero its file's limits exclude    one note: no limits are in effect
#pragma once

#include "engine/options.hpp"
#include "engine/program/motion_arguments.hpp"

namespace linden {

/// Notes and warnings go to stderr. Throws InputError for a start that is refused.
void look_at_start(const MotionArguments& arguments, const Model& model, const Options& options);

}  // namespace linden
