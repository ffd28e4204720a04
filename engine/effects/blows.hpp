// engine/effects/blows.hpp
// Blows of joints on their limits: at a state, and when within a step.
//
//   v_n <- -e v_n,    p <- p + lambda e_n,    lambda = -(1 + e) v_n / (M^-1)_nn          Newton's law of impact
//
// What a blow makes faster than its limit of velocity is stopped at that: v_n <- that limit. v is the velocity that motion and momenta
// agree on (engine/VELOCITY.md). Several joints at once are struck one after the other, the fastest first, until none
// moves into its limit: each blow keeps or loses energy, so all do. Without restitution, or below kLeastBounce, e is 0.
//
// A step in which a joint with restitution meets its limit is cut there: its length is found by false position (Illinois) on how far the
// solution passes the limit. Both parts are steps like any other, so the energy of a bounce is off by no more than second order, and
// neither by half a step of gravity nor by how far the joint still had to go.
//
// source  Fetecau, Marsden, Ortiz, West, Nonsmooth Lagrangian mechanics and variational collision integrators (2003); Moreau, Unilateral
//         contact and dry friction in finite freedom dynamics (1988)
#pragma once

#include "engine/sweeps/tree_sweeps.hpp"
#include "layout/state.hpp"

namespace linden {

/// Blows within one step; from then on joints stop at their limits: what bounces ever lower comes to rest.
inline constexpr int kMostBlows = 32;

class Blows {
 public:
  Blows(TreeSweeps<true>& sweeps, Index velocities);

  /// Whether the step solved last led a joint to a limit, or one that bounces is at it, or whether one starts there or
  /// may start too fast.
  bool met(const State<double>& state) const;
  /// Strikes the joints that stand at a limit and move into it; arrived: also those that the step solved last stopped there. Of a state
  /// whose placements are there. Returns what the blows took [J] and counts them.
  double strike(State<double>& state, bool arrived, int& blows);
  /// The velocity after the blows.
  const Field<double>& velocity() const { return velocity_; }

  /// How far the solution takes a joint that bounces beyond its limit, the farthest of all; below zero: how near it comes [rad, m].
  double passed(const State<double>& state) const;

 private:
  TreeSweeps<true>& sweeps_;
  Field<double> velocity_, unit_, response_;
};

/// Where a scene has no effects.
struct NoBlows {
  NoBlows(TreeSweeps<false>&, Index) {}
};

}  // namespace linden
