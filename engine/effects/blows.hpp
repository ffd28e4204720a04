// engine/effects/blows.hpp
// Blows of joints on their limits: at a state, and when within a step.
//
//   v <- v + M^-1 lambda,   p <- p + lambda,   lambda_n <= 0 at an upper limit, and not zero only where v_n <- -e v_n
//                                              lambda_n >= 0 at a lower one, likewise
//                                              Newton's law of impact for all that stand at their limits, at the same time
//
// v is the velocity that motion and momenta agree on (engine/VELOCITY.md). What rests on a limit stays there as long as the limit has to push,
// whatever the others are struck by. No joint comes out of a blow faster than its limit of velocity: what would is stopped at that.
// Without restitution, or below kLeastBounce, e is 0.
//
// Whatever e is, no blow gives energy: lambda_n works along the mean of the velocities before and after it. That holds of joints that do not
// leave their limits already, so these are not asked as long as others bounce; what drives them back makes another blow. Once nothing bounces
// one last blow stops all that is left: of the velocities that no limit forbids it takes the nearest, by kinetic energy.
//
// Which limits push is found as within a step (kernels/effects/limits.hpp): for given ones v is one solve with the mass matrix, in which
// their joints are held.
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
  /// Strikes the joints that stand at a limit and move into it; arrived: after a step, some by which have been stopped there (Stopped::struck). Of
  /// a state whose placements are there. Returns what the blows took [J] and counts
  /// the impulses. What holds a given motion against them is booked with the step that follows, since p of its row stays as it is.
  double strike(State<double>& state, bool arrived, int& blows);
  /// The velocity after the blows.
  const Field<double>& velocity() const { return velocity_; }

  /// How far the solution takes a joint that bounces beyond its limit, the farthest of all; below zero: how near it comes [rad, m].
  double passed(const State<double>& state) const;

 private:
  enum class Held : unsigned char { no, low, high };
  /// What a blow leaves of the velocity of a limited joint, and the end of it at which it is held.
  struct Bound {
    double low, high;
    Held held;
    double velocity() const { return held == Held::low ? low : high; }
  };

  std::span<const JointLimit> limits() const { return sweeps_.effects().limits().entries; }
  /// Whether a joint at this position is at its limits.
  bool at_upper(const State<double>& state, const JointLimit& limit) const;
  bool at_lower(const State<double>& state, const JointLimit& limit) const;
  /// Bounds of a blow at velocity_. Returns whether one is needed.
  bool find_bounds(const State<double>& state, bool may_bounce, bool may_be_fast);
  Bound bound(const State<double>& state, const JointLimit& limit, bool bounces) const;
  /// change_ and impulse_ of the blow within the bounds.
  void solve();
  void respond();
  bool update_states(bool one_by_one);

  TreeSweeps<true>& sweeps_;
  std::vector<Bound> bounds_;  // of each limit
  Field<double> velocity_, change_, impulse_;
};

/// Where a scene has no effects.
struct NoBlows {
  NoBlows(TreeSweeps<false>&, Index) {}
};

}  // namespace linden
