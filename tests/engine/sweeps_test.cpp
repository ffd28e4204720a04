#include <catch2/catch.hpp>

#include <cmath>
#include <set>
#include <string>

#include "engine/effects/effect_plan.hpp"
#include "engine/sweeps/sweep_cost.hpp"
#include "engine/sweeps/sweeps.hpp"
#include "models/build/builder.hpp"
#include "models/build/generators.hpp"

namespace linden {
namespace {

std::multiset<std::string> names_of(const std::vector<Sweep>& sweeps) {
  std::multiset<std::string> names;
  for (const Sweep& sweep : sweeps) names.insert(std::string(sweep.name));
  return names;
}

}  // namespace

TEST_CASE("a scene's schedule holds the sweeps of the effects it names and no others") {
  const Model model = chain(3);
  const Options options;
  const auto plain = names_of(sweeps_of(model, options, EffectPlan(model, options, {})));
  const std::vector<std::string> joint{"joint_impulses_map", "joint_impulses_end_map", "end_reading"},
      body{"add_given_up", "world_placement_down", "end_reading"};
  const auto check_added = [&](const Effects& effects, std::vector<std::string> sweeps) {
    std::multiset<std::string> expected = plain;
    expected.insert(sweeps.begin(), sweeps.end());
    const EffectPlan plan(model, options, effects);
    CHECK(names_of(sweeps_of(model, options, plan)) == expected);
    CHECK(plan.any());
  };
  const auto with = [](std::vector<std::string> some, const std::vector<std::string>& more) {
    some.insert(some.end(), more.begin(), more.end());
    return some;
  };
  CHECK_FALSE(EffectPlan(model, options, {}).any());
  Effects armature, spring, dead_zone, damping, friction, limits, servo, limited, torque, drag, wrench, ground, empty_ground;
  armature.armature = {{.row = 0, .inertia = 1}};
  spring.springs = {{.row = 0, .stiffness = 1}};
  dead_zone.dead_zone_springs = {{.row = 0, .stiffness = 1, .half_width = 0.1}};
  damping.damping = {{.row = 0, .coefficient = 1}};
  friction.friction = {{.row = 0, .force = 1}};
  limits.limits = {{.row = 0, .lower = 0}};
  servo.servos = {{.row = 0, .stiffness = 1}};
  limited.servos = {{.row = 0, .stiffness = 1, .max_force = 1}};
  torque.torques = {{.row = 0, .force = {}}};
  drag.drag = {{.slot = 1, .linear = 1}};
  wrench.wrenches = {{.slot = 1}};
  ground.ground = Ground{};
  ground.ground->contacts.spheres = {{.slot = 1, .center = {}, .radius = 0.1}};
  empty_ground.ground = Ground{};
  check_added(armature, with({"armature_map"}, joint));
  check_added(spring, with({"spring_map"}, joint));
  check_added(dead_zone, with({"begin_dead_zones", "dead_zone_map", "revise_dead_zones"}, joint));
  check_added(damping, with({"damping_map"}, joint));
  check_added(friction, with({"begin_friction", "friction_map", "revise_friction"}, joint));
  check_added(limits, with({"begin_limits", "revise_limits"}, joint));
  check_added(servo, with({"servo_map"}, joint));
  check_added(limited, with({"servo_map", "revise_servos"}, joint));
  check_added(torque, with({"torque_map"}, joint));
  check_added(drag, with({"drag_map"}, body));
  check_added(wrench, with({"wrench_map"}, body));
  check_added(ground, with({"ground_map", "find_ground", "revise_ground"}, body));
  const EffectPlan nothing(model, options, empty_ground);
  CHECK(names_of(sweeps_of(model, options, nothing)) == plain);
  CHECK_FALSE(nothing.any());
}

TEST_CASE("every sweep of a schedule is measured under its name") {
  Effects everything;
  everything.armature = {{.row = 0, .inertia = 1}};
  everything.springs = {{.row = 0, .stiffness = 1}};
  everything.dead_zone_springs = {{.row = 0, .stiffness = 1, .half_width = 0.1}};
  everything.ball_springs = {{.slot = 2, .stiffness = 1}};
  everything.damping = {{.row = 0, .coefficient = 1}};
  everything.friction = {{.row = 0, .force = 1}};
  everything.limits = {{.row = 0, .lower = -1}};
  everything.servos = {{.row = 0, .stiffness = 1, .max_force = 1}};
  everything.torques = {{.row = 0, .force = {}}};
  everything.drag = {{.slot = 1, .linear = 1}};
  everything.wrenches = {{.slot = 1}};
  everything.ground = Ground{};
  everything.ground->contacts.spheres = {{.slot = 1, .center = {0, 0, 0.1}, .radius = 0.1}};
  LinkSpec first, second;
  first.name = "first";
  first.joint = "hinge";
  first.inertia = second.inertia = {1, {0, 0, -0.1}, 0.1 * Eigen::Matrix3d::Identity()};
  second.name = "second";
  second.parent = "first";
  second.joint = "ball";
  second.type = JointType::ball;
  const Model model = TreeBuilder("two").add(first).add(second).build();
  for (const Solver solver : {Solver::newton, Solver::riqn}) {
    const Options options{.solver = solver};
    const EffectPlan plan(model, options, everything);
    const std::vector<Sweep> sweeps = sweeps_of(model, options, plan);
    const std::vector<double> costs = sweep_costs(model, options, plan, {}, sweeps);
    REQUIRE(costs.size() == sweeps.size());
    for (std::size_t k = 0; k < sweeps.size(); ++k) {
      INFO(sweeps[k].name);
      CHECK((std::isfinite(costs[k]) && costs[k] >= 0));
    }
  }
}

}  // namespace linden
