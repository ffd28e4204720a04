// engine/solve/decide.hpp
// What happens next to an instance while the equation of its step is solved: a function of its own numbers and of nothing else. A tree that is
// stepped alone and the instances of a block go by the same table, each by its own policy; that no instance sees another, so that its bits
// are the same in any company, follows from the signature.
//
//   seen, the first line that holds                       next             alone                              in a block
//   a body turned too far, or something is not finite     cut              up to 10 times, then take back     give up
//                                                                          at once by a held factor
//   - of the first guess                                  give up
//   states of effects were updated too often              give up          60 times                           24
//   they do not settle                                    continuation     after 5 and 20 updates             -
//   a state of an effect changed                          update states    one at a time from the 5th on      from the 8th on
//   the residual did not fall, is not solved              cut              the same                           give up from the 2nd on; never with effects
//   the correction was taken back                         refactor         give up if the factor was fresh    -
//   the residual fell by less than 10, or a held factor   refactor         with Newton's method               -
//     will not do; not at the floor of rounding
//   solved, or at the floor of rounding                   accept
//   corrected too often                                   give up          50 (riqn 1,000)                    8, with effects 24
//   else                                                  correct
//
// What is given up alone is split in two by whoever steps; in a block it is stepped alone. A residual that fell by less than 10 asks for a
// factor even where it is solved now: the next step begins with it.
#pragma once

#include <cstdint>

namespace linden {

enum class Next : std::uint8_t { accept, correct, refactor, cut, take_back, update_states, continuation, give_up };
inline constexpr int kNexts = 8;

/// When it is asked whether a residual that is not solved is rounding alone, which costs a tenth of a correction.
enum class FloorTest : std::uint8_t { after_slow_correction, also_when_close, always };

/// Corrections that may leave a larger residual than they met.
inline constexpr int kAnyNumber = 1 << 20;

struct Policy {
  int most_corrections;       // in one solve
  bool judges_guess = true;   // else it is corrected once, whatever it leaves
  FloorTest floor_test = FloorTest::also_when_close;
  int may_grow = 0;           // the first so many corrections may leave a larger residual than they met
  int most_cuts = 0;          // times that one is cut in half; 0: none is ever taken back
  bool refactors = false;     // the factor is made anew where it serves badly; else whoever sweeps sees to it
  int one_state_at_a_time = kAnyNumber;  // from so many updates on: of what sticks too hard that alone which does most
  int one_limit_at_a_time = kAnyNumber;  // likewise of limits
  int first_continuation = kAnyNumber, last_continuation = kAnyNumber;  // after so many updates
  int most_updates = kAnyNumber;  // of states; what has not settled by then is given up
};

/// One instance after an evaluation of its residual.
struct Seen {
  bool usable = true;       // no body turned by pi, all is finite
  bool solved = false;      // the residual is below the tolerance, or rounding alone
  bool at_floor = false;    // the latter
  bool changed = false;     // a state of an effect is not that of this solution
  bool corrected = false;   // the evaluation follows a correction, whole or cut
  bool taken_back = false;  // or one that was taken back
  bool fell = false;        // below what it was before the correction
  bool slow = false;        // the whole correction left more than a tenth
  bool stale = false;       // a held factor, by what its first correction left, needs more than one more
  bool fresh = false;       // the factor was made at the displacement that was corrected
  int corrections = 0, cuts = 0, updates = 0;  // so far; cuts: of this correction
};

constexpr Next decide(const Policy& policy, const Seen& seen) {
  const bool can_cut = seen.corrected && policy.most_cuts > 0;
  const Next shorter = !seen.stale && seen.cuts < policy.most_cuts ? Next::cut : Next::take_back;
  if (!seen.usable) return can_cut ? shorter : Next::give_up;
  if (seen.updates >= policy.most_updates) return Next::give_up;
  if (seen.updates == policy.first_continuation || seen.updates == policy.last_continuation) return Next::continuation;
  if (seen.changed) return Next::update_states;
  if (seen.corrected && !seen.fell && !seen.solved) {
    if (policy.most_cuts > 0) return shorter;
    if (seen.corrections > policy.may_grow) return Next::give_up;
  }
  if (seen.taken_back && !seen.solved) return seen.fresh || !policy.refactors ? Next::give_up : Next::refactor;
  if ((seen.slow || seen.stale) && seen.corrected && !seen.at_floor && policy.refactors) return Next::refactor;
  if (seen.solved) return Next::accept;
  return seen.corrections >= policy.most_corrections ? Next::give_up : Next::correct;
}

}  // namespace linden
