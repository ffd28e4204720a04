// engine/coupling_state.hpp
// What a coupling does: how far open it is, and what holds it.
#pragma once

#include <string>
#include <vector>

namespace linden {

/// Of a coupling, row by row in the order of layout/couplings.hpp.
struct CouplingState {
  std::string name;
  std::vector<double> gaps;     // where the bodies are now [m, or cosine of an angle; of a bushing rad; of a gear as its coordinates]
  std::vector<double> forces;   // that hold it, over the step taken last [N, N m]: of a shift along its axis of A, on body b; body a feels the other
  std::vector<bool> redundant;  // other rows hold it already: its force is zero
};

}  // namespace linden
