// engine/sweeps/sweeps.hpp
// The sweeps of one step in the order in which Stepper runs them, for people: what each reads and writes is what the header of its
// kernel says. Names of arrays are those of State, BodyConstants and Workspace.
#pragma once

#include <string_view>
#include <vector>

#include "engine/options.hpp"
#include "layout/model.hpp"

namespace linden {

struct EffectPlan;

struct Sweep {
  std::string_view when;
  std::string_view name, reads, writes;
};

/// Those of this model and these options: what a scene does not have is not in the list.
std::vector<Sweep> sweeps_of(const Model& model, const Options& options, const EffectPlan& plan);

}  // namespace linden
