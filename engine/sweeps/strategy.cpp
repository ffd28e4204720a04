#include "engine/sweeps/strategy.hpp"

#include <array>

namespace linden {
namespace {

/// Whether branches are to share rows. Motions of screws follow from delta and placements from q; motions of other joints are corrected
/// from one evaluation to the next and need rows of their own.
bool shares_rows(const Tree& tree) {
  return !tree.branches.empty() && tree.trunk.end + kBranch <= tree.shape.slots / 2 && tree.runs.size() == 1 &&
         tree.runs.front().kind == JointKind::screw;
}

/// Whether this is one long chain: all trunk but for its end.
bool is_long_chain(const Tree& tree) {
  if (tree.branches.empty()) return false;
  for (Index i = 1; i < tree.shape.slots; ++i) {
    if (tree.parent(i) != i - 1) return false;
  }
  return true;
}

}  // namespace

Strategy strategy_of(const Model& model, const Options& options, const EffectPlan& plan) {
  Strategy strategy;
  strategy.gravity = options.gravity != std::array<double, 3>{0, 0, 0};
  strategy.one_pass = options.solver == Solver::newton && options.stop == StopTest::energy && model.mimics.empty() && model.couplings.empty() && !plan.pairs;
  strategy.reuses_factor = options.solver == Solver::newton && options.stop == StopTest::energy && model.mimics.empty() && options.order == 2 &&
                           options.guess == FirstGuess::extrapolation && !plan.settles();
  if (plan.any() || !strategy.one_pass) return strategy;
  strategy.order = Order::branches;
  if (options.order != 2) return strategy;
  if (is_long_chain(model.tree)) strategy.order = Order::long_chain;
  strategy.shares_rows = shares_rows(model.tree);
  return strategy;
}

}  // namespace linden
