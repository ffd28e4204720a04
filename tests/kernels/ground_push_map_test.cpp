#include "kernels/queries/ground_push_map.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/lanes.hpp"

namespace linden::ground_push_map_test {
namespace {

constexpr double kStiffness = 1000, kDamping = 20;

/// Two balls of radius 0.1 a metre apart on body 1, and one on body 2.
GroundPlan plan() {
  GroundPlan plan;
  plan.ground.stiffness = kStiffness;
  plan.ground.damping = kDamping;
  plan.frame = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  plan.points = {{.slot = 1, .center = {-0.5, 0, 0}, .radius = 0.1}, {.slot = 1, .center = {0.5, 0, 0}, .radius = 0.1},
                 {.slot = 2, .center = {0, 0, 0}, .radius = 0.1}};
  return plan;
}

/// Points and force of body 1 at a height, tilted about y, with a speed along z and a turn about y, body frame.
template <class S>
std::array<S, 2> pushed(const S& height, const S& cosine, const S& sine, const S& speed, const S& turn) {
  const GroundPlan ground = plan();
  Field<S, 12> pose;
  pose.allocate(3);
  GroundPoints<S> points;
  points.allocate({.slots = 3});
  const S zero(0.0), one(1.0);
  for (Index i = 0; i < 3; ++i) {
    store(pose, i, Placement<S>{{{cosine, zero, sine}, {zero, one, zero}, {-sine, zero, cosine}}, {zero, zero, height}});
  }
  find_ground(ground, pose, points);
  const GroundPush<S> push = ground_push_map(ground, 1, Twist<S>{{zero, turn, zero}, {zero, zero, speed}}, points);
  return {push.points, push.force};
}

TEST_CASE("the ground pushes by the depth of each point and by how fast it sinks, and never pulls") {
  CHECK(pushed(0.11, 1.0, 0.0, -1.0, 0.0) == std::array{0.0, 0.0});
  const auto still = pushed(0.09, 1.0, 0.0, 0.0, 0.0);
  CHECK(still[0] == 2);
  CHECK(std::abs(still[1] - 2 * kStiffness * 0.01) < 1e-12);
  const auto sinking = pushed(0.09, 1.0, 0.0, -0.1, 0.0);
  CHECK(std::abs(sinking[1] - 2 * (kStiffness * 0.01 + kDamping * 0.1)) < 1e-12);
  // faster away than the spring pushes
  CHECK(pushed(0.09, 1.0, 0.0, 1.0, 0.0) == std::array{2.0, 0.0});
  // a turn about y at 0.4 rad/s takes the ball at +0.5 down at 0.2 m/s, and the other up
  const auto turning = pushed(0.09, 1.0, 0.0, 0.0, 0.4);
  CHECK(std::abs(turning[1] - 2 * kStiffness * 0.01) < 1e-12);
  // tilted by asin 0.6: one ball is 0.3 m lower, the other 0.3 m higher
  const auto tilted = pushed(0.39, 0.8, 0.6, 0.0, 0.0);
  CHECK(tilted[0] == 1);
  CHECK(std::abs(tilted[1] - kStiffness * 0.01) < 1e-10);
}

TEST_CASE("ground_push_map gives each lane its own") {
  const double heights[] = {0.05, 0.09, 0.11, 0.2}, speeds[] = {-1, -0.1, 0, 2};
  for (std::size_t shift = 0; shift < 4; ++shift) {
    Pack height(0.0), speed(0.0);
    for (std::size_t l = 0; l < Pack::size; ++l) {
      set_lane(height, l, heights[(l + shift) % 4]);
      set_lane(speed, l, speeds[(l / 2 + shift) % 4]);
    }
    const auto packed = pushed(height, Pack(1.0), Pack(0.0), speed, Pack(0.25));
    for (std::size_t l = 0; l < Pack::size; ++l) {
      const auto alone = pushed(lane(height, l), 1.0, 0.0, lane(speed, l), 0.25);
      CHECK(lane(packed[0], l) == alone[0]);
      CHECK(std::abs(lane(packed[1], l) - alone[1]) < 1e-12);
    }
  }
}

}  // namespace
}  // namespace linden::ground_push_map_test
