// engine/guess/first_guess.hpp
// Where the solve of a step begins (options.hpp, FirstGuess).
#pragma once

#include "engine/sweeps/tree_sweeps.hpp"
#include "layout/state.hpp"

namespace linden {

/// Writes delta [rad, m] to the workspace of the sweeps, whose momentum_target must be that of the step. `history`: how many rows of
/// state.history are valid. Without any the guess is what momenta and forces alone would do.
template <bool kEffects>
void first_guess(FirstGuess guess, const Model& model, const State<double>& state, int history, double h, TreeSweeps<kEffects>& sweeps);

}  // namespace linden
