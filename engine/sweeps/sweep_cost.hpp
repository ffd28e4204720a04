// engine/sweeps/sweep_cost.hpp
// What each sweep of a step costs on this machine.
//
// Every sweep is called alone, over the whole tree, on what a step of the motion leaves in memory. A step calls several of them over a
// part of a large tree before the next part, so that there the sum is more than a step takes. Of a map whose work is a few
// multiplications a degree of freedom little more than the call is seen.
#pragma once

#include <vector>

#include "engine/initial_state.hpp"
#include "engine/sweeps/schedule.hpp"

namespace linden {
/// [ns per body] for each of `sweeps`, which are those of this model, these options and this plan. `start` where the motion begins; empty:
/// at rest in the zero configuration. Takes about a tenth of a second.
std::vector<double> sweep_costs(const Model& model, const Options& options, const EffectPlan& plan, const InitialState& start,
                                const std::vector<Sweep>& sweeps);

}  // namespace linden
