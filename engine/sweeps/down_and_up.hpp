// engine/sweeps/down_and_up.hpp
// In which order sweeps go over a tree, so that what one leaves in the cache is there for the next, and by whom.
//
//   trunk down    branch down, branch up    branch down, branch up    ...    trunk up
//
// All sweeps of one direction go over a part before the next part. Branches that are apart (layout/tree.hpp) are shared by the threads of
// the task arena; each has rows of its own (Slots), and sums are added up one branch after the other, whoever found them, so that no bit
// depends on how many there are.
#pragma once

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <vector>

#include "layout/tree.hpp"

namespace linden {

/// Bodies that all sweeps of one direction go over before the next part: a branch in one go. On a chain of 1,000 parts of 64 to all of
/// it do alike, on one of 10,000 parts of 64 take 5 % more: the longer each array is read on, the better the processor reads ahead.
inline constexpr Index kPart = kBranch;

/// action(part) for parts of some slots, root to leaves.
template <class Action>
void in_parts_down(Slots slots, const Action& action) {
  for (Index begin = slots.begin; begin < slots.end; begin += kPart) action(slots.part(begin, std::min(begin + kPart, slots.end)));
}

/// The same, leaves to root.
template <class Action>
void in_parts_up(Slots slots, const Action& action) {
  for (Index end = slots.end; end > slots.begin; end -= kPart) action(slots.part(std::max(slots.begin, end - kPart), end));
}

/// Sum: what a part of the tree gives; sum.add(more) adds what another does.
template <class Sum>
class DownAndUp {
 public:
  explicit DownAndUp(const Tree& tree) : tree_(tree), most_threads_(tree.most_threads()), of_branches_(tree.branches.size()) {}

  /// down(part, sum) and up(part, sum) over all of the tree. Where the last branch comes first, bodies of the trunk meet their children in
  /// the order of a sweep over the whole tree, which Tree::is_last_child asks for where branches are not apart. share: branches take the
  /// same rows of arrays.
  template <class Down, class Up>
  Sum run(bool last_first, bool share, const Down& down, const Up& up) {
    Sum sum;
    if (tree_.trunk.begin == tree_.trunk.end) down(tree_.trunk, sum);  // what starts at the world
    in_parts_down(tree_.trunk, [&](Slots part) { down(part, sum); });
    const std::size_t count = of_branches_.size();
    std::atomic<std::size_t> next = 0;
    const auto go_through = [&](Index thread) {
      for (std::size_t number; (number = next.fetch_add(1, std::memory_order_relaxed)) < count;) {
        Slots slots = tree_.branches[last_first ? count - 1 - number : number];
        slots.branch = slots.begin;
        if (share) slots.back = slots.begin - tree_.trunk.end - thread * kBranch;
        slots.pending_offset = thread * tree_.pending_rows;
        Sum own;
        in_parts_down(slots, [&](Slots part) { down(part, own); });
        in_parts_up(slots, [&](Slots part) { up(part, own); });
        of_branches_[number] = own;
      }
    };
    namespace tbb = oneapi::tbb;
    const Index threads = most_threads_ == 1 ? 1 : std::min<Index>(most_threads_, tbb::this_task_arena::max_concurrency());
    if (threads == 1) {
      go_through(0);
    } else {
      // isolated: who waits here must not begin with another instance, which may need this very memory
      tbb::this_task_arena::isolate([&] { tbb::parallel_for(Index{0}, threads, go_through, tbb::simple_partitioner{}); });
    }
    for (const Sum& own : of_branches_) sum.add(own);
    in_parts_up(tree_.trunk, [&](Slots part) { up(part, sum); });
    return sum;
  }

 private:
  const Tree& tree_;
  Index most_threads_;
  std::vector<Sum> of_branches_;
};

}  // namespace linden
