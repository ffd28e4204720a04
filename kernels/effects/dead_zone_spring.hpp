// kernels/effects/dead_zone_spring.hpp
// Springs with a dead zone: gears with backlash, couplings and hinges with play.
//
//   P = 1/2 k max(|x| - w, 0)^2,   x = q - rest,    taken at the middle of the step: x = q^k + delta / 2 - rest
//
//   beyond the zone (mode = sign of x)   o = h^2 k (q^k - rest - mode w),  g = h^2 k / 2,  share 1/2
//   within it       (mode = 0)           o = g = 0
//
// As of a spring (spring.hpp), h P at the middle is part of the discrete Lagrangian, so the step stays symplectic and symmetric: energy swings
// by some k (h v)^2 / 8 where a step crosses an edge of the zone at a speed v, and does not drift. The force is continuous and piecewise linear;
// which piece holds is settled within the solve, and as P is convex there is just one solution.
//
// A mass m that flies to and fro between the two springs with a speed v in the zone has the period 2 pi sqrt(m / k) + 4 w / v.
//
// units   k [N m/rad, N/m], w and rest [rad, m]
// energy  P, conservative
// cost    some 5 operations an entry and evaluation
// source  Marsden, West, Discrete mechanics and variational integrators (2001), 2.3.1 (midpoint rule); Nordin, Gutman, Controlling mechanical
//         systems with backlash - a survey (2002), 2.1 (the dead-zone model)
#pragma once

#include <algorithm>
#include <cmath>

#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
class DeadZoneSpringLaw : public JointLaw<S, DeadZoneSpring> {
 public:
  static constexpr std::array sweeps{
      PartSweep{Part::begin, "begin_dead_zones", "dead zones, q, delta", "dead zones"},
      PartSweep{Part::add, "dead_zone_map", "dead zones, q, joint impulses", "joint impulses"},
      PartSweep{Part::update_states, "update_dead_zones", "dead zones, q, delta", "dead zones"}};
  static constexpr bool kFollows = true;
  explicit DeadZoneSpringLaw(const LawSetup& setup) : JointLaw<S, DeadZoneSpring>(setup) {
    mode_.allocate(static_cast<Index>(this->entries().size()));
  }

  void begin(const StepView<S>& step, const StepStart<S>&, Field<S>& delta) { find_pieces(step, delta); }
  void add(const StepView<S>& step, JointImpulses<S>& sum) const {
    const S zero(0.0), half(0.5);
    for (Index k = 0; k < mode_.rows(); ++k) {
      const DeadZoneSpring& spring = this->entries()[static_cast<std::size_t>(k)];
      const S pull = step.h * step.h * as<S>(spring.stiffness);
      const S beyond = step.q(step.q_row(spring.row)) - as<S>(spring.rest) - mode_(k) * as<S>(spring.half_width);
      const auto within = mode_(k) == zero;
      add_impulse(sum, spring.row, 0.5, select(within, zero, pull * beyond), select(within, zero, half * pull));
    }
  }
  MaskOf<S> update_states(const StepView<S>& step, const StateUpdate<MaskOf<S>>&, const S&, const Field<S>&, Field<S>& delta) {
    return find_pieces(step, delta);
  }
  void follow(const StepView<S>& step, const Field<S>& delta) { find_pieces(step, delta); }

  static S potential(const DeadZoneSpring& spring, const JointsView<S>& at) {
    using std::abs;
    using std::max;
    const S beyond = max(abs(at.q(at.q_row(spring.row)) - as<S>(spring.rest)) - as<S>(spring.half_width), S(0.0));
    return as<S>(0.5 * spring.stiffness) * beyond * beyond;
  }
  static void push(const DeadZoneSpring& spring, const Instant& now, Field<double>& force) {
    const double x = now.q(now.q_row(spring.row)) - spring.rest;
    force(spring.row) -= std::copysign(spring.stiffness * std::max(std::abs(x) - spring.half_width, 0.0), x);
  }

 private:
  /// The modes that belong to delta. Returns in which instances one changed.
  MaskOf<S> find_pieces(const StepView<S>& step, const Field<S>& delta) {
    const S zero(0.0), one(1.0), half(0.5);
    auto changed = zero > one;
    for (Index k = 0; k < mode_.rows(); ++k) {
      const DeadZoneSpring& spring = this->entries()[static_cast<std::size_t>(k)];
      const S x = step.q(step.q_row(spring.row)) + half * delta(spring.row) - as<S>(spring.rest), edge = as<S>(spring.half_width);
      const S mode = select(x > edge, one, select(x < -edge, -one, zero));
      changed = changed || mode != mode_(k);
      mode_(k) = mode;
    }
    return changed;
  }

  Field<S> mode_;  // of each: 0 within its zone, 1 above it, -1 below
};

}  // namespace linden
