#include "check.hpp"

#include <fmt/format.h>

#include "families.hpp"

namespace linden {

std::string_view name(Check check) {
  switch (check) {
    case Check::refused: return "refused";
    case Check::position: return "position";
    case Check::energy: return "energy";
    case Check::rest: return "rest";
    case Check::velocity: return "velocity";
    case Check::bits: return "bits";
    case Check::observations: return "observations";
    case Check::contact: return "contact";
    case Check::blow: return "blow";
  }
  return "";
}

std::vector<Difference> differences(const EverydayScene& scene, std::optional<Check> only) {
  Differences found(only);
  if (found.asked(Check::refused) || found.asked(Check::energy) || found.asked(Check::rest) || found.asked(Check::velocity)) {
    const Walk walked = walk(scene, scene.steps);
    check_refused(scene, walked, found);
    if (found.asked(Check::energy)) check_energy(scene, walked, found);
    if (found.asked(Check::rest) || found.asked(Check::velocity)) check_velocities(scene, walked, found);
    check_batch_velocities(scene, walked, found);
  }
  if (found.asked(Check::position)) check_position(scene, found);
  if (found.asked(Check::bits)) check_bits(scene, found);
  if (found.asked(Check::observations)) check_observations(scene, found);
  if (found.asked(Check::contact) && scene.effects.contact) check_contact(scene, found);
  if (found.asked(Check::blow)) check_blow(scene, found);
  return found.list;
}

}  // namespace linden
