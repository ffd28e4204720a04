// engine/mobility.hpp
// What couplings leave of a tree's freedom at a configuration: which of their rows hold something of their own, and which follow from others.
#pragma once

#include <span>
#include <vector>

#include "engine/assembly.hpp"
#include "engine/coupling_state.hpp"
#include "layout/model.hpp"

namespace linden {

struct Mobility {
  std::vector<CouplingState> couplings;  // without forces
  Assembly openness;
  Index rows = 0, held_already = 0, giving_way = 0;  // of all couplings; of these those that follow from others, and that give way
  Index freedom = 0;                 // degrees that are left
};

/// At positions [nq]; empty: the zero configuration.
Mobility mobility_of(const Model& model, std::span<const double> positions);

}  // namespace linden
