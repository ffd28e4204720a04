// engine/effects/stiff_contact.hpp
// Whether a step resolves how stiff the ground is under each body.
#pragma once

#include <optional>
#include <string>

#include "engine/options.hpp"

namespace linden {

struct Effects;
struct Model;

/// A body that bounces less than its ground is elastic, as the step does not resolve the ground's stiffness under it.
struct StiffContact {
  std::string link;
  double mass;  // that the stiffness was compared with [kg]
};

/// The lightest such body, where the ground's damping does not take as much anyway.
std::optional<StiffContact> stiffest_unresolved(const Model& model, const Options& options, const Effects& effects);

}  // namespace linden
