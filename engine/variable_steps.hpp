// engine/variable_steps.hpp
// What a Simulation keeps where its steps vary (engine/solve/step_choice.hpp), or where positions between nodes are asked for.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/simulation.hpp"
#include "engine/solve/step_choice.hpp"

namespace linden {

struct Simulation::Varying {
  Varying(const Model& model, const Options& options, const Effects& effects);

  /// Nothing is known of what was before.
  void begin();
  /// What a checkpoint keeps of it.
  struct Known {
    StepChoice::Law law;
    StepChoice::Lengths lengths;
    double clock = 0, last_step = 0, apart = 0;
    std::vector<double> twists;
  };

  StepChoice choice;
  std::vector<double> landings;     // times at which inputs jump or bend, ascending: steps end there [s]
  Field<double, 6> twists, before;  // of the step taken last, or of the node; of the one before
  Energy energy;                    // at the node, of orders above 2
  double apart = 0;                 // times that the last two mean twists are apart [s]
};

/// Where a step began.
struct Simulation::LastStep {
  std::int64_t steps = 0;
  double time = 0;
  std::vector<double> positions, velocities;
};

/// Times [s] at which tables of the effects have a point, ascending.
std::vector<double> knots_of(const Effects& effects);

}  // namespace linden
