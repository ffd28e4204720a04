// engine/program/rollout_command.hpp
// `linden rollout`: many instances of one model, each from a random start of its own.
//
//   start     instance i starts from random_state(seed + i, spread), and is randomised by the same seed (engine/randomization.hpp)
//   ranks     under mpirun each has a share of the instances (engine/distributed/README.md)
//   steps     all instances, in stretches of some tenths of a second between which progress is shown and an interrupt heard
//   fails     an instance whose step fails is frozen at its last good state; the others go on, and the exit code is 1
//   writes    files appear whole or not at all. A rollout that is interrupted leaves them valid up to its last step; where the recording
//             finds no room it ends with the frames that did
//   survives  with --checkpoint, whatever becomes of the process (engine/program/rollout_checkpoint.hpp)
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/distributed/ranks.hpp"
#include "engine/program/motion_arguments.hpp"
#include "engine/program/quantities.hpp"
#include "engine/program/views.hpp"

namespace linden {

struct RolloutArguments : MotionArguments {
  Options options;
  BatchOptions computed;  // with which threads and instructions
  bool instructions_shared = false;  // they are not the best that every rank has
  std::int64_t instances = 1024;
  bool single = false;      // float instead of double
  std::int64_t every = 1;   // steps between recorded frames
  std::string record, json;  // files; empty = none
  std::vector<Quantity> what;  // to record; empty: what is usual
  std::vector<std::string> observe;  // names of observations beside it
  ViewArguments views;
  std::int64_t shown = 16;  // instances in them, from the first on
  std::string checkpoint, resume;  // folders (engine/program/rollout_checkpoint.hpp), one where there are both; empty = none
  bool compress = false;  // the recording
  double checkpoint_every = 600;   // seconds by the clock
  std::int64_t checkpoints_kept = 2;
  std::string command_to_resume;  // as it is given to a shell
};

/// Returns the exit code: 0, 1 where an instance was frozen or a file could not be written, 128 + signal after one. Throws InputError
/// for bad input. Called by all ranks, which return and throw alike (engine/distributed/ranks.hpp).
int rollout_command(Ranks& ranks, RolloutArguments arguments);

}  // namespace linden
