#include "engine/solve/stepper.hpp"

#include "engine/solve/tree_stepper.hpp"

namespace linden {

Stepper::~Stepper() = default;

std::unique_ptr<Stepper> make_stepper(const Model& model, const Options& options, const EffectPlan& plan) {
  return with_or_without(plan, [&](auto effects) { return make_tree_stepper<effects>(model, options, plan); });
}

}  // namespace linden
