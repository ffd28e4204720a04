// engine/program/effects_text.hpp
// A scene's effects for people and for scripts: what there is of each, and on how much.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct EffectLine {
  std::string name;   // as a scene calls it
  std::string where;  // "23 joints", "1 body", "plane"
  std::string what;   // "0.1 to 2 N m s/rad"
};

/// One line an effect that is there, gravity not among them, and one of all couplings that give way.
std::vector<EffectLine> effect_lines(const Effects& effects, const Model& model);

/// Every entry of every effect that is there, by the names of joints and bodies; infinities are null.
nlohmann::ordered_json effects_json(const Effects& effects, const Model& model);

}  // namespace linden
