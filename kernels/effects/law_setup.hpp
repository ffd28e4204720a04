// kernels/effects/law_setup.hpp
// What laws are built from: the effects of a scene and what does not change of its bodies. Plain views, of what outlives the laws.
#pragma once

#include <span>

#include "kernels/effects/ground_plan.hpp"
#include "layout/effects.hpp"
#include "layout/smooth_curve.hpp"
#include "layout/tree.hpp"

namespace linden {

struct LawSetup {
  const Effects& effects;            // of bodies sorted by their slots
  const Tree& tree;
  const Field<Index>& q_row;         // position row of a screw's velocity row; no rows where nothing acts on joints
  std::span<const double> inertia;   // that a force on each joint's row moves, all others free; empty where no law asks
  std::span<const double> zone_yields;  // how far the row of each spring with a dead zone moves by an impulse of one (engine/sweeps/coupling_yields.hpp)
  std::span<const double> mass;      // that a force on each body is taken to move
  std::span<const SmoothCurve> curves;  // of every given motion
  const GroundPlan& ground;
  double step;                       // [s]

  double inertia_at(Index row) const { return inertia[static_cast<std::size_t>(row)]; }
  double mass_of(Index slot) const { return mass[static_cast<std::size_t>(slot)]; }
};

}  // namespace linden
