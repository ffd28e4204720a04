// engine/solve/solve.hpp
// Solves the equation of a step, for one tree or for a block of instances: evaluates, judges (judge.hpp), decides (decide.hpp), does what
// was decided, until nobody is left. Who is solved or given up waits for the others.
//
// Sweeps run what is decided, over their own order of memory:
//
//   Number, kLanes, kAlone                      double or a pack; how many instances; whether one can cut, take back, refactor, continue
//   evaluate(active, lanes, round)              corrects the displacement of these lanes, the others' stays; the next evaluation of all. Of
//                                               those that are active the others had a state changed
//   converged(now), close(now)                  lanes whose residual is below the tolerance; nearly so
//   at_floor(now, epsilons)                     lanes whose residual is rounding alone
//   has_states(), update_states(update)              effects that stick, stop or saturate: lanes in which a state changed
//   refused(lanes, now)                         of lanes that are solved those that cannot take the step in one
//   put_aside(done, before, active)                these lanes are solved, those were before, others go on with what all share
//   and alone: first_correction(now, before, floor), told once what the first correction left; stale(now, before), whether the factor that
//   was held for it will not do; cut(share), take_back(share), refactor(now), continuation(now, whole), give_up(seen)
#pragma once

#include <array>
#include <bit>
#include <limits>

#include "engine/solve/decide.hpp"
#include "engine/solve/judge.hpp"
#include "engine/solve/lane_counts.hpp"
#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
struct Solved {
  Lanes done = 0, lost = 0;
  S least_w = S(1.0);                         // of those done, see displacement_down
  LaneCounts<LanesOf<S>::count> evaluations;  // until an instance was done or lost
};

template <class Sweeps>
class Solve {
 public:
  using S = typename Sweeps::Number;
  using L = LanesOf<S>;

  Solve(Sweeps& sweeps, const Policy& policy) : sweeps_(sweeps), policy_(policy) {}

  /// now: the evaluation of the first guess; fresh: lanes in which it made the factor.
  Solved<S> run(Lanes active, Evaluated<S> now, Lanes fresh) {
    now_ = now;
    fresh_ = fresh;
    Solved<S> solved;
    solved.evaluations.add(active);
    if (!policy_.judges_guess) correct(active, active, solved);
    for (;;) {
      std::array<Lanes, kNexts> next = decided(active);
      const Lanes refused = sweeps_.refused(lanes_to(next, Next::accept), now_);
      const Lanes done = lanes_to(next, Next::accept) & ~refused, lost = lanes_to(next, Next::give_up) | refused;
      solved.least_w = select(L::mask(done), now_.least_w, solved.least_w);
      solved.done |= done;
      solved.lost |= lost;
      active &= ~(done | lost);
      sweeps_.put_aside(done, solved.done & ~done, active);
      if (active == 0) return solved;
      if constexpr (Sweeps::kAlone) {
        if (next[static_cast<std::size_t>(Next::correct)] == 0) {
          act_alone(next);
          continue;
        }
      }
      correct(active, lanes_to(next, Next::correct), solved);
      updates_.add(lanes_to(next, Next::update_states));
    }
  }

  /// The evaluation made last, and what was seen of the last lane that was decided about.
  const Evaluated<S>& now() const { return now_; }
  const Seen& seen() const { return seen_; }

 private:
  static Lanes lanes_to(const std::array<Lanes, kNexts>& next, Next what) { return next[static_cast<std::size_t>(what)]; }

  /// What happens next to each lane. Lanes of which the same was seen are decided about once.
  std::array<Lanes, kNexts> decided(Lanes active) {
    const auto is_usable = usable(now_);
    now_.norm = select(is_usable, now_.norm, as<S>(std::numeric_limits<double>::infinity()));
    const Lanes usable = L::bits(is_usable);
    const Lanes fell = L::bits(now_.norm < before_), whole = corrected_ & ~cut_;
    slow_ = (slow_ & ~whole) | (whole & ~L::bits(fell_fast(now_.norm, before_)));
    const Lanes converged = usable & sweeps_.converged(now_);
    const Lanes at_floor = floor(active & usable & ~converged, whole), solved = converged | at_floor;
    bool stale = false;
    if constexpr (Sweeps::kAlone) {
      if (whole != 0 && corrections_.of(0) == 1) sweeps_.first_correction(now_.norm, before_, at_floor != 0);
    }
    const Lanes changed = updated(active & usable & ~(cut_ & ~fell), solved);
    if constexpr (Sweeps::kAlone) stale = corrected_ != 0 && corrections_.of(0) == 1 && sweeps_.stale(now_, before_);
    std::array<Lanes, kNexts> next{};
    for (Lanes left = active; left != 0;) {
      const int l = std::countr_zero(left);
      Lanes same = left & corrections_.same_as(l) & updates_.same_as(l);
      const auto is = [&](Lanes lanes) {
        if constexpr (L::count > 1) same &= same_lanes(lanes, l);
        return (lanes >> l & 1u) != 0;
      };
      seen_ = {is(usable), is(solved), is(at_floor), is(changed), is(corrected_), is(taken_back_), is(fell), is(slow_), stale, is(fresh_),
               corrections_.of(l), cuts_, updates_.of(l)};
      const Next what = decide(policy_, seen_);
      next[static_cast<std::size_t>(what)] |= same;
      left &= ~same;
      if constexpr (Sweeps::kAlone) {
        if (what == Next::give_up) sweeps_.give_up(seen_);
      }
    }
    if ((corrected_ & (fell | solved)) != 0) fresh_ = 0;
    return next;
  }

  /// Which of these lanes are at the floor of rounding, as far as it is asked.
  Lanes floor(Lanes lanes, Lanes whole) {
    Lanes stalled = lanes;
    if (policy_.floor_test != FloorTest::always) stalled &= (whole & slow_) | taken_back_;
    Lanes found = stalled != 0 ? stalled & sweeps_.at_floor(now_, kFloorEpsilons) : 0;
    if (policy_.floor_test != FloorTest::also_when_close) return found;
    const Lanes near = lanes & whole & ~slow_ & sweeps_.close(now_);
    if (near != 0) found |= near & sweeps_.at_floor(now_, kBareRounding);
    return found;
  }

  /// Which of these lanes have a state that is not that of the solution so far; it is changed.
  Lanes updated([[maybe_unused]] Lanes lanes, [[maybe_unused]] Lanes solved) {
    if (!sweeps_.has_states()) return 0;
    Lanes late = 0, last = 0;
    for (Lanes left = lanes; left != 0;) {
      const int l = std::countr_zero(left), updates = updates_.of(l);
      const Lanes same = left & updates_.same_as(l);
      left &= ~same;
      if (updates == policy_.first_continuation || updates == policy_.last_continuation) lanes &= ~same;
      if (updates >= policy_.one_state_at_a_time) late |= same;
      if (updates >= policy_.one_limit_at_a_time) last |= same;
    }
    if (lanes == 0) return 0;
    const Lanes near = solved | L::bits(within(now_.norm, as<S>(kSettled * kSettled), now_.scale));
    return lanes & sweeps_.update_states({L::mask(near), L::mask(solved), L::mask(late), L::mask(last)});
  }

  /// The next evaluation; these lanes are corrected before it, the other active ones had a state changed.
  void correct(Lanes active, Lanes lanes, Solved<S>& solved) {
    before_ = now_.norm;
    corrected_ = lanes;
    cut_ = taken_back_ = 0;
    cuts_ = 0;
    share_ = 1;
    corrections_.add(lanes);
    solved.evaluations.add(active);
    rounds_ += 1;
    now_ = sweeps_.evaluate(active, lanes, rounds_);
  }

  /// Of a tree that is stepped alone: all but the next correction.
  void act_alone(const std::array<Lanes, kNexts>& next) {
    if constexpr (Sweeps::kAlone) {
      if (lanes_to(next, Next::cut) != 0) {
        share_ /= 2;
        cut_ = 1;
        cuts_ += 1;
        now_ = sweeps_.cut(share_);
      } else if (lanes_to(next, Next::take_back) != 0) {
        corrected_ = cut_ = 0;
        taken_back_ = 1;
        now_ = sweeps_.take_back(share_);
      } else {
        corrected_ = cut_ = taken_back_ = 0;
        if (lanes_to(next, Next::refactor) != 0) {
          sweeps_.refactor(now_);
        } else {
          if (lanes_to(next, Next::continuation) != 0) {
            sweeps_.continuation(now_, updates_.of(0) == policy_.last_continuation);
          }
          updates_.add(1);
          now_ = sweeps_.evaluate(1, 0, rounds_);
        }
        fresh_ = 1;
      }
    }
  }

  Sweeps& sweeps_;
  const Policy& policy_;
  Evaluated<S> now_;
  S before_ = S(0.0);  // norm that the correction met
  Seen seen_;
  Lanes corrected_ = 0, cut_ = 0, taken_back_ = 0, slow_ = 0, fresh_ = 0;
  int rounds_ = 0, cuts_ = 0;
  LaneCounts<L::count> corrections_, updates_;
  double share_ = 1;  // of the correction that is tried
};

}  // namespace linden
