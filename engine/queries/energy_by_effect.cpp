#include "engine/queries/energy_by_effect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace linden {

std::vector<EnergyShare> energy_by_effect(Simulation& simulation) {
  const Effects& effects = simulation.effects();
  const Energy energy = simulation.energy();
  std::vector<EnergyShare> shares{{"kinetic", energy.kinetic}};
  if (simulation.options().gravity != std::array<double, 3>{0, 0, 0}) shares.push_back({"gravity", energy.gravity()});
  const std::vector<Coupling>& couplings = simulation.model().couplings;
  bool springs = std::ranges::any_of(couplings, gives_way);
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    springs = springs || (Entry::facts.stores && Entry::facts.site == Site::joint && !entries.empty());
  });
  if (springs) shares.push_back({"springs", energy.springs});
  if (effects.ground) shares.push_back({"ground", energy.ground});
  if (effects.contact) shares.push_back({"contact", energy.contact});
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    if (Entry::facts.account == Account::none || entries.empty()) return;
    const std::string_view sense = Entry::facts.account == Account::taken ? "taken" : "given";
    shares.push_back({fmt::format("{}_{}", Entry::facts.name, sense), simulation.effect_work().of<Entry>()});
  });
  if (std::ranges::any_of(couplings, gives_way)) shares.push_back({"couplings_taken", simulation.effect_work().couplings});
  return shares;
}

}  // namespace linden
