// kernels/effects/dead_zone_spring.hpp
// Springs with a dead zone: gears with backlash, couplings and hinges with play, cables that stretch.
//
//   P = 1/2 k m^2,   m = max(|x| - w, 0),   x = q - rest
//
// Each side of the zone pushes back by
//
//   F = max(0, (P^k+1 - P^k) / d + c' (m^k+1 - m^k)),   d = +-delta,   c' = (s - 1/2) k + c / h
//
// with s the share of the impulse that acts at the beginning of the step (joint_impulses.hpp). The difference quotient of P (a discrete gradient)
// makes the work of the spring exactly -dP, also of a step that crosses the edge of the zone: the springs give nothing, and at s = 1/2 they take
// nothing either. Taken at the middle of the step, as that of a spring is (spring.hpp), the work of a step that crosses would be off by up to
// k (h v)^2 / 8, now more and now less, and the energy of a mass that drops on it again and again would stray without end. What damps never drives,
// since m grows with d.
//
//   stays beyond, m^k, m^k+1 > 0    h^2 F = h^2 k (m^k + s d) + h c d       the middle of the step at s = 1/2: o = h^2 k m^k, g = h^2 k / 2
//   stays within                    F = 0
//   crosses                         o and g are the tangent at delta, taken anew until it has the force
//
// F is continuous and grows with delta, so there is just one solution. What holds is settled within the solve.
//
// Where a step does not resolve the spring, the share grows from 1/2 to 1 as of all that is stiff, and takes energy: a joint that hits one comes back
// with some 2 (1 - s) of its speed, the inertia over h^2 k; what is beyond all that a step resolves is a stop.
//
// The inertia is that of the joint's row with all others free and couplings closed (zone_yields in law_setup.hpp): of the length of a cable, which
// itself weighs next to nothing, that of what the cable moves.
//
// A mass m that flies to and fro between the two springs with a speed v in the zone has the period 2 pi sqrt(m / k) + 4 w / v.
//
// units   k [N m/rad, N/m], c [N m s/rad, N s/m], w and rest [rad, m]
// energy  P; takes F x work_displacement less what P has grown by, where s > 1/2 or c > 0, else nothing
// cost    some 40 operations an entry and evaluation
// source  Gonzalez, Time integration and discrete Hamiltonian systems (1996); Nordin, Gutman, Controlling mechanical systems with backlash - a
//         survey (2002), 2.1 (the dead-zone model)
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/effects/law.hpp"

namespace linden {

/// How near the tangent of a force has to have it, as a share of its two terms.
template <class S>
inline constexpr double kNearTangent = is_single<S> ? 1e-5 : 1e-12;

/// A force on a row, times h^2, and its tangent o + g delta.
template <class S>
struct ZoneForce {
  S force, o, g;
};

/// Of the side of a zone beyond which y is above zero at the beginning of a step, while it changes by d. pull: h^2 k; slow: h c.
template <class S>
LINDEN_INLINE ZoneForce<S> side_force(const S& pull, const S& slow, const S& share, const S& y, const S& d) {
  using std::max;
  const S zero(0.0), half(0.5), one(1.0);
  const S m = max(y, zero), m_next = max(y + d, zero);
  const auto beyond = y > zero && y + d > zero, crosses = !beyond && (y > zero || y + d > zero);
  // what crosses moves
  const S across = one / select(crosses, d, one), loss = (share - half) * pull + slow, spring = half * pull * (m_next * m_next - m * m) * across;
  const S o = pull * y, g = share * pull + slow;
  const S force = select(beyond, o + g * d, spring + loss * (m_next - m));
  const S slope = (select(m_next > zero, pull * m_next, zero) - spring) * across + select(m_next > zero, loss, zero);
  const auto pushes = (beyond || crosses) && force > zero;
  return {select(pushes, force, zero), select(pushes, select(beyond, o, force - slope * d), zero), select(pushes, select(beyond, g, slope), zero)};
}

template <class S>
class DeadZoneSpringLaw : public JointLaw<S, DeadZoneSpring> {
 public:
  static constexpr std::array sweeps{
      PartSweep{Part::begin, "begin_dead_zones", "dead zones, q, delta", "dead zones"},
      PartSweep{Part::add, "dead_zone_map", "dead zones, q, joint impulses", "joint impulses"},
      PartSweep{Part::update_states, "update_dead_zones", "dead zones, q, delta", "dead zones"}};
  static constexpr bool kFollows = true;
  explicit DeadZoneSpringLaw(const LawSetup& setup) : JointLaw<S, DeadZoneSpring>(setup) {
    const auto count = static_cast<Index>(this->entries().size());
    for (Field<S>* field : {&offset_, &gain_}) field->allocate(count);
    for (Index k = 0; k < count; ++k) {
      const DeadZoneSpring& spring = entry(k);
      const double pull = setup.step * setup.step * spring.stiffness, slow = std::abs(setup.step) * spring.damping;
      share_.push_back(begin_share(setup.zone_yields[static_cast<std::size_t>(k)] * (pull + slow)));
    }
  }

  void begin(const StepView<S>& step, const StepStart<S>&, Field<S>& delta) {
    for (Field<S>* field : {&offset_, &gain_}) std::ranges::fill(field->flat(), S(0.0));
    find_tangents(step, delta);
  }
  void add(const StepView<S>&, JointImpulses<S>& sum) const {
    for (Index k = 0; k < offset_.rows(); ++k) add_impulse(sum, entry(k).row, share(k), offset_(k), gain_(k));
  }
  MaskOf<S> update_states(const StepView<S>& step, const StateUpdate<MaskOf<S>>&, const S&, const Field<S>&, Field<S>& delta) {
    return find_tangents(step, delta);
  }
  void follow(const StepView<S>& step, const Field<S>& delta) { find_tangents(step, delta); }
  void account(const StepView<S>& step, const SolvedStep<S>& solved, const auto& book) const {
    for (Index k = 0; k < offset_.rows(); ++k) {
      if (keeps_energy(k)) continue;
      const DeadZoneSpring& spring = entry(k);
      const S& q = step.q(step.q_row(spring.row)), &delta = solved.delta(spring.row);
      const S against = (offset_(k) + gain_(k) * delta) * work_displacement(share(k), delta, solved.before(spring.row)) / (step.h * step.h);
      book(spring.row, against - (energy_at(spring, q + delta) - energy_at(spring, q)));
    }
  }

  static S potential(const DeadZoneSpring& spring, const JointsView<S>& at) { return energy_at(spring, at.q(at.q_row(spring.row))); }
  static void push(const DeadZoneSpring& spring, const Instant& now, Field<double>& force) {
    const double x = now.q(now.q_row(spring.row)) - spring.rest, beyond = std::abs(x) - spring.half_width;
    if (!(beyond > 0)) return;
    const double opening = std::copysign(now.v(spring.row), x * now.v(spring.row));
    force(spring.row) -= std::copysign(std::max(spring.stiffness * beyond + spring.damping * opening, 0.0), x);
  }

 private:
  const DeadZoneSpring& entry(Index k) const { return this->entries()[static_cast<std::size_t>(k)]; }
  double share(Index k) const { return share_[static_cast<std::size_t>(k)]; }
  static S energy_at(const DeadZoneSpring& spring, const S& q) {
    using std::abs;
    using std::max;
    const S beyond = max(abs(q - as<S>(spring.rest)) - as<S>(spring.half_width), S(0.0));
    return as<S>(0.5 * spring.stiffness) * beyond * beyond;
  }
  bool keeps_energy(Index k) const { return share(k) == 0.5 && entry(k).damping == 0; }

  ZoneForce<S> force_at(const StepView<S>& step, Index k, const S& delta) const {
    const DeadZoneSpring& spring = entry(k);
    const S pull = step.h * step.h * as<S>(spring.stiffness), slow = step.h * as<S>(spring.damping), s = as<S>(share(k));
    const S x = step.q(step.q_row(spring.row)) - as<S>(spring.rest), edge = as<S>(spring.half_width);
    const ZoneForce<S> above = side_force(pull, slow, s, x - edge, delta), below = side_force(pull, slow, s, -x - edge, -delta);
    return {above.force - below.force, above.o - below.o, above.g + below.g};
  }
  /// Tangents at delta, where those that there are do not have the force. Returns in which instances one changed.
  MaskOf<S> find_tangents(const StepView<S>& step, const Field<S>& delta) {
    using std::abs;
    const S near = as<S>(kNearTangent<S>);
    auto changed = S(0.0) > S(1.0);
    for (Index k = 0; k < offset_.rows(); ++k) {
      const S& d = delta(entry(k).row);
      const ZoneForce<S> now = force_at(step, k, d);
      const S turned = gain_(k) * d;
      const auto settled = abs(offset_(k) + turned - now.force) <= near * (abs(offset_(k)) + abs(turned));
      changed = changed || !settled;
      offset_(k) = select(settled, offset_(k), now.o);
      gain_(k) = select(settled, gain_(k), now.g);
    }
    return changed;
  }

  std::vector<double> share_;  // s of each
  Field<S> offset_, gain_;     // of each: o and g
};

}  // namespace linden
