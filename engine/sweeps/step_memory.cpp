#include "engine/sweeps/step_memory.hpp"

#include <algorithm>

#include "engine/effects/effect_sweeps.hpp"

namespace linden {

StepMemory::StepMemory(const Model& its_model, const Options& its_options, const EffectPlan& its_plan)
    : model(its_model),
      options(its_options),
      plan(its_plan),
      strategy(strategy_of(its_model, its_options, its_plan)),
      constants(its_model.constants),
      ties(its_model.mimics, its_model.tree),
      couplings(its_model, its_plan.row_yields, strategy.reuses_factor ? Serves::steps_that_follow : Serves::till_the_next) {
  const Shape& shape = model.tree.shape;
  state.allocate(shape);
  work.allocate(shape);
  before.allocate(shape.velocities);
  if (strategy.reuses_factor) mass.allocate(shape);
  if (plan.any()) effects = std::make_unique<EffectSweeps<double>>(plan, model);
}

StepMemory::~StepMemory() = default;

void StepMemory::begin(double at) {
  time = at;
  is_first = true;
  if (effects) effects->set_out(options.step, state.q);
}

void StepMemory::begin_evaluation(Factor how) {
  now = {};
  factor = how;
  finds_end_momenta = how == Factor::kept && strategy.finds_end_momenta();
}

void StepMemory::end() {
  history = std::min(history + 1, kHistory);
  state.last_step(0) = options.step;
}

}  // namespace linden
