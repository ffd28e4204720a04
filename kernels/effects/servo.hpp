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
// Which of the two holds is settled within the solve: `mode` is 0, 1 or -1 (at the limit, pushing up or down) and is updated until it is
// that of the solution.
//
// k, c and s are each instance's own: gains may differ from one to the next.
//
// units   k [N m/rad, N/m], c [N m s/rad, N s/m], most [N m, N]
// energy  work of the force: force x work_displacement a step, given or taken
// cost    some 6 operations an entry and step, 3 an evaluation
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "kernels/effects/law.hpp"

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
struct ServoForce {
  S o, g, most;
};

template <class S>
LINDEN_INLINE ServoForce<S> servo_force(const Servos<S>& servos, Index k, const Field<Index>& q_row, const S& h, const Field<S>& q) {
  const Servo& servo = servos.entries[static_cast<std::size_t>(k)];
  const S stiff = h * h * servos.stiffness(k);
  return {stiff * (q(q_row(servo.row)) - servos.target(k)) - h * h * servos.lead(k),
          servos.share(k) * stiff + h * servos.damping(k), h * h * as<S>(servo.max_force)};
}

template <class S>
void servo_map(const Servos<S>& servos, const Field<Index>& q_row, const S& h, const Field<S>& q, JointImpulses<S>& sum) {
  const S zero(0.0);
  for (Index k = 0; k < servos.mode.rows(); ++k) {
    const auto [o, g, most] = servo_force(servos, k, q_row, h, q);
    const auto free = servos.mode(k) == zero;
    add_impulse(sum, servos.entries[static_cast<std::size_t>(k)].row, servos.share(k), servos.end_share(k),
                select(free, o, -servos.mode(k) * most), select(free, g, zero));
  }
}

/// The modes that belong to delta. Returns in which instances one changed.
template <class S>
auto update_servos(Servos<S>& servos, const Field<Index>& q_row, const S& h, const Field<S>& q, const Field<S>& delta) {
  const S zero(0.0), one(1.0);
  auto changed = zero > one;
  for (Index k = 0; k < servos.mode.rows(); ++k) {
    const auto [o, g, most] = servo_force(servos, k, q_row, h, q);
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
    const auto [o, g, most] = servo_force(servos, k, q_row, h, q);
    const Index row = servos.entries[static_cast<std::size_t>(k)].row;
    const S& d = delta(row);
    sum = sum + select(servos.mode(k) == zero, -(o + g * d), servos.mode(k) * most) * work_displacement(servos.share(k), d, before(row));
  }
  return sum / (h * h);
}

template <class S>
class ServoLaw : public JointLaw<S, Servo> {
 public:
  static constexpr std::array sweeps{PartSweep{Part::begin, "begin_servos", "servos, time", "servos"},
                                     PartSweep{Part::add, "servo_map", "servos, q, joint impulses", "joint impulses"},
                                     PartSweep{Part::update_states, "update_servos", "servos, q, delta", "servos"}};
  static constexpr bool kFollows = true;
  explicit ServoLaw(const LawSetup& setup) : JointLaw<S, Servo>(setup) {
    servos_.entries = this->entries();
    const auto count = static_cast<Index>(this->entries().size());
    for (Field<S>* field : {&servos_.stiffness, &servos_.damping, &servos_.share, &servos_.end_share, &servos_.mode, &servos_.lead,
                            &servos_.target, &targets_, &gains_}) {
      field->allocate(count);
    }
    const auto acts = [](const TimeTable& table) { return std::ranges::any_of(table.values, [](double value) { return value != 0; }); };
    for (Index k = 0; k < count; ++k) {
      const Servo& servo = this->entries()[static_cast<std::size_t>(k)];
      has_tables_ = has_tables_ || servo.target_moves() || acts(servo.target_velocity) || acts(servo.feedforward);
      ratio_.push_back(ratio(servo, setup.step, setup.inertia_at(servo.row)));
      set_gain(k, S(1.0));
      targets_(k) = as<S>(servo.target_moves() ? std::numeric_limits<double>::quiet_NaN() : servo.target);
    }
  }
  static double ratio(const Servo& servo, double step, double inertia) {
    return (step * servo.damping + step * step * servo.stiffness) / inertia;
  }

  void begin(const StepView<S>&, const StepStart<S>& start, Field<S>&) {
    std::ranges::copy(targets_.flat(), servos_.target.flat().begin());
    if (has_tables_) look_up(start.times, start.step);
    std::fill(servos_.mode.flat().begin(), servos_.mode.flat().end(), S(0.0));
  }
  void add(const StepView<S>& step, JointImpulses<S>& sum) const { servo_map(servos_, step.q_row, step.h, step.q, sum); }
  MaskOf<S> update_states(const StepView<S>& step, const StateUpdate<MaskOf<S>>&, const S&, const Field<S>&, Field<S>& delta) {
    return update_servos(servos_, step.q_row, step.h, step.q, delta);
  }
  void follow(const StepView<S>& step, const Field<S>& delta) { update_servos(servos_, step.q_row, step.h, step.q, delta); }
  void account(const StepView<S>& step, const SolvedStep<S>& solved, const auto& book) const {
    book(-1, servo_work(servos_, step.q_row, step.h, step.q, solved.delta, solved.before));
  }
  static void push(const Servo& servo, const Instant& now, Field<double>& force) {
    force(servo.row) += servo.stiffness * (servo.target_at(now.time) - now.q(now.q_row(servo.row))) +
                        servo.damping * (servo.target_velocity.at(now.time) - now.v(servo.row)) + servo.feedforward.at(now.time);
  }

  const Servos<S>& servos() const { return servos_; }
  /// To be written between steps; not a number: the target is that of the servo's table.
  Field<S>& targets() { return targets_; }
  /// Factor of each servo's stiffness and damping; set_gain between steps. With it goes how implicit they are taken.
  const Field<S>& gains() const { return gains_; }
  void set_gain(Index k, const S& factor) {
    using std::max;
    const auto at = static_cast<std::size_t>(k);
    const S half(0.5), one(1.0);
    const auto plain = factor == one;
    const double plain_share = begin_share(ratio_[at]);
    gains_(k) = factor;
    servos_.stiffness(k) = as<S>(this->entries()[at].stiffness) * factor;
    servos_.damping(k) = as<S>(this->entries()[at].damping) * factor;
    const S share = max(half, one - half / (as<S>(ratio_[at]) * factor));
    servos_.share(k) = select(plain, as<S>(plain_share), share);
    servos_.end_share(k) = select(plain, as<S>(1 - plain_share), one - share);
  }

 private:
  void look_up(const LaneTimes<S>& times, double step) {
    for (Index k = 0; k < servos_.mode.rows(); ++k) {
      const Servo& servo = this->entries()[static_cast<std::size_t>(k)];
      servos_.lead(k) = at_each_time<S>(times, gains_(k), [&](double t, double gain) LINDEN_INLINE_LAMBDA {
        return gain * servo.damping * servo.target_velocity.mean(t, t + step) + servo.feedforward.mean(t, t + step);
      });
      if (!servo.target_moves()) continue;
      const double ratio = ratio_[static_cast<std::size_t>(k)];
      const S moving = at_each_time<S>(times, gains_(k), [&](double t, double gain) LINDEN_INLINE_LAMBDA {
        const double gone = 2 * begin_share(gain * ratio) - 1;
        return servo.target_over_time.mean(t + gone * step, t + step);
      });
      const S& given = targets_(k);
      servos_.target(k) = select(given == given, given, moving);
    }
  }

  Servos<S> servos_;
  Field<S> targets_;           // of each, from outside; not a number where its table says
  Field<S> gains_;             // likewise: factor of its stiffness and damping
  std::vector<double> ratio_;  // of each, which goes with its gain
  bool has_tables_ = false;
};

}  // namespace linden
