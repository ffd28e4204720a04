#include "layout/tree.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

namespace linden {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Bodies in the subtree of each, itself among them. parent: below `first` where there is none.
std::vector<Index> subtree_sizes(std::span<const Index> parent, Index first) {
  std::vector<Index> size(parent.size(), 1);
  for (std::size_t i = parent.size(); i-- > 0;) {
    if (parent[i] >= first) size[at(parent[i])] += size[i];
  }
  return size;
}

/// Slot of the first and last child of each body; 0 where it has none.
struct Children {
  std::vector<Index> first, last;
};

Children children_of(const Tree& tree) {
  Children children{std::vector<Index>(at(tree.shape.slots), 0), std::vector<Index>(at(tree.shape.slots), 0)};
  for (Index i = 1; i < tree.shape.slots; ++i) {
    Index& first = children.first[at(tree.parent(i))];
    if (first == 0) first = i;
    children.last[at(tree.parent(i))] = i;
  }
  return children;
}

/// A branch ends where no body from there on has its parent in it, nor a brother of his own in it where all of them fit in a branch, and
/// where the next such end would make it too large.
void find_branches(Tree& tree) {
  const Index slots = tree.shape.slots;
  tree.trunk = {1, slots};
  if (tree.bodies() <= kBranch) return;
  const std::vector<Index> size = subtree_sizes(tree.parent.flat(), 1);
  while (tree.trunk.end > 1 && size[at(tree.trunk.end - 1)] <= kTwig) tree.trunk.end -= 1;
  const Children children = children_of(tree);
  const auto first_in_branches = [&](Index parent) { return std::max(children.first[at(parent)], tree.trunk.end); };
  Index end = tree.trunk.end;  // of the branches so far
  for (Index i = end, last = i; i < slots; ++i) {
    const Index parent = tree.parent(i);
    last = std::max({last, i, children.last[at(i)]});
    if (const Index brother = children.last[at(parent)]; brother - first_in_branches(parent) < kBranch) last = std::max(last, brother);
    if (last > i) continue;
    if (tree.branches.empty() || i + 1 - tree.branches.back().begin > kBranch) tree.branches.push_back({end, end});
    tree.branches.back().end = end = i + 1;
  }
}

bool are_apart(const Tree& tree) {
  std::vector<Index> branch_below(at(tree.trunk.end), -1);
  Index number = 0;
  for (const Slots branch : tree.branches) {
    for (Index i = branch.begin; i < branch.end; ++i) {
      if (tree.parent(i) == 0) return false;  // what goes up to the world is cleared by whoever comes first
      if (tree.parent(i) >= tree.trunk.end) continue;
      Index& below = branch_below[at(tree.parent(i))];
      if (below >= 0 && below != number) return false;
      below = number;
    }
    number += 1;
  }
  return true;
}

/// Rows for bodies that wait, given as a sweep goes up: those that were used last first.
class WaitingRows {
 public:
  explicit WaitingRows(Index first) : first_(first), end_(first) {}
  Index take() {
    if (free_.empty()) free_.push_back(end_++);
    const Index row = free_.back();
    free_.pop_back();
    return row;
  }
  void give_back(Index row) {
    if (row >= first_) free_.push_back(row);
  }
  Index end() const { return end_; }

 private:
  Index first_, end_;
  std::vector<Index> free_;
};

/// As few rows as the bodies need that wait at the same time: those of the trunk first, then those of a branch.
void share_rows(Tree& tree) {
  WaitingRows trunk(0);
  for (Index i = tree.shape.slots - 1; i > 0; --i) {
    const Index parent = tree.parent(i);
    if (i < tree.trunk.end && tree.is_leaf(i) == 0) trunk.give_back(tree.pending(i));
    if (parent < tree.trunk.end && tree.is_last_child(i) != 0) tree.pending(parent) = trunk.take();
  }
  for (const Slots branch : tree.branches) {
    WaitingRows rows(trunk.end());
    for (Index i = branch.end - 1; i >= branch.begin; --i) {
      const Index parent = tree.parent(i);
      if (tree.is_leaf(i) == 0) rows.give_back(tree.pending(i));
      if (parent >= branch.begin && tree.is_last_child(i) != 0) tree.pending(parent) = rows.take();
    }
    tree.pending_rows = std::max(tree.pending_rows, rows.end() - trunk.end());
  }
}

}  // namespace

Index Tree::levels() const { return *std::ranges::max_element(level.flat()) + 1; }

Index Tree::most_threads() const {
  if (!branches_apart || branches.size() < kFewestBranches) return 1;
  const Index in_branches = shape.slots - trunk.end;
  return std::max(1, std::min(in_branches / kBranch, in_branches / std::max(1, pending_rows)));
}

std::vector<Index> Tree::roots() const {
  std::vector<Index> slots;
  for (Index i = 1; i < shape.slots; ++i) {
    if (parent(i) == 0) slots.push_back(i);
  }
  return slots;
}

Tree Tree::from_sorted(const std::vector<Index>& parent, const std::vector<JointKind>& kind) {
  Tree tree;
  tree.shape.slots = static_cast<Index>(parent.size());
  for (std::size_t i = 1; i < parent.size(); ++i) {
    const Index nv = velocity_count(kind[i]);
    tree.shape.positions += position_count(kind[i]);
    tree.shape.velocities += nv;
    tree.shape.blocks += nv * nv;
  }
  tree.allocate(tree.shape);
  Index q = 0, v = 0, block = 0, abreast = 0;
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const Index nv = velocity_count(kind[at(i)]);
    if (parent[at(i)] < 0 || parent[at(i)] >= i) {
      throw std::invalid_argument("slot " + std::to_string(i) + " has parent " + std::to_string(parent[at(i)]) +
                                  ": parents must come before their children");
    }
    tree.parent(i) = parent[at(i)];
    tree.level(i) = tree.level(parent[at(i)]) + 1;
    tree.first_q(i) = q;
    tree.first_v(i) = v;
    tree.first_block(i) = block;
    q += position_count(kind[at(i)]);
    v += nv;
    block += nv * nv;
    if (tree.runs.empty() || tree.runs.back().kind != kind[at(i)]) tree.runs.push_back({i, i, kind[at(i)]});
    Run& run = tree.runs.back();
    abreast = i > run.begin && tree.level(i) == tree.level(i - 1) ? abreast + 1 : 1;
    run.widest = std::max(run.widest, abreast);
    run.end = i + 1;
    tree.run(i) = static_cast<Index>(tree.runs.size()) - 1;
  }
  for (Index& flag : tree.is_leaf.flat()) flag = 1;
  for (Index i = tree.shape.slots - 1; i > 0; --i) {
    tree.is_last_child(i) = tree.is_leaf(tree.parent(i));
    tree.is_leaf(tree.parent(i)) = 0;
  }
  find_branches(tree);
  tree.branches_apart = are_apart(tree);
  share_rows(tree);
  return tree;
}

std::vector<Index> sorted_bodies(const std::vector<Index>& parent, const std::vector<JointKind>& kind) {
  struct Place {
    Index branch, level;  // branch 0: the trunk
    JointKind kind;
    Index body;
  };
  const auto bodies = static_cast<Index>(parent.size());
  const bool in_pieces = bodies > kBranch;
  const std::vector<Index> size = subtree_sizes(parent, 0);
  // of bodies with small subtrees, by their parent, the world first: how many bodies, and the branch that they have all been given
  std::vector<Index> brothers(at(bodies + 1), 0), branch_of_brothers(at(bodies + 1), 0);
  for (Index i = 0; i < bodies; ++i) brothers[at(parent[at(i)] + 1)] += size[at(i)] <= kTwig ? size[at(i)] : 0;
  std::vector<Place> places;
  Index branch = 0, room = 0;
  const auto branch_for = [&](Index count) {
    if (count > room) branch += 1, room = kBranch;
    room -= count;
    return branch;
  };
  for (Index i = 0; i < bodies; ++i) {
    const Place* above = parent[at(i)] < 0 ? nullptr : &places[at(parent[at(i)])];
    const std::size_t family = at(parent[at(i)] + 1);
    Place place{0, above ? above->level + 1 : 1, kind[at(i)], i};
    if (above && above->branch > 0) {
      place.branch = above->branch;
    } else if (in_pieces && size[at(i)] <= kTwig) {
      if (brothers[family] > kBranch) {
        place.branch = branch_for(size[at(i)]);
      } else {
        if (branch_of_brothers[family] == 0) branch_of_brothers[family] = branch_for(brothers[family]);
        place.branch = branch_of_brothers[family];
      }
    }
    places.push_back(place);
  }
  std::ranges::stable_sort(places, [](const Place& a, const Place& b) {
    return std::tie(a.branch, a.level, a.kind) < std::tie(b.branch, b.level, b.kind);
  });
  std::vector<Index> order;
  for (const Place& place : places) order.push_back(place.body);
  return order;
}

}  // namespace linden
