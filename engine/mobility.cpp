#include "engine/mobility.hpp"

#include <algorithm>

#include "engine/simulation.hpp"

namespace linden {

Mobility mobility_of(const Model& model, std::span<const double> positions) {
  Mobility found;
  found.freedom = model.degrees_of_freedom();
  if (model.couplings.empty()) return found;
  Simulation simulation(model);
  if (!positions.empty()) simulation.set_positions(positions);
  found.openness = simulation.openness();
  simulation.velocities();  // makes the factor that says which rows hold something
  found.couplings = simulation.couplings();
  for (const CouplingState& state : found.couplings) {
    found.rows += static_cast<Index>(state.gaps.size());
    found.held_already += static_cast<Index>(std::ranges::count(state.redundant, true));
  }
  found.giving_way = found.rows - rigid_row_count(model.couplings);
  found.freedom -= found.rows - found.giving_way - found.held_already;
  return found;
}

}  // namespace linden
