#include "layout/tree.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "models/build/generators.hpp"
#include "models/build/merged_models.hpp"

namespace linden::tree_test {
namespace {

std::vector<Model> large_trees() {
  std::vector<Model> models;
  models.push_back(balanced_tree(5000));
  models.push_back(balanced_tree(3000, 7));
  models.push_back(random_tree({.bodies = 4000, .seed = 1}));
  models.push_back(chain(2000));
  models.push_back(humanoids(100));
  models.push_back(balanced_tree(1 + 3 * kBranch, 3 * kBranch));
  const Model part = humanoids(30);
  models.push_back(merged({{part, "a"}, {part, "b"}}, "two crowds"));
  return models;
}

bool sorted(const Tree& tree, Slots slots) {
  for (Index i = slots.begin + 1; i < slots.end; ++i) {
    if (std::pair(tree.level(i), tree.kind(i)) < std::pair(tree.level(i - 1), tree.kind(i - 1))) return false;
  }
  return true;
}

TEST_CASE("a large tree is a trunk and branches that hang in themselves or on the trunk") {
  for (const Model& model : large_trees()) {
    const Tree& tree = model.tree;
    INFO(model.names.model);
    REQUIRE_FALSE(tree.branches.empty());
    CHECK(tree.trunk.begin == 1);
    CHECK(sorted(tree, tree.trunk));
    Index end = tree.trunk.end;
    for (const Slots branch : tree.branches) {
      CHECK(branch.begin == end);
      CHECK(branch.end - branch.begin <= kBranch);
      end = branch.end;
      for (Index i = branch.begin; i < branch.end; ++i) {
        const Index parent = tree.parent(i);
        if (parent >= tree.trunk.end && (parent < branch.begin || parent >= i)) FAIL("slot " << i << " hangs on slot " << parent);
      }
    }
    CHECK(end == tree.shape.slots);
  }
}

TEST_CASE("subtrees of a branch lie level by level, so that its levels are wide") {
  const Tree tree = balanced_tree(5000).tree;
  for (const Slots branch : tree.branches) CHECK(sorted(tree, branch));
  CHECK(tree.branches.size() == 5);
  CHECK(tree.trunk.end - 1 < 5000 / kTwig * 2);
}

TEST_CASE("a tree of no more than a branch is sorted by level and kind all through") {
  for (const Model& model : {balanced_tree(kBranch), random_tree({.bodies = kBranch, .seed = 2}), humanoids(10)}) {
    const Tree& tree = model.tree;
    CHECK(tree.branches.empty());
    CHECK(tree.trunk == Slots{1, tree.shape.slots});
    CHECK(sorted(tree, tree.trunk));
  }
}

TEST_CASE("every slot knows its run, and the roots are those that hang on the world") {
  for (const Model& model : large_trees()) {
    const Tree& tree = model.tree;
    Index roots = 0;
    for (Index i = 1; i < tree.shape.slots; ++i) {
      const Run& run = tree.runs[static_cast<std::size_t>(tree.run(i))];
      if (i < run.begin || i >= run.end || run.kind != tree.kind(i)) FAIL("slot " << i);
      roots += tree.parent(i) == 0 ? 1 : 0;
    }
    CHECK(static_cast<Index>(tree.roots().size()) == roots);
  }
}

TEST_CASE("no two bodies whose children have passed something share a row while they wait, and rows are few") {
  for (const Model& model : large_trees()) {
    const Tree& tree = model.tree;
    INFO(model.names.model);
    std::set<Index> taken;
    std::size_t most = 0;
    for (Index i = tree.shape.slots - 1; i > 0; --i) {
      if (tree.is_leaf(i) == 0) CHECK(taken.erase(tree.pending(i)) == 1);
      if (tree.is_last_child(i) != 0 && !taken.insert(tree.pending(tree.parent(i))).second) FAIL("slot " << i);
      most = std::max(most, taken.size());
    }
    CHECK(taken == std::set{tree.pending(0)});
    CHECK(most < static_cast<std::size_t>(tree.bodies() / 4));  // random trees, the widest, have a fifth of their bodies pending at once
  }
}

TEST_CASE("children of one body of the trunk are in one branch where they fit there, and trees know where they do") {
  for (const Model& model : large_trees()) {
    const Tree& tree = model.tree;
    INFO(model.names.model);
    std::vector<std::set<Index>> below(static_cast<std::size_t>(tree.trunk.end));  // branches that children of a body are in
    std::vector<Index> children(below.size());
    for (const Slots branch : tree.branches) {
      for (Index i = branch.begin; i < branch.end; ++i) {
        if (tree.parent(i) >= tree.trunk.end) continue;
        below[static_cast<std::size_t>(tree.parent(i))].insert(branch.begin);
        children[static_cast<std::size_t>(tree.parent(i))] += 1;
      }
    }
    bool apart = below.front().empty();
    for (std::size_t i = 0; i < below.size(); ++i) {
      apart = apart && below[i].size() <= 1;
      if (children[i] * kTwig <= kBranch) CHECK(below[i].size() <= 1);
    }
    CHECK(tree.branches_apart == apart);
  }
  CHECK(balanced_tree(5000).tree.branches_apart);
  CHECK(balanced_tree(5000).tree.most_threads() >= 4);
  CHECK(balanced_tree(2000).tree.most_threads() == 1);
  CHECK(humanoids(200).tree.most_threads() == 1);
  CHECK(random_tree({.bodies = 4000, .seed = 1}).tree.branches_apart);
  CHECK_FALSE(humanoids(100).tree.branches_apart);
  CHECK_FALSE(balanced_tree(1 + 3 * kBranch, 3 * kBranch).tree.branches_apart);
}

TEST_CASE("bodies of branches wait in rows that none of the trunk has") {
  for (const Model& model : large_trees()) {
    const Tree& tree = model.tree;
    INFO(model.names.model);
    Index end = 0;  // of the rows of the trunk
    for (Index i = 0; i < tree.trunk.end; ++i) {
      if (tree.is_leaf(i) == 0) end = std::max(end, tree.pending(i) + 1);
    }
    Slots third{0, 0};
    third.branch = tree.trunk.end;
    third.pending_offset = 2 * tree.pending_rows;
    for (Index i = tree.trunk.end; i < tree.shape.slots; ++i) {
      if (tree.is_leaf(i) != 0) continue;
      if (tree.pending(i) < end || tree.pending(i) >= end + tree.pending_rows) FAIL("slot " << i);
      if (tree.pending_row(third, i) != tree.pending(i) + third.pending_offset) FAIL("slot " << i);
    }
    CHECK(tree.pending_row(third, 0) == tree.pending(0));
  }
}

TEST_CASE("an order in which a child comes before its parent is refused") {
  CHECK_THROWS_AS(Tree::from_sorted({0, 2, 0}, {JointKind::screw, JointKind::screw, JointKind::screw}), std::invalid_argument);
}

}  // namespace
}  // namespace linden::tree_test
