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

/// A branch ends where no body from there on has its parent in it, and where the next such end would make it too large.
void find_branches(Tree& tree) {
  const Index slots = tree.shape.slots;
  tree.trunk = {1, slots};
  if (tree.bodies() <= kBranch) return;
  const std::vector<Index> size = subtree_sizes(tree.parent.flat(), 1);
  while (tree.trunk.end > 1 && size[at(tree.trunk.end - 1)] <= kTwig) tree.trunk.end -= 1;
  std::vector<Index> last_child(at(slots), 0);
  for (Index i = 1; i < slots; ++i) last_child[at(tree.parent(i))] = i;
  Index end = tree.trunk.end;  // of the branches so far
  for (Index i = end, last = i; i < slots; ++i) {
    last = std::max({last, i, last_child[at(i)]});
    if (last > i) continue;
    if (tree.branches.empty() || i + 1 - tree.branches.back().begin > kBranch) tree.branches.push_back({end, end});
    tree.branches.back().end = end = i + 1;
  }
}

/// As few rows as the bodies need that wait at the same time, and those that were used last.
void share_rows(Tree& tree) {
  std::vector<Index> free;
  Index rows = 0;
  for (Index i = tree.shape.slots - 1; i > 0; --i) {
    if (tree.is_leaf(i) == 0) free.push_back(tree.waiting(i));
    if (tree.is_last_child(i) == 0) continue;
    if (free.empty()) free.push_back(rows++);
    tree.waiting(tree.parent(i)) = free.back();
    free.pop_back();
  }
}

}  // namespace

Index Tree::levels() const { return *std::ranges::max_element(level.flat()) + 1; }

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
  share_rows(tree);
  find_branches(tree);
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
  std::vector<Place> places;
  Index branch = 0, room = 0;
  for (Index i = 0; i < bodies; ++i) {
    const Place* above = parent[at(i)] < 0 ? nullptr : &places[at(parent[at(i)])];
    Place place{0, above ? above->level + 1 : 1, kind[at(i)], i};
    if (above && above->branch > 0) {
      place.branch = above->branch;
    } else if (in_pieces && size[at(i)] <= kTwig) {
      if (size[at(i)] > room) branch += 1, room = kBranch;
      room -= size[at(i)];
      place.branch = branch;
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
