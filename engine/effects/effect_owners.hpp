// engine/effects/effect_owners.hpp
// What the effects of a simulation act on, by name: what a checkpoint says of them, so that it is not continued under others.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "layout/names.hpp"


namespace linden {

struct EffectPlan;

/// A line a kind that there is: its name, then joints or bodies in the order of its list, each after a null character.
std::string effect_owners(const EffectPlan& plan, const Names& names);

/// The first difference between two such texts: "limits on joint1", "limits on joint2"; "no limits", "limits on joint2". None where only the
/// kinds come in another order.
struct OwnersDifference {
  std::string saved, here;
};
std::optional<OwnersDifference> first_difference(std::string_view saved, std::string_view here);

}  // namespace linden
