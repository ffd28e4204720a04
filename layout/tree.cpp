#include "layout/tree.hpp"

#include <stdexcept>
#include <string>

namespace linden {

JointKind Tree::kind(Index slot) const {
  for (const Run& run : runs) {
    if (slot >= run.begin && slot < run.end) return run.kind;
  }
  throw std::out_of_range("slot " + std::to_string(slot) + " holds no joint: slots go from 1 to " +
                          std::to_string(bodies()));
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
  tree.level_begin = {0, 1};
  Index q = 0, v = 0, block = 0;
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Index nv = velocity_count(kind[at]);
    if (parent[at] < 0 || parent[at] >= i) {
      throw std::invalid_argument("slot " + std::to_string(i) + " has parent " + std::to_string(parent[at]) +
                                  ": parents must come before their children");
    }
    tree.parent(i) = parent[at];
    tree.level(i) = tree.level(parent[at]) + 1;
    if (tree.level(i) < tree.level(i - 1)) {
      throw std::invalid_argument("slot " + std::to_string(i) + " is out of order: bodies are sorted by level");
    }
    if (tree.level(i) > tree.level(i - 1) && i > 1) tree.level_begin.push_back(i);
    tree.first_q(i) = q;
    tree.first_v(i) = v;
    tree.first_block(i) = block;
    q += position_count(kind[at]);
    v += nv;
    block += nv * nv;
    if (tree.runs.empty() || tree.runs.back().kind != kind[at]) tree.runs.push_back({i, i, kind[at]});
    tree.runs.back().end = i + 1;
  }
  for (Index& flag : tree.is_leaf.flat()) flag = 1;
  for (Index i = tree.shape.slots - 1; i > 0; --i) {
    tree.is_last_child(i) = tree.is_leaf(tree.parent(i));
    tree.is_leaf(tree.parent(i)) = 0;
  }
  if (tree.shape.slots > 1) tree.level_begin.push_back(tree.shape.slots);
  return tree;
}

}  // namespace linden
