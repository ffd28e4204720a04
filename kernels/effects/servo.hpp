// kernels/effects/servo.hpp
// Position servos with limited force: PD control, implicit in both gains.
//
//   force  clamp(k (target - q) - c qdot + lead, -most, most),  q taken at q^k + s delta, qdot = delta / h
//   lead   c target_velocity + feedforward
//
//   within its limit   o = h^2 (k (q^k - target) - lead),  g = h^2 k s + h c,  share s by g / d (joint_impulses.hpp)
//   at its limit       o = -+ h^2 most,  g = 0,  share s
//
// Of what goes over time lead is the mean over the step: delta / h is one too, and a feed-forward impulse comes whole. The target is that
// of the time q is taken at, t + s h, as the mean of [t + (2 s - 1) h, t + h]: of the whole step where s = 1/2, of its end where the servo
// holds the joint fast, and never of what is yet to come.
//
// Which of the two holds is settled within the solve: `mode` is 0, 1 or -1 (at the limit, pushing up or down) and is revised until it is
// that of the solution.
//
// k, c and s are each instance's own: gains may differ from one to the next.
//
// units   k [N m/rad, N/m], c [N m s/rad, N s/m], most [N m, N]
// energy  work of the force: force x worked a step, given or taken
// cost    some 6 operations an entry and step, 3 an evaluation
#pragma once

#include <span>

#include "kernels/effects/joint_impulses.hpp"
#include "layout/effects.hpp"

namespace linden {

template <class S>
struct Servos {
  std::span<const Servo> entries;
  // of each
  Field<S> stiffness, damping;  // k [N m/rad, N/m], c [N m s/rad, N s/m]
  Field<S> share, end_share;    // s, 1 - s
  Field<S> target;              // [rad, m]
  Field<S> mode;
  Field<S> lead;  // [N m, N]
};

/// o and g as if there were no limit, and the limit of |o + g delta|.
template <class S>
struct ServoLaw {
  S o, g, most;
};

template <class S>
LINDEN_INLINE ServoLaw<S> servo_law(const Servos<S>& servos, Index k, const Field<Index>& q_row, const S& h, const Field<S>& q) {
  const Servo& servo = servos.entries[static_cast<std::size_t>(k)];
  const S stiff = h * h * servos.stiffness(k);
  return {stiff * (q(q_row(servo.row)) - servos.target(k)) - h * h * servos.lead(k),
          servos.share(k) * stiff + h * servos.damping(k), h * h * as<S>(servo.max_force)};
}

template <class S>
void servo_map(const Servos<S>& servos, const Field<Index>& q_row, const S& h, const Field<S>& q, JointImpulses<S>& sum) {
  const S zero(0.0);
  for (Index k = 0; k < servos.mode.rows(); ++k) {
    const auto [o, g, most] = servo_law(servos, k, q_row, h, q);
    const auto free = servos.mode(k) == zero;
    add_impulse(sum, servos.entries[static_cast<std::size_t>(k)].row, servos.share(k), servos.end_share(k),
                select(free, o, -servos.mode(k) * most), select(free, g, zero));
  }
}

/// The modes that belong to delta. Returns in which instances one changed.
template <class S>
auto revise_servos(Servos<S>& servos, const Field<Index>& q_row, const S& h, const Field<S>& q, const Field<S>& delta) {
  const S zero(0.0), one(1.0);
  auto changed = zero > one;
  for (Index k = 0; k < servos.mode.rows(); ++k) {
    const auto [o, g, most] = servo_law(servos, k, q_row, h, q);
    const S push = -(o + g * delta(servos.entries[static_cast<std::size_t>(k)].row));
    const S mode = select(push > most, one, select(push < -most, -one, zero));
    changed = changed || mode != servos.mode(k);
    servos.mode(k) = mode;
  }
  return changed;
}

/// Work in a step [J].
template <class S>
S servo_work(const Servos<S>& servos, const Field<Index>& q_row, const S& h, const Field<S>& q, const Field<S>& delta,
             const Field<S>& before) {
  const S zero(0.0);
  S sum(0.0);
  for (Index k = 0; k < servos.mode.rows(); ++k) {
    const auto [o, g, most] = servo_law(servos, k, q_row, h, q);
    const Index row = servos.entries[static_cast<std::size_t>(k)].row;
    const S& d = delta(row);
    sum = sum + select(servos.mode(k) == zero, -(o + g * d), servos.mode(k) * most) * worked(servos.share(k), d, before(row));
  }
  return sum / (h * h);
}

}  // namespace linden
