#include "bench/comparators/ancestry.hpp"

#include <algorithm>

namespace linden::comparators {

Ancestry::Ancestry(const Tree& tree) {
  const auto slots = static_cast<std::size_t>(tree.shape.slots);
  path_begin_.assign(slots + 1, 0);
  std::vector<std::vector<Index>> below(slots);
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const auto begin = static_cast<std::ptrdiff_t>(path_.size());
    path_begin_[static_cast<std::size_t>(i)] = path_.size();
    for (Index j = i; j != 0; j = tree.parent(j)) {
      path_.push_back(j);
      below[static_cast<std::size_t>(j)].push_back(i);
    }
    std::reverse(path_.begin() + begin, path_.end());
  }
  path_begin_[slots] = path_.size();
  for (const std::vector<Index>& bodies : below) {
    subtree_begin_.push_back(subtree_.size());
    subtree_.insert(subtree_.end(), bodies.begin(), bodies.end());
  }
  subtree_begin_.push_back(subtree_.size());
}

}  // namespace linden::comparators
