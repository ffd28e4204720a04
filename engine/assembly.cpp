#include "engine/assembly.hpp"

#include <fmt/format.h>

#include "engine/simulation.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {

Assembly assemble(const Model& model, std::vector<double>& positions, Assembled how, const std::vector<JointMotion>& motions) {
  Effects effects;
  effects.motions = motions;
  Simulation simulation(model, Options{}, effects);
  simulation.set_positions(positions);
  Assembly found = simulation.openness();
  if (!found.closed && how == Assembled::from_anywhere) found = simulation.assemble();
  positions.assign(simulation.positions().begin(), simulation.positions().end());
  return found;
}

void require_closed(const Assembly& start) {
  if (start.closed) return;
  throw InputError(fmt::format("coupling {} is open by {:.3g} at the start, {:.2g} of the size of its mechanism; expected a start where it is closed; give "
                               "positions that close it, or have it assembled (assemble: true in a scene)",
                               quoted(start.coupling), start.gap, start.relative));
}

}  // namespace linden
