// engine/program/option_texts.hpp
// Options as they were written, and what they come to: numbers, names and ranges, and what goes over a scene. Each function throws InputError
// that begins with the option.
#pragma once

#include <string>

#include "engine/program/accuracy_command.hpp"
#include "engine/program/inspect.hpp"
#include "engine/program/rollout_command.hpp"
#include "engine/program/run_command.hpp"
#include "engine/program/scaling_command.hpp"
#include "engine/program/view_command.hpp"

namespace linden {

/// Options as they were written. Absent ones are empty, so that Options keeps its defaults.
struct OptionTexts {
  std::string base, duration, dt, gravity, solver, guess, stop, tolerance, order, seed, spread, instances, threads, instructions, every,
      what, observe, shape, dofs, steps, budget, start, density, randomize, shown, recorded, port, bind, checkpoint_every, keep,
      accuracy;
  ViewTexts views;
};

void read_run_options(const OptionTexts& texts, RunArguments& run);
void read_rollout_options(const OptionTexts& texts, RolloutArguments& rollout);
void read_scaling_options(const OptionTexts& texts, ScalingArguments& scaling);
void read_accuracy_options(const OptionTexts& texts, AccuracyArguments& accuracy);
void read_view_command_options(const OptionTexts& texts, ViewCommandArguments& view);
void read_inspect_options(const OptionTexts& texts, InspectArguments& inspect);

}  // namespace linden
