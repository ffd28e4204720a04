#include "engine/guess/first_guess.hpp"

#include "engine/guess/extrapolation.hpp"
#include "engine/sweeps/tree_kernels.hpp"

namespace linden {

template <bool kEffects>
void first_guess(FirstGuess guess, const Model& model, const State<double>& state, int history, double h, TreeSweeps<kEffects>& sweeps) {
  Workspace<double>& work = sweeps.work();
  Field<double>& delta = work.delta;
  const Index n = model.tree.shape.velocities;
  const auto zero = [&] {
    for (Index row = 0; row < n; ++row) delta(row) = 0;
  };
  switch (guess) {
    case FirstGuess::ig1: return zero();
    case FirstGuess::ig2:
      if (history == 0) break;
      for (Index row = 0; row < n; ++row) delta(row) = state.history(row, 0);
      return;
    case FirstGuess::ig3: {
      // qdd = M^-1 (-C + Q), semi-implicit Euler: delta = h (v + h qdd)
      sweeps.velocity_of(state.p, delta);
      velocity_down(model.tree, sweeps.constants(), work.placement, delta, work.twist);
      coriolis_down(model.tree, sweeps.constants(), work.placement, delta, work.twist, work.bias, work.impulse);
      impulse_up(model.tree, sweeps.constants(), work.placement, work.impulse, work.residual);
      for (Index row = 0; row < n; ++row) work.residual(row) = work.force(row) - work.residual(row);
      sweeps.apply_mass_inverse(work.residual, work.residual);
      for (Index row = 0; row < n; ++row) delta(row) = h * (delta(row) + h * work.residual(row));
      return;
    }
    case FirstGuess::extrapolation:
      if (history == 0) break;
      return extrapolate(extrapolation(state.history, history), state.history, {0, n}, delta);
  }
  // No displacement is known yet: h M^-1 (p + h/2 Q).
  sweeps.velocity_of(work.momentum_target, delta);
}

template void first_guess(FirstGuess, const Model&, const State<double>&, int, double, TreeSweeps<LINDEN_ACTING>&);

}  // namespace linden
