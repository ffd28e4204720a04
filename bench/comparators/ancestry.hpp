// bench/comparators/ancestry.hpp
// Who lies above and below whom: what evaluations in generalized coordinates sum over. A body's velocity depends on the joints of
// its path, a joint's coordinate moves the bodies of its subtree.
//
// path(i)     slots from the root's child down to i itself
// subtree(i)  slot i and all its descendants, parents before children
// first(i)    where the pairs (i, path(i)) begin in an array of all pairs; pairs() of them: n (n + 1) / 2 of a chain
#pragma once

#include <span>
#include <vector>

#include "layout/tree.hpp"

namespace linden::comparators {

class Ancestry {
 public:
  explicit Ancestry(const Tree& tree);

  std::span<const Index> path(Index i) const { return of(path_, path_begin_, i); }
  std::span<const Index> subtree(Index i) const { return of(subtree_, subtree_begin_, i); }
  std::size_t first(Index i) const { return path_begin_[static_cast<std::size_t>(i)]; }
  std::size_t pairs() const { return path_.size(); }

 private:
  static std::span<const Index> of(const std::vector<Index>& all, const std::vector<std::size_t>& begin, Index i) {
    const auto at = static_cast<std::size_t>(i);
    return {all.data() + begin[at], begin[at + 1] - begin[at]};
  }

  std::vector<Index> path_, subtree_;
  std::vector<std::size_t> path_begin_, subtree_begin_;  // [slots + 1]
};

}  // namespace linden::comparators
