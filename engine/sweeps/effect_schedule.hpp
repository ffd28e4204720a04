// engine/sweeps/effect_schedule.hpp
// What the effects of a scene have in the schedule of a step (schedule.hpp): the parts of the laws that have anything to do, as their facts
// state them, and the sweeps over what they add up.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "engine/effects/effect_plan.hpp"
#include "engine/sweeps/schedule.hpp"
#include "engine/sweeps/strategy.hpp"

namespace linden {

/// A schedule while it is written.
struct ScheduleDraft {
  const Model& model;
  const Options& options;
  const EffectPlan& plan;
  const Strategy strategy;
  std::vector<Sweep> sweeps = {};

  Sweep& add(When when, std::string_view name, std::string_view reads, std::string_view writes,
             std::function<void(StepMemory&, Slots)> run) {
    return sweeps.emplace_back(Sweep{when, std::string(name), std::string(reads), std::string(writes), std::move(run)});
  }
  /// As the joints' residual is called where it lies.
  std::string_view joint_residual() const { return strategy.one_pass ? "innovation" : "residual"; }
};

// each in its place in the list; nothing where there is nothing of the kind

/// Placements of bodies in the world, and what is near them.
void add_arrival_of_effects(ScheduleDraft& draft);
/// States and rows as a step begins, once its first guess is there.
void add_beginning_of_effects(ScheduleDraft& draft);
/// Forces on bodies and impulses of joints, once the displacements are known.
void add_action_of_effects(ScheduleDraft& draft);
void add_states_of_effects(ScheduleDraft& draft);
/// Impulses of the end, before the state is advanced.
void add_end_of_effects(ScheduleDraft& draft);
/// After it: what p gets of them.
void add_impulses_of_effects(ScheduleDraft& draft);
/// And what velocities are read from beside p.
void add_reading_of_effects(ScheduleDraft& draft);

}  // namespace linden
