#include "engine/effects/blows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linden {
namespace {

/// Blows at one state: joints that bounce off their limits may pass an impulse to and fro many times. From then on all stop.
constexpr int kMostRounds = 200;

/// What is slower does not move [rad/s, m/s].
constexpr double kLeastStrike = 1e-12;

/// Changes of what is held in one blow: those after which one limit alone changes, and those after which it stays as it is, whatever rounding
/// makes of it.
constexpr int kLate = 10, kMostUpdates = 200;

}  // namespace

Blows::Blows(TreeSweeps<true>& sweeps, Index velocities) : sweeps_(sweeps), bounds_(sweeps.effects().limits().entries.size()) {
  for (Field<double>* field : {&velocity_, &change_, &impulse_}) field->allocate(velocities);
}

bool Blows::at_upper(const State<double>& state, const JointLimit& limit) const {
  return limit.upper - state.q(sweeps_.effects().plan().q_row(limit.row)) <= kAtLimit;
}
bool Blows::at_lower(const State<double>& state, const JointLimit& limit) const {
  return state.q(sweeps_.effects().plan().q_row(limit.row)) - limit.lower <= kAtLimit;
}

bool Blows::met(const State<double>& state) const {
  for (const JointLimit& limit : limits()) {
    const bool at_limit = at_upper(state, limit) || at_lower(state, limit);
    if (state.last_step(0) == 0 && (at_limit || std::isfinite(limit.velocity))) return true;
    if (at_limit && (limit.restitution > 0 || std::abs(sweeps_.work().delta(limit.row)) > kAtLimit)) return true;
  }
  return false;
}

double Blows::strike(State<double>& state, bool arrived, int& blows) {
  auto& effects = sweeps_.effects();
  const auto arrives = [&](const JointLimit& limit) {
    return (at_upper(state, limit) || at_lower(state, limit)) && std::abs(sweeps_.work().delta(limit.row)) > kAtLimit;
  };
  if (arrived && std::ranges::any_of(limits(), arrives)) effects.forget_bends();
  sweeps_.read_velocity(state.p, velocity_);
  double taken = 0;
  const int before = blows;
  for (int round = 0; round < kMostRounds; ++round) {
    // that no joint is too fast before the first of them is seen to by the step
    if (!find_bounds(state, round + 1 < kMostRounds, round > 0 || !arrived)) break;
    solve();
    for (std::size_t k = 0; k < bounds_.size(); ++k) {
      const Index row = limits()[k].row;
      if (bounds_[k].held == Held::no || impulse_(row) == 0) continue;
      taken -= impulse_(row) * (velocity_(row) + 0.5 * change_(row));
      state.p(row) += impulse_(row);
      ++blows;
    }
    for (Index row = 0; row < velocity_.rows(); ++row) velocity_(row) += change_(row);
    for (std::size_t k = 0; k < bounds_.size(); ++k) {
      if (bounds_[k].held != Held::no) velocity_(limits()[k].row) = bounds_[k].velocity();
    }
  }
  for (const JointLimit& limit : limits()) {
    if ((at_upper(state, limit) || at_lower(state, limit)) && std::abs(velocity_(limit.row)) <= kLeastStrike) {
      velocity_(limit.row) = 0;
      effects.keep_still(limit.row);
    }
  }
  if (blows > before) {
    // what held a joint until the blow set it in motion is not in p
    sweeps_.momentum_read_as(velocity_, impulse_);
    effects.read_as(impulse_, state.p);
    sweeps_.drop_lasting_contact();
  }
  return taken;
}

bool Blows::find_bounds(const State<double>& state, bool may_bounce, bool may_be_fast) {
  bool needed = false, bounces = false;
  for (const JointLimit& limit : limits()) {
    const double v = velocity_(limit.row);
    const double into = std::max(at_upper(state, limit) ? v : 0, at_lower(state, limit) ? -v : 0);
    needed = needed || into > kLeastStrike || (may_be_fast && std::abs(v) - limit.velocity > kLeastStrike);
    bounces = bounces || (may_bounce && limit.restitution > 0 && into > kLeastBounce);
  }
  for (std::size_t k = 0; needed && k < bounds_.size(); ++k) bounds_[k] = bound(state, limits()[k], bounces);
  return needed;
}

/// A joint between two limits that it stands at both is stopped, as one that bounces off neither.
Blows::Bound Blows::bound(const State<double>& state, const JointLimit& limit, bool bounces) const {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const double v = velocity_(limit.row);
  const bool upper = at_upper(state, limit), lower = at_lower(state, limit);
  const double away = bounces && upper != lower && std::abs(v) > kLeastBounce ? std::min(limit.restitution * std::abs(v), limit.velocity) : 0;
  Bound result{lower ? (v < 0 ? away : 0) : -limit.velocity, upper ? (v > 0 ? -away : 0) : limit.velocity, Held::no};
  // what would give energy is not asked as long as something bounces
  if (bounces && v + result.low > kLeastStrike) result.low = -kAny;
  if (bounces && v + result.high < -kLeastStrike) result.high = kAny;
  // what rests at a bound is likely to be held there
  if (v <= result.low + kLeastStrike) result.held = Held::low;
  if (v >= result.high - kLeastStrike) result.held = Held::high;
  return result;
}

void Blows::solve() {
  for (int update = 0; update < kMostUpdates; ++update) {
    respond();
    if (!update_states(update >= kLate)) return;
  }
}

/// change_ and impulse_ where the limits that hold are those that bounds_ says.
void Blows::respond() {
  auto& effects = sweeps_.effects();
  effects.begin_blow();
  std::ranges::fill(change_.flat(), 0.0);
  for (std::size_t k = 0; k < bounds_.size(); ++k) {
    const Index row = limits()[k].row;
    if (bounds_[k].held == Held::no) continue;
    effects.hold_in_blow(row);
    change_(row) = bounds_[k].velocity() - velocity_(row);
  }
  sweeps_.blow(change_, impulse_);
}

/// Limits that would have to pull let go, and what passes a bound is held there; one_by_one: the last of them alone, which never goes round in
/// circles (Murty's rule, as in limits.hpp). Returns whether something changed.
bool Blows::update_states(bool one_by_one) {
  bool changed = false;
  for (std::size_t k = bounds_.size(); k-- > 0 && !(one_by_one && changed);) {
    Bound& bound = bounds_[k];
    const Index row = limits()[k].row;
    const double after = velocity_(row) + change_(row);
    Held held = bound.held;
    if (held == Held::no) {
      held = after > bound.high + kLeastStrike ? Held::high : after < bound.low - kLeastStrike ? Held::low : Held::no;
    } else if (held == Held::high ? impulse_(row) > 0 : impulse_(row) < 0) {
      held = Held::no;
    }
    changed = changed || held != bound.held;
    bound.held = held;
  }
  return changed;
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
