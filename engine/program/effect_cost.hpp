// engine/program/effect_cost.hpp
// What each effect of a scene costs on this machine: a step with that effect alone beside gravity, less a step with none.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/scene.hpp"

namespace linden {

struct EffectCost {
  std::string name;   // as a scene calls it; "none", "all" for steps without any and with all
  double nanoseconds; // per body and step
};

/// Takes the scene some hundred steps from its start for each: a second or two in all. Effects in the order of effect_lines.
std::vector<EffectCost> effect_costs(const Scene& scene);

}  // namespace linden
