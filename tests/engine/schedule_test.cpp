// The list of sweeps is what a step runs: it is stepped by, watched while it is, and measured.
#include "engine/sweeps/schedule.hpp"

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "engine/effects/effect_plan.hpp"
#include "engine/effects/effect_sweeps.hpp"
#include "engine/sweeps/sweep_cost.hpp"
#include "models/build/builder.hpp"
#include "models/build/merged_models.hpp"
#include "tests/engine/mechanisms.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/engine/schedule_stepper.hpp"
#include "tests/kernels/allocation_counter.hpp"

namespace linden::schedule_test {
namespace {

std::multiset<std::string> names_of(const std::vector<Sweep>& sweeps) {
  std::multiset<std::string> names;
  for (const Sweep& sweep : sweeps) names.insert(sweep.name);
  return names;
}

/// What is stepped.
struct Scenario {
  std::string name;
  Model model;
  Effects effects = {};
  std::vector<double> positions = {}, velocities = {};  // with which it starts; empty: any
  double spread = 0.3;                                  // of these
  bool any_guess = true;                                // else its states settle simply from the usual one alone
};

/// Joint effects of all kinds, each on a joint of its own; in twenty steps a joint sticks, one is at its limit of velocity, a servo at its
/// limit of force.
Scenario joints_scenario() {
  Scenario scenario{"effects on joints", chain(10)};
  Effects& effects = scenario.effects;
  effects.armature = {{.row = 0, .inertia = 0.01}};
  effects.springs = {{.row = 1, .stiffness = 5}};
  effects.dead_zone_springs = {{.row = 2, .stiffness = 20, .half_width = 0.001}};
  effects.damping = {{.row = 3, .coefficient = 0.01}};
  effects.friction = {{.row = 4, .force = 1}, {.row = 8, .force = 1e-4}};
  effects.limits = {{.row = 5, .lower = -1, .upper = 1, .velocity = 0.05}};
  effects.servos = {{.row = 6, .stiffness = 10, .damping = 0.1, .target = 0.3, .max_force = 0.2}};
  effects.torques = {{.row = 7, .force = {{0, 0.01}, {0, 1}}}};
  scenario.positions.assign(10, 0.0);
  return scenario;
}

/// A free box with an arm on a ball joint, sliding on the ground, pushed and in a draught.
Scenario bodies_scenario(double friction) {
  LinkSpec box, arm;
  box.name = "box";
  box.joint = "base";
  box.type = JointType::free;
  box.inertia = {2, {0, 0, 0.01}, 0.01 * Eigen::Matrix3d::Identity()};
  arm.name = "arm";
  arm.parent = "box";
  arm.joint = "shoulder";
  arm.type = JointType::ball;
  arm.inertia = {0.5, {0, 0, 0.1}, 0.01 * Eigen::Matrix3d::Identity()};
  Scenario scenario{"effects on bodies and on a ball joint", TreeBuilder("box with an arm").add(box).add(arm).build()};
  scenario.any_guess = friction == 0;
  Effects& effects = scenario.effects;
  effects.ground = Ground{.height = -0.0495, .stiffness = 1e4, .damping = 10, .friction = friction};
  for (const double x : {-0.1, 0.1}) {
    for (const double y : {-0.1, 0.1}) effects.ground->contacts.spheres.push_back({.slot = 1, .center = {x, y, -0.05}, .radius = 0});
  }
  effects.drag = {{.slot = 1, .linear = 0.5, .quadratic = 0.1}, {.slot = 2, .linear = 0.1}};
  effects.wrenches = {{.slot = 2, .point = {0, 0, 0.1}, .force = {1, 2, 3}, .scale = {{0, 0.01}, {0, 1}}}};
  effects.ball_springs = {{.slot = 2, .stiffness = 10}};
  scenario.positions = scenario.model.neutral();
  scenario.velocities.assign(static_cast<std::size_t>(scenario.model.tree.shape.velocities), 0.0);
  scenario.velocities[3] = 1;  // along the ground
  return scenario;
}

/// A four-bar, a gear from its crank to a joint of a hand whose joints follow each other, and friction.
Scenario geared_loop_scenario() {
  const Model linkage = four_bar(CouplingKind::hinge), hand = load_urdf(model_file("hand.urdf"), Base::fixed);
  Model both = merged({{.model = linkage, .name = "linkage"}, {.model = hand, .name = "hand"}}, "linkage and hand");
  const auto leader = static_cast<std::size_t>(both.mimics.front().leader_slot);
  const std::string led = both.names.joint[leader];
  Scenario scenario{.name = "a loop and a gear beside joints that follow others",
                    .model = coupled(std::move(both), {{.name = "gear", .kind = CouplingKind::gear, .link_a = {}, .link_b = {}, .joints = {{"linkage/crank_joint", 1}, {led, -2}}}})};
  scenario.effects.friction = {{.row = scenario.model.tree.first_v(static_cast<Index>(leader)), .force = 1e-3}};
  scenario.positions = scenario.model.neutral();
  scenario.velocities.assign(static_cast<std::size_t>(scenario.model.tree.shape.velocities), 0.0);
  scenario.velocities[0] = 0.5;
  return scenario;
}

std::vector<Scenario> scenarios() {
  std::vector<Scenario> all{{"chain", chain(12)},
                            {"floating humanoid", load_urdf(model_file("humanoid.urdf"), Base::floating)},
                            {"all kinds of joints", random_tree({.bodies = 30, .seed = 5, .floating = true})},
                            {"joints that follow others", load_urdf(model_file("hand.urdf"), Base::fixed)},
                            {.name = "a loop", .model = four_bar(CouplingKind::hinge), .positions = {0, 0, 0}, .velocities = {1, 0, 0}},
                            geared_loop_scenario(),
                            joints_scenario(),
                            bodies_scenario(0),
                            bodies_scenario(0.5)};
  Scenario geared{"effects on joints that others follow", load_urdf(model_file("hand.urdf"), Base::fixed)};
  const Index row = geared.model.mimics.front().leader_v;
  geared.effects.friction = {{.row = row, .force = 1e-3}};
  geared.effects.damping = {{.row = row, .coefficient = 1e-3}};
  all.push_back(std::move(geared));
  return all;
}

/// Each scenario, with each solver and each first guess: check(scenario, options).
template <class Check>
void each_case(const Check& check) {
  for (const Scenario& scenario : scenarios()) {
    for (const Solver solver : {Solver::newton, Solver::riqn}) {
      for (const FirstGuess guess : {FirstGuess::extrapolation, FirstGuess::ig1, FirstGuess::ig2, FirstGuess::ig3}) {
        if (!scenario.any_guess && (solver != Solver::newton || guess != FirstGuess::extrapolation)) continue;
        CAPTURE(scenario.name, name(solver), name(guess));
        check(scenario, Options{.step = 1e-3, .solver = solver, .guess = guess});
      }
    }
  }
}

/// Where a scenario starts.
Simulation simulation_of(const Scenario& scenario, const Options& options) {
  Simulation simulation(scenario.model, options, scenario.effects);
  random_start(simulation, 3, scenario.spread);
  if (!scenario.positions.empty()) simulation.set_positions(scenario.positions);
  if (!scenario.velocities.empty()) simulation.set_velocities(scenario.velocities);
  return simulation;
}

/// Whether numbers are the same, signs of zeros and all. (Of no numbers memcmp may not be asked.)
bool same_bits(std::span<const double> a, std::span<const double> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

constexpr int kSteps = 20;

/// Some steps of both.
void check_same_steps(const Scenario& scenario, const Options& options) {
  Simulation simulation = simulation_of(scenario, options);
  const EffectPlan plan(scenario.model, options, scenario.effects);
  ScheduleStepper stepper(scenario.model, options, plan);
  stepper.start(simulation.positions(), simulation.momenta());
  for (int k = 0; k < kSteps; ++k) {
    CAPTURE(k);
    stepper.step(simulation.time());
    const StepReport report = simulation.step();
    REQUIRE(report.ok());
    REQUIRE(same_bits(stepper.memory.state.q.flat(), simulation.positions()));
    REQUIRE(same_bits(stepper.memory.state.p.flat(), simulation.momenta()));
    REQUIRE(stepper.corrections == report.iterations);
    REQUIRE(stepper.factorisations == report.factorisations);
    REQUIRE(stepper.evaluations == report.evaluations);
  }
}

TEST_CASE("steps by the schedule alone are those of a simulation, to the bit") { each_case(check_same_steps); }

TEST_CASE("and so they are of a tree that is gone through branch by branch, or along one chain") {
  for (const Model& model : {chain(3000), balanced_tree(1500), balanced_tree(5000), random_tree({.bodies = 3000, .seed = 1})}) {
    CAPTURE(model.names.model);
    check_same_steps({.name = "", .model = model, .spread = 0.01}, {.step = 1e-4, .tolerance = 1e-6});
  }
}

/// The arrays of a memory by their names in schedules: one, or some that bear one name.
std::map<std::string, std::vector<std::span<double>>> arrays_of(StepMemory& memory) {
  std::map<std::string, std::vector<std::span<double>>> arrays;
  const auto as_called = [&](const char* name, auto& field, Rows, const char*) { arrays[name] = {field.flat()}; };
  State<double>::each(memory.state, as_called);
  Workspace<double>::each(memory.work, as_called);
  BodyConstants<double>::each(memory.constants, as_called);
  arrays["before"] = {memory.before.flat()};
  for (const char* gain : {"gain_up", "gain_down", "joint_inverse"}) {
    arrays["gains"].push_back(arrays[gain].front());
    arrays.erase(gain);
  }
  const auto all_as = [&](const char* name) {
    return [&arrays, name](const char*, auto& field, Rows, const char*) { arrays[name].push_back(field.flat()); };
  };
  if (memory.strategy.reuses_factor) MassFactor<double>::each(memory.mass, all_as("mass gains"));
  if (memory.effects) {
    JointImpulses<double>::each(memory.effects->parts().joints, all_as("joint impulses"));
    BodyImpulses<double>& bodies = memory.effects->parts().bodies;
    arrays["pose"] = {bodies.pose.flat()};
    arrays["body impulses"] = {bodies.applied.flat(), bodies.start_excess.flat(), bodies.body_stiffness.flat()};
  }
  return arrays;
}

/// Names in "a, b, c", as arrays_of has them.
std::set<std::string> names_in(const std::string& list, const StepMemory& memory) {
  std::set<std::string> names;
  for (std::size_t begin = 0; begin < list.size();) {
    const std::size_t end = std::min(list.find(", ", begin), list.size());
    names.insert(list.substr(begin, end - begin));
    begin = end + 2;
  }
  if (!memory.strategy.reuses_factor && names.erase("mass gains") > 0) names.insert("gains");
  return names;
}

/// Runs each sweep of a stepper twice: there, and on a memory where all that it does not say it reads is not a number. What it writes has
/// to be the same, and all else as it was.
class Watch {
 public:
  explicit Watch(ScheduleStepper& stepper)
      : memory_(stepper.memory),
        twin_(memory_.model, memory_.options, memory_.plan),
        arrays_(arrays_of(memory_)),
        twins_(arrays_of(twin_)) {
    stepper.begins = [this](double time) { twin_.begin(time); };
    stepper.call = [this](const Sweep& sweep, Slots slots) { call(sweep, slots); };
  }

 private:
  void call(const Sweep& sweep, Slots slots) {
    CAPTURE(sweep.name);
    const std::set<std::string> reads = names_in(sweep.reads, memory_), writes = names_in(sweep.writes, memory_);
    std::map<std::string, std::vector<std::vector<double>>> before;
    for (auto& [name, arrays] : arrays_) {
      for (std::size_t k = 0; k < arrays.size(); ++k) {
        before[name].emplace_back(arrays[k].begin(), arrays[k].end());
        if (reads.contains(name)) {
          std::ranges::copy(arrays[k], twins_[name][k].begin());
        } else {
          std::ranges::fill(twins_[name][k], std::numeric_limits<double>::quiet_NaN());
        }
      }
    }
    share_all_else();
    const AllocationCounter allocations;
    sweep.run(memory_, slots);
    CHECK(allocations.count() == 0);
    sweep.run(twin_, slots);
    CHECK(twin_.changed == memory_.changed);
    CHECK(same_bits(numbers_of(twin_.now), numbers_of(memory_.now)));
    for (auto& [name, arrays] : arrays_) {
      CAPTURE(name);
      for (std::size_t k = 0; k < arrays.size(); ++k) {
        const std::span<const double> old = before[name][k];
        if (writes.contains(name)) {
          REQUIRE(is_written(arrays[k], twins_[name][k], old));
        } else {
          REQUIRE(same_bits(arrays[k], old));
          REQUIRE((reads.contains(name) ? same_bits(twins_[name][k], old) : is_poisoned(twins_[name][k])));
        }
      }
    }
  }

  static std::vector<double> numbers_of(const Evaluated<double>& now) { return {now.least_w, now.energy, now.plain, now.norm}; }
  static bool is_poisoned(std::span<const double> array) {
    return std::ranges::all_of(array, [](double number) { return std::isnan(number); });
  }
  /// Whether every number was written, and the same, or left alone, by both.
  static bool is_written(std::span<const double> array, std::span<const double> twin, std::span<const double> old) {
    for (std::size_t n = 0; n < array.size(); ++n) {
      const bool left = same_bits(array.subspan(n, 1), old.subspan(n, 1)) && std::isnan(twin[n]);
      if (!left && !same_bits(array.subspan(n, 1), twin.subspan(n, 1))) return false;
    }
    return true;
  }

  /// Numbers that are no arrays.
  void share_all_else() {
    twin_.history = memory_.history;
    twin_.now = memory_.now;
    twin_.factor = memory_.factor;
    twin_.is_first = memory_.is_first;
    twin_.finds_end_momenta = memory_.finds_end_momenta;
    twin_.update = memory_.update;
    twin_.changed = memory_.changed;
    twin_.share = memory_.share;
  }

  StepMemory& memory_;
  StepMemory twin_;
  std::map<std::string, std::vector<std::span<double>>> arrays_, twins_;
};

TEST_CASE("a sweep reads no array and writes none but those that the schedule names, and allocates nothing") {
  each_case([](const Scenario& scenario, const Options& options) {
    const Simulation simulation = simulation_of(scenario, options);
    const EffectPlan plan(scenario.model, options, scenario.effects);
    ScheduleStepper stepper(scenario.model, options, plan);
    const Watch watch(stepper);
    stepper.start(simulation.positions(), simulation.momenta());
    for (int k = 0; k < kSteps / 2; ++k) stepper.step(k * options.step);
  });
}

TEST_CASE("a scene's schedule holds the sweeps of the effects it names and no others") {
  const Model model = chain(3);
  const Options options;
  using Names = std::vector<std::string>;
  const auto plain = names_of(schedule_of(model, options, EffectPlan(model, options, {})));
  const Names all{"last_displacement", "impulse_pass_up", "rate_down", "times_step", "end_reading"},
      joint{"keep_target", "clear_rows", "joint_impulses_map", "joint_impulses_end_map", "add_end_impulse"},
      body{"clear_bodies", "add_given_up", "world_placement_down"}, states{"displacement_map", "motion_map"};
  const auto check_added = [&](const Effects& effects, std::initializer_list<Names> sweeps) {
    std::multiset<std::string> expected = plain;
    expected.insert(all.begin(), all.end());
    for (const Names& some : sweeps) expected.insert(some.begin(), some.end());
    const EffectPlan plan(model, options, effects);
    CHECK(names_of(schedule_of(model, options, plan)) == expected);
    CHECK(plan.any());
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
  check_added(armature, {joint, {"armature_map", "armature_energy"}});
  check_added(spring, {joint, {"spring_map"}});
  check_added(dead_zone, {joint, states, {"begin_dead_zones", "dead_zone_map", "update_dead_zones", "clear_rows", "dead_zone_map"}});
  check_added(damping, {joint, {"damping_map"}});
  check_added(friction, {joint, states, {"begin_friction", "friction_map", "update_friction", "clear_rows", "friction_map"}});
  check_added(limits, {joint, states, {"begin_limits", "hold_limits", "update_limits", "clear_rows", "hold_limits"}});
  check_added(servo, {joint, {"begin_servos", "servo_map"}});
  check_added(limited, {joint, states, {"begin_servos", "servo_map", "update_servos", "clear_rows", "servo_map"}});
  check_added(torque, {joint, {"begin_torques", "torque_map"}});
  check_added(drag, {body, {"drag_map"}});
  check_added(wrench, {body, {"begin_wrenches", "wrench_map"}});
  check_added(ground, {body, states, {"begin_ground", "guess_ground", "ground_map", "update_ground", "keep_ground", "find_ground"}});
  const EffectPlan nothing(model, options, empty_ground);
  CHECK(names_of(schedule_of(model, options, nothing)) == plain);
  CHECK_FALSE(nothing.any());
}

TEST_CASE("every sweep of a schedule is measured") {
  each_case([](const Scenario& scenario, const Options& options) {
    if (options.guess != FirstGuess::extrapolation) return;
    const EffectPlan plan(scenario.model, options, scenario.effects);
    const std::vector<Sweep> sweeps = schedule_of(scenario.model, options, plan);
    const std::vector<double> costs = sweep_costs(scenario.model, options, plan, {}, sweeps);
    REQUIRE(costs.size() == sweeps.size());
    for (std::size_t k = 0; k < sweeps.size(); ++k) {
      INFO(sweeps[k].name);
      CHECK((std::isfinite(costs[k]) && costs[k] >= 0));
    }
  });
}

}  // namespace
}  // namespace linden::schedule_test
