// engine/sweeps/strategy.hpp
// How the sweeps of one tree are run: what follows from model, options and effects once and for all. The sweeps go by it, and so does whoever
// lists them (schedule.hpp).
#pragma once

#include <cstdint>

#include "engine/effects/effect_plan.hpp"
#include "engine/options.hpp"
#include "layout/model.hpp"

namespace linden {

/// In which order sweeps go over the bodies.
enum class Order : std::uint8_t {
  whole,       // each sweep over all of them, before the next
  branches,    // each branch down and up before the next branch (down_and_up.hpp)
  long_chain,  // as a whole, with momenta formed on the way up, where a factor reads inertias and displacements too
};

/// With which factor an evaluation's residual is to be solved.
enum class Factor : std::uint8_t { fresh, kept };

struct Strategy {
  bool gravity = false;        // else nothing is computed for it
  bool one_pass = false;       // one upward sweep finds residual, norm and first half of a solve; else one after the other
  bool reuses_factor = false;  // from step to step (engine/solve/held_factor.hpp)
  bool shares_rows = false;    // what is made and used up within the way over a branch lies in rows that all branches share, see Slots
  Order order = Order::whole;

  /// Whether momenta at the end of the step are found with the residual, while the bodies are in the cache.
  bool finds_end_momenta() const { return shares_rows || order == Order::long_chain; }
};

Strategy strategy_of(const Model& model, const Options& options, const EffectPlan& plan);

}  // namespace linden
