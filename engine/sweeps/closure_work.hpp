// What it takes to make a factor where loops close: operations, each an addition or a multiplication, as closure_factors.hpp makes them of one
// tree. Where a loop is cut decides that: a ladder of 3,000 cells whose right rail hangs on the left one cell by cell takes 2e7, one whose
// rails are two branches, all of whose loops close at the world, 2e12.
//
// What joints that are tied to each other take beside it, and where bodies are placed, is not counted.
#pragma once

#include <vector>

#include "layout/model.hpp"

namespace linden {

/// Operations of a tree's own factor, a body (bench/README.md).
inline constexpr double kTreeFactorOperations = 868;

/// Of couplings that close together.
struct ClosureWork {
  Index slot;                      // of the body where they do, 0: the world
  std::vector<Index> couplings;    // by their numbers
  Index rows;                      // that are solved for together
  Index velocities;                // on all their paths
  double operations;               // of a factor
};

/// Of all closures of the model, the dearest first.
std::vector<ClosureWork> closure_work(const Model& model);

}  // namespace linden
