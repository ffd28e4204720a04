// engine/step_pilot.hpp
// Whether variable steps have anything to win on a motion, found by steps that are thrown away.
//
//   2,000 variable steps from the start, or as many as the duration has; the state is then as it was
//   mean step over the step that one in a hundred is shorter than: 3.3 of a ten-link chain, 10 of a hundred links, where variable steps win; 1.9
//   of two links, 1.6 of a tumbling humanoid, where fixed ones do
//   neighbours that differ by more than e^0.3: none, but of springs, whose motion goes to and fro within few steps
//
// Fixed steps where the first is below 2, or more than a tenth of the second: they cost less then, and of springs alone keep the energy.
// Their length is found by runs over the same stretch: the largest, of a few, that keeps a fifth of the accuracy there and is no longer than two mean
// variable steps, a whole number of which the duration is.
#pragma once

#include <string>

#include "engine/simulation.hpp"

namespace linden {

struct StepPilot {
  bool vary = true;
  double step = 0;      // of fixed steps [s]
  std::string why{};    // "mean step 2.5 times the shortest", for people
};

/// simulation: one whose steps vary, at its start; it is left as it was.
StepPilot pilot(Simulation& simulation, double duration);

}  // namespace linden
