#include "kernels/values/body_lanes.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"

namespace linden::body_lanes_test {
namespace {

/// Every number of a field its own.
template <int Components>
Field<double, Components> numbered(Index rows) {
  Field<double, Components> field;
  field.allocate(rows);
  double next = 1;
  for (double& number : field.flat()) number = next++;
  return field;
}

template <template <class> class Value, int Components>
void check_turning() {
  for (const Index rows : {1, 2, 4, 8, 9, 16, 21}) {
    const auto field = numbered<Components>(rows + 2);
    Field<double, Components> copy;
    copy.allocate(rows + 2, -1.0);
    for_bodies<double>(1, rows + 1, [&](auto bodies, Index i) {
      scatter(bodies, copy, i, gather<Value>(bodies, field, i));
    });
    for (Index i = 0; i < rows + 2; ++i) {
      for (int k = 0; k < Components; ++k) {
        INFO(rows << " rows of " << Components << ": row " << i << ", number " << k);
        // what is not asked for is not touched: neither the row before nor the row behind
        CHECK(copy(i, k) == (i == 0 || i == rows + 1 ? -1 : field(i, k)));
      }
    }
  }
}

TEST_CASE("rows turned into lanes and back are the same rows, and no others are touched") {
  check_turning<Vec3, 3>();
  check_turning<Twist, 6>();
  check_turning<Displacement, 7>();
  check_turning<Placement, 12>();
}

TEST_CASE("a stretch of hinges that ends on a full register leaves the ball joint behind it alone") {
  // levels of 8 hinges, then a ball joint, in every order of kinds
  for (const std::uint64_t seed : {24u, 25u, 26u, 27u}) {
    for (const Index bodies : {3, 5, 9, 10, 17, 18}) {
      const Model model = random_tree({.bodies = bodies, .seed = seed, .frees = false});
      const PlainTree tree = reference::plain_tree(model);
      Rig<double> rig(model);
      rig.set(random_instance(tree, 3, 0.1));
      place(rig);
      Field<double> nothing = rig.work.delta;
      for (double& x : nothing.flat()) x = 0;
      const Field<double, 7> before = rig.work.motion;
      correct_motion_map(rig.tree, rig.constants, nothing, 1.0, rig.work.delta, rig.work.motion);
      for (Index i = 1; i < tree.slots(); ++i) {
        for (int k = 0; k < 7; ++k) CHECK(rig.work.motion(i, k) == before(i, k));
      }
    }
  }
}

TEST_CASE("a map over bodies gives each the same, in a register or alone") {
  Field<double, 6> field = numbered<6>(30), packed = field, alone = field;
  for_bodies<double>(1, 30, [&](auto bodies, Index i) {
    const auto V = gather<Twist>(bodies, field, i);
    scatter(bodies, packed, i, V + V);
  });
  for (Index i = 1; i < 30; ++i) {
    const auto V = load<Twist, double>(field, i);
    store(alone, i, V + V);
  }
  CHECK(packed == alone);
}

TEST_CASE("a scan meets every body once, in order, and several at once only where they are of one level") {
  for (const Model& model : {chain(30), balanced_tree(100, 3), balanced_tree(2000), random_tree({.bodies = 200, .seed = 5})}) {
    const Tree& tree = model.tree;
    for (const Slots slots : {Slots{1, tree.shape.slots}, Slots{2, tree.shape.slots - 3}, Slots{9, 10}}) {
      std::vector<Index> downward, upward;
      const auto many = [&](std::vector<Index>& met) {
        return [&](auto, Index i) {
          for (Index k = 0; k < kBodies; ++k) {
            met.push_back(i + k);
            CHECK(tree.level(i + k) == tree.level(i));
          }
        };
      };
      const auto few = [&](std::vector<Index>& met) {
        return [&](Slots part) {
          CHECK(part.begin < part.end);
          for (Index i = part.begin; i < part.end; ++i) met.push_back(i);
        };
      };
      for_same_level_down(tree, slots, many(downward), few(downward));
      CHECK(std::ranges::is_sorted(downward));
      std::vector<Index> blocks;  // where each of the upward blocks begins
      for_same_level_up(tree, slots, [&](auto bodies, Index i) { blocks.push_back(i), many(upward)(bodies, i); },
                     [&](Slots part) { blocks.push_back(part.begin), few(upward)(part); });
      CHECK(std::ranges::is_sorted(blocks, std::greater<>{}));
      std::ranges::sort(upward);
      CHECK(upward == downward);
      CHECK(static_cast<Index>(downward.size()) == slots.end - slots.begin);
      CHECK(downward.front() == slots.begin);
    }
  }
}

}  // namespace
}  // namespace linden::body_lanes_test
