// engine/effects/no_effects.hpp
// In the place of EffectSweeps where a scene has no effects: no memory, and nothing is added to any factor.
#pragma once

#include <type_traits>

#include "engine/effects/effect_sweeps.hpp"

namespace linden {

struct NoEffects {
  NoEffects(const EffectPlan&, const Model&) {}
  template <class Action>
  void with_added(const Action& action) const {
    action(NothingAdded{});
  }
  template <class Action>
  void with_rotors(const Action& action) const {
    action(NothingAdded{});
  }
};

template <bool kEffects, class S>
using EffectsIf = std::conditional_t<kEffects, EffectSweeps<S>, NoEffects>;

}  // namespace linden
