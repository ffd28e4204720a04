#include "kernels/collision/broad_phase.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <limits>
#include <vector>

#include "tests/kernels/allocation_counter.hpp"
#include "tests/reference/convex_plain.hpp"
#include "tests/reference/random_convex.hpp"

namespace linden::broad_phase_test {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

std::vector<Bounds> random_bounds(Random& random, int count, const std::array<double, 3>& spread) {
  std::vector<Bounds> bounds;
  for (int k = 0; k < count; ++k) {
    Bounds box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = random.uniform(-1, 1) * spread[axis];
      box.high[axis] = box.low[axis] + random.uniform(0, 0.3);
    }
    bounds.push_back(box);
  }
  return bounds;
}

Pairs all_pairs(const std::vector<Bounds>& bounds, double margin) {
  Pairs pairs;
  for (std::uint32_t a = 0; a < bounds.size(); ++a) {
    for (std::uint32_t b = a + 1; b < bounds.size(); ++b) {
      bool meet = true;
      for (std::size_t k = 0; k < 3; ++k) {
        meet = meet && bounds[a].low[k] <= bounds[b].high[k] + margin && bounds[b].low[k] <= bounds[a].high[k] + margin;
      }
      if (meet) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

TEST_CASE("the pairs of a broad phase are those that meet, in order, whatever axis they are sorted along") {
  Random random(1);
  BroadPhase phase;
  for (const std::array<double, 3>& spread : {std::array{1.0, 1.0, 1.0}, {10.0, 0.1, 0.1}, {0.0, 5.0, 0.0}, {0.0, 0.1, 3.0}, {0.0, 0.0, 0.0}}) {
    for (const int count : {0, 1, 2, 100}) {
      const auto bounds = random_bounds(random, count, spread);
      for (const double margin : {0.0, 0.05}) {
        const auto pairs = phase.pairs(bounds, margin);
        CHECK(Pairs(pairs.begin(), pairs.end()) == all_pairs(bounds, margin));
      }
    }
  }
}

TEST_CASE("boxes without end meet all that they are not seen to be beside, and do not change what is found of the others") {
  Random random(4);
  BroadPhase phase;
  auto bounds = random_bounds(random, 60, {5, 1, 1});
  const auto alone = phase.pairs(bounds, 0.05);
  const Pairs others(alone.begin(), alone.end());
  constexpr double kEnd = std::numeric_limits<double>::infinity();
  bounds.push_back({{-kEnd, -kEnd, -kEnd}, {kEnd, kEnd, 0.5}});
  bounds.push_back({{-kEnd, -kEnd, -kEnd}, {kEnd, kEnd, kEnd}});
  bounds.push_back({{1, -kEnd, -kEnd}, {kEnd, kEnd, kEnd}});
  const auto found = phase.pairs(bounds, 0.05);
  const Pairs all(found.begin(), found.end());
  CHECK(all == all_pairs(bounds, 0.05));
  Pairs rest = all;
  std::erase_if(rest, [](const auto& pair) { return pair.second >= 60; });
  CHECK(rest == others);
  CHECK(all.size() > others.size() + 100);
  CHECK(all.size() < others.size() + 3 * 60 + 3);
}

TEST_CASE("a plane has bounds where it lies square to an axis") {
  const ConvexShape plane{.kind = ConvexKind::plane};
  constexpr double kEnd = std::numeric_limits<double>::infinity();
  const auto bounds = [&](const Eigen::Matrix3d& R) { return bounds_of(plane, reference::pose_at(R, {1, 2, 3})); };
  const Bounds level = bounds(Eigen::Matrix3d::Identity());
  CHECK(level.high == std::array{kEnd, kEnd, 3.0});
  CHECK(level.low == std::array{-kEnd, -kEnd, -kEnd});
  Eigen::Matrix3d R;
  R << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  CHECK(bounds(R).low == std::array{1.0, -kEnd, -kEnd});
  CHECK(bounds(R).high == std::array{kEnd, kEnd, kEnd});
  const Bounds tilted = bounds(Eigen::AngleAxisd(1e-6, Eigen::Vector3d::UnitX()).toRotationMatrix());
  CHECK(tilted.high == std::array{kEnd, kEnd, kEnd});
}

TEST_CASE("a broad phase that has seen as many allocates nothing") {
  Random random(2);
  BroadPhase phase;
  const auto bounds = random_bounds(random, 200, {1, 1, 1});
  phase.pairs(bounds, 0.1);
  const AllocationCounter allocations;
  phase.pairs(bounds, 0.05);
  CHECK(allocations.count() == 0);
}

TEST_CASE("the bounds of a shape are how far it reaches along the world's axes") {
  Random random(3);
  for (int kind = 0; kind < reference::kRandomKinds; ++kind) {
    const ConvexShape shape = reference::random_shape(random, kind);
    const Pose pose = reference::pose_at(random.rotation().toRotationMatrix(), {1, 2, 3});
    const auto plain = reference::plain_convex(shape, pose);
    const Bounds bounds = bounds_of(shape, pose);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d n = Eigen::Vector3d::Unit(axis);
      CHECK(std::abs(bounds.high[static_cast<std::size_t>(axis)] - plain.reach(n)) < 1e-15 * 8);
      CHECK(std::abs(bounds.low[static_cast<std::size_t>(axis)] + plain.reach(-n)) < 1e-15 * 8);
    }
  }
}

}  // namespace
}  // namespace linden::broad_phase_test
