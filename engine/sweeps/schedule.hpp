// engine/sweeps/schedule.hpp
// The sweeps of a step of one tree, in the order in which a plain step runs them: what each is called, reads and writes, and how it is
// called. `linden inspect` prints this list, sweep_cost.hpp and bench/kernels time its calls, and tests/engine/schedule_test.cpp steps by
// it and by nothing else: positions and momenta are those of Simulation to the bit, and a sweep reads and writes no array but those it names.
//
//   arrival      placements and forces at new positions; also once where a motion starts
//   first        target of the residual, first guess, states of effects as the guess has them
//   start        among these, where no step before is known
//   evaluation   the residual at delta, and the first half of a solve with the factor there is
//   factor       among these, where that of an earlier step or evaluation does not serve
//   states       do the states of effects belong to this delta?
//   changed      where one does not; another evaluation follows, with a factor of its own
//   correction   second half of the solve, and delta with it; another evaluation follows
//   last         the end of the step: positions, momenta, what is kept for the next step
//
// A plain step is one that is not split, whose states settle before they are updated one by one, that strikes no limit and that no force
// acts on from outside. What changes no array is not in the list: energies that are booked, tests of what is solved. A correction that is
// cut is correct_motion_map once more, with a negative share.
//
// Names of arrays are those of State, BodyConstants and Workspace. `gains` are gain_up, gain_down and joint_inverse, `mass gains` those of
// the mass matrix, which are the same arrays unless a factor outlasts a step. `joint impulses`, `body impulses` and `pose` are what effects
// add up (kernels/effects/), `before` is the displacement of the step before, as long as this one; other names mean what a law keeps of its
// own, or what MimicTies does.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/options.hpp"
#include "layout/model.hpp"

namespace linden {

struct EffectPlan;
struct StepMemory;  // step_memory.hpp

enum class When : std::uint8_t { arrival, first, start, evaluation, factor, states, changed, correction, last };
std::string_view name(When when);

/// Which bodies a sweep goes over when it is called: all of them, or those that it is given, so that a large tree is gone through part by part,
/// as Strategy::order says (strategy.hpp) - to the leaves, or back. parents_up: back, where it is the parents' turn that others are to add to.
enum class Way : std::uint8_t { whole, down, up, parents_up };

struct Sweep {
  When when;
  std::string name, reads, writes;
  std::function<void(StepMemory&, Slots)> run;
  Way way = Way::whole;
  bool sums = false;  // impulses over the tree, where they are: called twice it sums sums
};

/// Those of this model and these options: what a scene does not have is not in the list.
std::vector<Sweep> schedule_of(const Model& model, const Options& options, const EffectPlan& plan);

/// Runs those of some phases, in order, each over all bodies.
void run(std::span<const Sweep> sweeps, std::initializer_list<When> phases, StepMemory& memory);

}  // namespace linden
