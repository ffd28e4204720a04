// engine/program/start_report.hpp
// What a command says of a start before its first step.
//
//   a scene that starts outside limits or in the ground   refused, all of it in one message; where it is taken as given, one warning
//   instances of a rollout that random joints put in it   one warning with their number
//   a scene without gravity, where nobody left it out     one note, where springs, servos or a ground suggest a load
//   a model alone whose zero its file's limits exclude    one note: no limits are in effect
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "engine/distributed/ranks.hpp"
#include "engine/options.hpp"
#include "engine/program/motion_arguments.hpp"

namespace linden {

/// Notes and warnings go to stderr. Throws InputError for a start that is refused.
void look_at_start(const MotionArguments& arguments, const Model& model, const Options& options);

/// Of a rollout whose instances start at random about a scene's start: one warning where some of them start in the ground.
/// Called by all ranks; positions(i): [nq] of the i-th of the own instances, of so many of all ranks.
void look_at_instances(const MotionArguments& arguments, const Options& options, std::int64_t instances, Ranks& ranks, InstanceRange own,
                       const std::function<std::vector<double>(std::int64_t i)>& positions);

}  // namespace linden
