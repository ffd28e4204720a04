#include "engine/effects/blows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linden {
namespace {

/// Blows at one state: a row of joints that all stand at their limits passes an impulse to and fro some ten times.
constexpr int kMostStrikes = 200;

/// Without restitution the last of a blow that others return is left to the next step, whose limits hold.
constexpr double kLeastStrike = 1e-12;  // [rad/s, m/s]

}  // namespace

Blows::Blows(TreeSweeps<true>& sweeps, Index velocities) : sweeps_(sweeps) {
  for (Field<double>* field : {&velocity_, &unit_, &response_}) field->allocate(velocities);
}

bool Blows::met(const State<double>& state) const {
  const Limits<double>& limits = sweeps_.effects().limits();
  const Field<Index>& q_row = sweeps_.effects().plan().q_row;
  for (Index k = 0; k < limits.mode.rows(); ++k) {
    const JointLimit& limit = limits.entries[static_cast<std::size_t>(k)];
    const double q = state.q(q_row(limit.row));
    const bool at_limit = limit.upper - q <= kAtLimit || q - limit.lower <= kAtLimit;
    if (state.last_step(0) == 0 && (at_limit || std::isfinite(limit.velocity))) return true;
    if (at_limit && (limit.restitution > 0 || std::abs(sweeps_.work().delta(limit.row)) > kAtLimit)) return true;
  }
  return false;
}

double Blows::strike(State<double>& state, bool arrived, int& blows) {
  auto& effects = sweeps_.effects();
  const Limits<double>& limits = effects.limits();
  const Field<Index>& q_row = effects.plan().q_row;
  if (arrived) {
    for (const JointLimit& limit : limits.entries) {
      if (std::abs(sweeps_.work().delta(limit.row)) > kAtLimit) effects.release(limit.row);
    }
  }
  sweeps_.read_velocity(state.p, velocity_);
  double taken = 0;
  const int before = blows;
  for (int blow = 0; blow < kMostStrikes; ++blow) {
    const bool may_be_fast = blow > 0 || !arrived;  // else the step has seen to it
    const JointLimit* fastest = nullptr;
    double most = kLeastStrike, target = 0;  // of how much too fast a joint is; what the blow makes of its velocity
    for (const JointLimit& limit : limits.entries) {
      const double q = state.q(q_row(limit.row)), v = velocity_(limit.row);
      const double into = limit.upper - q <= kAtLimit ? v : q - limit.lower <= kAtLimit ? -v : 0;
      const double over = may_be_fast ? std::abs(v) - limit.velocity : 0;
      if (std::max(into, over) <= most) continue;
      most = std::max(into, over);
      fastest = &limit;
      target = into > kLeastBounce ? -limit.restitution * v : into > 0 ? 0 : std::copysign(limit.velocity, v);
    }
    if (fastest == nullptr) break;
    const Index row = fastest->row;
    std::ranges::fill(unit_.flat(), 0.0);
    unit_(row) = 1;
    if (blows > before) {
      sweeps_.apply_mass_inverse(unit_, response_);
    } else {
      sweeps_.response_to(unit_, response_);
    }
    const double impulse = (target - velocity_(row)) / response_(row);
    taken -= impulse * (velocity_(row) + 0.5 * impulse * response_(row));
    for (Index k = 0; k < velocity_.rows(); ++k) velocity_(k) += impulse * response_(k);
    velocity_(row) = target;
    state.p(row) += impulse;
    ++blows;
  }
  for (const JointLimit& limit : limits.entries) {
    const double q = state.q(q_row(limit.row));
    const bool at_limit = limit.upper - q <= kAtLimit || q - limit.lower <= kAtLimit;
    if (at_limit && std::abs(velocity_(limit.row)) <= kLeastStrike) {
      velocity_(limit.row) = 0;
      effects.keep_still(limit.row);
    }
  }
  if (blows > before) {
    // what held a joint until the blow set it in motion is not in p
    sweeps_.momentum_of(velocity_, unit_);
    effects.read_as(unit_, state.p);
  }
  return taken;
}

double Blows::passed(const State<double>& state) const {
  const Limits<double>& limits = sweeps_.effects().limits();
  const Field<Index>& q_row = sweeps_.effects().plan().q_row;
  double most = -std::numeric_limits<double>::infinity();
  for (const JointLimit& limit : limits.entries) {
    if (limit.restitution == 0) continue;
    const double q = state.q(q_row(limit.row)), delta = sweeps_.work().delta(limit.row);
    // one that is at its limit already is held there
    if (limit.upper - q > kAtLimit) most = std::max(most, delta - (limit.upper - q));
    if (q - limit.lower > kAtLimit) most = std::max(most, -delta - (q - limit.lower));
  }
  return most;
}

}  // namespace linden
