#include "engine/solve/decide.hpp"

#include <catch2/catch.hpp>
#include <iterator>
#include <ostream>

namespace linden::decide_test {

std::ostream& operator<<(std::ostream& out, Next next) {
  constexpr const char* names[kNexts] = {"accept", "correct", "refactor", "cut", "take back", "update states", "continuation", "give up"};
  return out << names[static_cast<std::size_t>(next)];
}

namespace {

constexpr Policy alone{.most_corrections = 50,
                       .most_cuts = 10,
                       .refactors = true,
                       .one_state_at_a_time = 5,
                       .one_limit_at_a_time = 10,
                       .first_continuation = 5,
                       .last_continuation = 20,
                       .most_updates = 60};
constexpr Policy smooth_block{.most_corrections = 8, .judges_guess = false, .floor_test = FloorTest::after_slow_correction, .may_grow = 1};
constexpr Policy block{.most_corrections = 24, .floor_test = FloorTest::always, .may_grow = kAnyNumber, .most_updates = 24};

struct Row {
  const char* what;
  Policy policy;
  Seen seen;
  Next next;
};

const Row table[] = {
    // a tree that is stepped alone
    {"the guess is solved", alone, {.solved = true}, Next::accept},
    {"the guess is not", alone, {}, Next::correct},
    {"the guess turns a body too far", alone, {.usable = false}, Next::give_up},
    {"a correction turns a body too far", alone, {.usable = false, .corrected = true, .slow = true, .corrections = 1}, Next::cut},
    {"it still does after ten cuts", alone, {.usable = false, .corrected = true, .slow = true, .corrections = 1, .cuts = 10}, Next::take_back},
    {"a good correction", alone, {.corrected = true, .fell = true, .corrections = 1}, Next::correct},
    {"a good correction that solves", alone, {.solved = true, .corrected = true, .fell = true, .corrections = 1}, Next::accept},
    {"a slow correction", alone, {.corrected = true, .fell = true, .slow = true, .corrections = 1}, Next::refactor},
    {"a slow correction that solves", alone, {.solved = true, .corrected = true, .fell = true, .slow = true, .corrections = 1}, Next::refactor},
    {"a slow one at the floor", alone, {.solved = true, .at_floor = true, .corrected = true, .slow = true, .corrections = 1}, Next::accept},
    {"a held factor is too old", alone, {.corrected = true, .fell = true, .stale = true, .corrections = 1}, Next::refactor},
    {"after the factor was made anew", alone, {.slow = true, .fresh = true, .corrections = 1}, Next::correct},
    {"a correction that makes it worse", alone, {.corrected = true, .slow = true, .corrections = 3}, Next::cut},
    {"one that cuts do not help", alone, {.corrected = true, .slow = true, .corrections = 3, .cuts = 10}, Next::take_back},
    {"a held factor makes it worse", alone, {.corrected = true, .slow = true, .stale = true, .corrections = 1}, Next::take_back},
    {"a held factor turns a body too far", alone, {.usable = false, .corrected = true, .slow = true, .stale = true, .corrections = 1}, Next::take_back},
    {"taken back, with an old factor", alone, {.taken_back = true, .slow = true, .corrections = 3, .cuts = 10}, Next::refactor},
    {"taken back, with a fresh one", alone, {.taken_back = true, .slow = true, .fresh = true, .corrections = 3}, Next::give_up},
    {"taken back, to the floor", alone, {.solved = true, .at_floor = true, .taken_back = true, .slow = true, .fresh = true}, Next::accept},
    {"a state changes", alone, {.solved = true, .changed = true, .corrections = 2, .updates = 1}, Next::update_states},
    {"a state changes where the residual grew", alone, {.changed = true, .corrected = true, .slow = true, .updates = 2}, Next::update_states},
    {"states have changed five times", alone, {.solved = true, .updates = 5}, Next::continuation},
    {"and twenty times", alone, {.changed = true, .updates = 20}, Next::continuation},
    {"states that never settle", alone, {.solved = true, .changed = true, .updates = 60}, Next::give_up},
    {"too many corrections", alone, {.corrected = true, .fell = true, .corrections = 50}, Next::give_up},
    {"the last one solves", alone, {.solved = true, .corrected = true, .fell = true, .corrections = 50}, Next::accept},
    // an instance of a block
    {"block: the first correction makes it worse", smooth_block, {.corrected = true, .slow = true, .corrections = 1}, Next::correct},
    {"block: the second does", smooth_block, {.corrected = true, .slow = true, .corrections = 2}, Next::give_up},
    {"block: slow", smooth_block, {.corrected = true, .fell = true, .slow = true, .corrections = 2}, Next::correct},
    {"block: solved", smooth_block, {.solved = true, .corrected = true, .fell = true, .corrections = 1}, Next::accept},
    {"block: a body turns too far", smooth_block, {.usable = false, .corrected = true, .slow = true, .corrections = 1}, Next::give_up},
    {"block: the eighth does not solve", smooth_block, {.corrected = true, .fell = true, .corrections = 8}, Next::give_up},
    {"block with effects: worse", block, {.corrected = true, .slow = true, .corrections = 20}, Next::correct},
    {"block with effects: a state changes", block, {.solved = true, .changed = true, .updates = 23}, Next::update_states},
    {"block with effects: again and again", block, {.solved = true, .changed = true, .updates = 24}, Next::give_up},
    {"block with effects: and is not even solved", block, {.updates = 24}, Next::give_up},
};

TEST_CASE("what happens next follows from what is seen of an instance") {
  for (const Row& row : table) {
    INFO(row.what);
    CHECK(decide(row.policy, row.seen) == row.next);
  }
}

TEST_CASE("whatever is seen, a solve comes to an end") {
  // an adversary says at every turn what keeps the solve going longest; counters alone must stop it
  for (const Policy& policy : {alone, smooth_block, block}) {
    for (unsigned bits = 0; bits < 1u << 8; ++bits) {
      Seen seen;
      bool* const flags[] = {&seen.usable, &seen.solved, &seen.at_floor, &seen.changed, &seen.fell, &seen.slow, &seen.stale, &seen.fresh};
      for (std::size_t k = 0; k < std::size(flags); ++k) *flags[k] = (bits >> k & 1u) != 0;
      seen.changed = seen.changed && policy.most_updates < kAnyNumber;  // else there are no states
      int turns = 0;
      for (bool over = false; !over; ++turns) {
        REQUIRE(turns < 2000);
        switch (decide(policy, seen)) {
          case Next::accept:
          case Next::give_up: over = true; break;
          case Next::correct:
            seen.corrected = true;
            seen.taken_back = false;
            seen.corrections += 1;
            seen.cuts = 0;
            break;
          case Next::cut: seen.cuts += 1; break;
          case Next::take_back:
            seen.corrected = false;
            seen.taken_back = true;
            break;
          case Next::refactor:
            seen.corrected = seen.taken_back = false;
            break;
          case Next::update_states:
          case Next::continuation:
            seen.corrected = seen.taken_back = false;
            seen.updates += 1;
            break;
        }
      }
    }
  }
}

}  // namespace
}  // namespace linden::decide_test
