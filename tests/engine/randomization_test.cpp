// What is randomised is drawn as it was asked for, the same in any company, and acts as mechanics says.
#include "engine/randomization.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "engine/batch.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/scene/scene_file.hpp"
#include "kernels/effects/servo.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/builder.hpp"
#include "scenes.hpp"

namespace linden::randomization_test {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Eigen::Vector3d;

constexpr double kG = 9.81;

Model one_body(JointType type, double mass, const Vector3d& center = Vector3d::Zero(), const Vector3d& axis = Vector3d::UnitZ()) {
  LinkSpec link;
  link.name = "link";
  link.joint = "joint";
  link.type = type;
  link.axis = axis;
  link.inertia = {mass, center, 0.01 * Eigen::Matrix3d::Identity()};
  return TreeBuilder("one body").add(link).build();
}

Options options_of(double step, const std::array<double, 3>& gravity) {
  Options options;
  options.step = step;
  options.gravity = gravity;
  options.tolerance = 1e-13;
  return options;
}

void draw_all(Batch& batch, const Randomization& randomization, const Effects& effects) {
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    apply(draw(randomization, batch.model(), effects, static_cast<std::uint64_t>(i) + 1), effects, batch, i);
  }
}

/// An arm whose servos follow a table against gravity and friction.
struct Arm {
  Model model = load_urdf(model_file("arm.urdf"), Base::fixed);
  Effects effects;
  Randomization randomization{.masses = Range{0.7, 1.3}, .friction = {}, .joint_friction = Range{0.2, 2}, .gains = Range{0.5, 3}};

  Arm() {
    effects.servos = servo_everywhere(model, 120, 6);
    for (Servo& servo : effects.servos) {
      servo.max_force = std::numeric_limits<double>::infinity();
      servo.target_over_time = {{0, 0.2, 0.5}, {0, 0.3, -0.1}};
      servo.target_velocity = {{0, 0.2}, {1.5, -1}};
      servo.feedforward = {{0, 1}, {0.5, 2}};
    }
    effects.friction = friction_everywhere(model, 0.3);
    effects.armature = armature_everywhere(model, 0.05);
  }
};

/// A box of 0.2 x 0.2 x 0.1 m and one kilogram that lies on level ground, which gravity makes a slope.
struct Box {
  Model model = one_body(JointType::free, 1);
  Effects effects;

  Box() {
    effects.ground = Ground{.stiffness = 1e5, .damping = 100, .friction = 0.5};
    for (const double x : {-0.1, 0.1}) {
      for (const double y : {-0.1, 0.1}) {
        for (const double z : {-0.05, 0.05}) effects.ground->contacts.spheres.push_back({.slot = 1, .center = {x, y, z}, .radius = 0});
      }
    }
  }
  std::vector<double> lying(double slope) const {
    return {0, 0, 0.05 - kG * std::cos(slope) / (4 * effects.ground->stiffness), 0, 0, 0, 1};
  }
};

std::string bytes_of(const Batch& batch, std::int64_t i) {
  std::string bytes;
  for (const auto& rows : {batch.positions(), batch.momenta()}) {
    for (const double number : rows.instance(i)) bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
  }
  return bytes;
}

std::string refusal(const std::string& text) {
  try {
    parse_scene(text, "s.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST_CASE("draws lie in their ranges, fill them evenly, and are the same for the same seed", "[randomization]") {
  const Arm arm;
  std::vector<double> sum(3, 0.0);
  constexpr int kInstances = 2000;
  const auto joints = static_cast<double>(arm.effects.servos.size());
  for (std::uint64_t seed = 0; seed < kInstances; ++seed) {
    const DrawnNumbers drawn = draw(arm.randomization, arm.model, arm.effects, seed);
    REQUIRE(drawn.mass_factors.size() == static_cast<std::size_t>(arm.model.tree.bodies()));
    REQUIRE(drawn.joint_friction_factors.size() == arm.effects.friction.size());
    REQUIRE(drawn.gain_factors.size() == arm.effects.servos.size());
    CHECK_FALSE(drawn.ground_friction);
    CHECK(drawn == draw(arm.randomization, arm.model, arm.effects, seed));
    const auto check = [&](std::size_t k, const std::vector<double>& factors, const Range& range) {
      for (const double factor : factors) {
        CHECK(factor >= range.low);
        CHECK(factor <= range.high);
        sum[k] += (factor - range.low) / (range.high - range.low);
      }
    };
    check(0, drawn.mass_factors, *arm.randomization.masses);
    check(1, drawn.joint_friction_factors, *arm.randomization.joint_friction);
    check(2, drawn.gain_factors, *arm.randomization.gains);
  }
  // a mean of n uniform numbers strays by 1 / sqrt(12 n) from 1/2
  CHECK(sum[1] / (kInstances * joints) == Approx(0.5).margin(5 / std::sqrt(12 * kInstances * joints)));
  CHECK(sum[2] / (kInstances * joints) == Approx(0.5).margin(5 / std::sqrt(12 * kInstances * joints)));
  const double bodies = arm.model.tree.bodies();
  CHECK(sum[0] / (kInstances * bodies) == Approx(0.5).margin(5 / std::sqrt(12 * kInstances * bodies)));
}

TEST_CASE("no draw goes by what else is drawn, none repeats another seed's, and none is a start's", "[randomization]") {
  const Arm arm;
  Randomization masses;
  masses.masses = arm.randomization.masses;
  std::set<double> shares;
  std::size_t all = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    const DrawnNumbers both = draw(arm.randomization, arm.model, arm.effects, seed);
    CHECK(draw(masses, arm.model, arm.effects, seed).mass_factors == both.mass_factors);
    const auto note = [&](const std::vector<double>& numbers, double low, double high) {
      for (const double number : numbers) shares.insert(std::round((number - low) / (high - low) * 1e12));
      all += numbers.size();
    };
    note(both.mass_factors, 0.7, 1.3);
    note(both.joint_friction_factors, 0.2, 2);
    note(both.gain_factors, 0.5, 3);
    // speeds are not moved by limits
    const double spread = 0.3, rate = spread / std::sqrt(static_cast<double>(arm.model.tree.levels() - 1));
    note(random_state(arm.model, seed, spread).velocities, -rate, rate);
  }
  // 13 digits of each: of some ten thousand hardly two are alike by chance
  CHECK(shares.size() == all);
}

TEST_CASE("a number is a spread about one, a pair a range, and the ground's friction a coefficient", "[randomization]") {
  const Box box;
  const Arm arm;
  Randomization randomization;
  set_range(randomization, "masses", std::vector{0.2}, box.effects);
  CHECK(*randomization.masses == Range{0.8, 1.2});
  set_range(randomization, "friction", std::vector{0.2}, box.effects);
  CHECK(*randomization.friction == Range{0.4, 0.6});
  CHECK(randomization_text(randomization) == "masses \u00b120 %, ground friction 0.4 to 0.6");
  set_range(randomization, "friction", std::vector{0.4, 1.0}, box.effects);
  set_range(randomization, "masses", std::vector{0.5, 2.0}, box.effects);
  CHECK(randomization_text(randomization) == "masses times 0.5 to 2, ground friction 0.4 to 1");
  set_range(randomization, "gains", std::vector{0.0}, arm.effects);
  CHECK(draw(randomization, arm.model, arm.effects, 7).gain_factors == std::vector<double>(arm.effects.servos.size(), 1.0));
}

TEST_CASE("a pendulum swings alike whatever its mass, a mass on a spring with a period that goes by it", "[randomization]") {
  const Randomization randomization{.masses = Range{0.3, 3}, .friction = {}, .joint_friction = {}, .gains = {}};
  constexpr int kSteps = 1500;
  SECTION("pendulum") {
    const Model pendulum = one_body(JointType::revolute, 2, {0, 0, -0.4}, Vector3d::UnitY());
    const Options options = options_of(1e-3, {0, 0, -kG});
    Batch batch(pendulum, 9, options);
    draw_all(batch, randomization, {});
    batch.reset_all([](std::int64_t, std::span<double> q, std::span<double>) { q[0] = 1; });
    batch.step(kSteps);
    Simulation plain(pendulum, options);
    plain.set_positions(std::vector{1.0});
    run(plain, kSteps);
    for (std::int64_t i = 0; i < batch.size(); ++i) CHECK(batch.positions()(i, 0) == Approx(plain.positions()[0]).margin(1e-10));
  }
  SECTION("spring") {
    const double mass = 2, stiffness = 50;
    Effects effects;
    effects.springs = {{.row = 0, .stiffness = stiffness}};
    const Options options = options_of(1e-3, {0, 0, 0});
    Batch batch(one_body(JointType::prismatic, mass), 9, options, effects);
    draw_all(batch, randomization, effects);
    batch.reset_all([](std::int64_t, std::span<double> q, std::span<double>) { q[0] = 1; });
    batch.step(kSteps);
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      const double factor = draw(randomization, batch.model(), effects, static_cast<std::uint64_t>(i) + 1).mass_factors[0];
      const double w = std::sqrt(stiffness / (factor * mass)), t = 1e-3 * kSteps;
      // the midpoint rule turns (w h)^2 / 12 of its phase too slowly
      CHECK(batch.positions()(i, 0) == Approx(std::cos(w * t)).margin(w * t * w * w * 1e-6 / 12 * 1.1));
    }
  }
}

TEST_CASE("a servo sags by its load over its drawn stiffness, and its damping goes with it", "[randomization]") {
  const double mass = 2, stiffness = 400, damping = 30;
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = stiffness, .damping = damping}};
  const Randomization randomization{.masses = {}, .friction = {}, .joint_friction = {}, .gains = Range{0.5, 2}};
  const Options options = options_of(1e-3, {0, 0, -kG});
  const Model slider = one_body(JointType::prismatic, mass);
  Batch batch(slider, 11, options, effects);
  draw_all(batch, randomization, effects);
  const auto factor = [&](std::int64_t i) { return draw(randomization, slider, effects, static_cast<std::uint64_t>(i) + 1).gain_factors[0]; };
  SECTION("at rest") {
    batch.step(6000);
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      CHECK(batch.gains()(i, 0) == factor(i));
      CHECK(batch.positions()(i, 0) == Approx(-mass * kG / (factor(i) * stiffness)).epsilon(1e-9));
    }
    Simulation simulation(slider, options, effects);
    simulation.set_gains(std::vector{1.7});
    run(simulation, 6000);
    CHECK(simulation.positions()[0] == Approx(-mass * kG / (1.7 * stiffness)).epsilon(1e-9));
  }
  SECTION("on its way: a damped oscillator") {
    constexpr int kSteps = 150;
    batch.step(kSteps);
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      const double k = factor(i) * stiffness, c = factor(i) * damping, decay = c / (2 * mass), t = 1e-3 * kSteps, rest = -mass * kG / k;
      const double w = std::sqrt(k / mass - decay * decay);
      const double expected = rest * (1 - std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t)));
      CHECK(batch.positions()(i, 0) == Approx(expected).epsilon(1e-3));
    }
  }
}

TEST_CASE("a block on a slope stays where its drawn friction is more than the slope, and else slides as Coulomb says", "[randomization]") {
  const Box box;
  const double slope = std::atan(0.7);
  const Randomization randomization{.masses = {}, .friction = Range{0.4, 1.0}, .joint_friction = {}, .gains = {}};
  const Options options = options_of(1e-3, {kG * std::sin(slope), 0, -kG * std::cos(slope)});
  Batch batch(box.model, 40, options, box.effects);
  draw_all(batch, randomization, box.effects);
  const std::vector<double> start = box.lying(slope);
  batch.reset_all([&](std::int64_t, std::span<double> q, std::span<double>) { std::ranges::copy(start, q.begin()); });
  batch.step(1000);
  int slid = 0, stayed = 0;
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    const double friction = *draw(randomization, box.model, box.effects, static_cast<std::uint64_t>(i) + 1).ground_friction;
    const double distance = 0.5 * kG * (std::sin(slope) - friction * std::cos(slope)), x = batch.positions()(i, 0);
    INFO("friction " << friction << ", slid " << x << " m of " << distance);
    CHECK(batch.ground_friction()(i, 0) == friction);
    if (distance > 0) {
      ++slid;
      CHECK(x == Approx(distance).margin(2e-3));
    } else {
      ++stayed;
      CHECK(std::abs(x) < 5e-4);  // it leans into the ground as its load moves downhill
    }
    Simulation simulation(box.model, options, box.effects);
    simulation.set_positions(start);
    simulation.set_ground_friction(friction);
    run(simulation, 1000);
    CHECK(simulation.positions()[0] == Approx(x).margin(1e-6));
  }
  CHECK(slid > 5);
  CHECK(stayed > 5);
}

TEST_CASE("a simulation of what was drawn moves as the instance of the batch, stiff servos included", "[randomization]") {
  for (const double stiffer : {1.0, 300.0}) {
    Arm arm;
    for (Servo& servo : arm.effects.servos) servo.stiffness *= stiffer, servo.damping *= stiffer;
    // servos that a step does not resolve are taken the more implicitly the lighter the model is that the plan was made for
    const bool stiff = stiffer > 1;
    if (stiff) arm.randomization.masses.reset();
    const Options options = options_of(1e-3, {0, 0, -kG});
    const EffectPlan plan(arm.model, options, arm.effects);
    for (const Servo& servo : arm.effects.servos) {
      const double ratio = ServoLaw<double>::ratio(servo, options.step, plan.inertia[static_cast<std::size_t>(servo.row)]);
      CHECK((stiff ? 0.5 * ratio > 1 : 3 / 0.7 * ratio < 1));
    }
    Batch batch(arm.model, 6, options, arm.effects);
    draw_all(batch, arm.randomization, arm.effects);
    batch.reset_all([](std::int64_t i, std::span<double> q, std::span<double> v) {
      for (double& number : q) number = 0.1 * static_cast<double>(i);
      for (double& number : v) number = 0.2;
    });
    batch.step(300);
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      Model model = arm.model;
      Effects effects = arm.effects;
      apply(draw(arm.randomization, model, effects, static_cast<std::uint64_t>(i) + 1), model, effects);
      Simulation simulation(model, options, effects);
      simulation.set_positions(std::vector<double>(simulation.positions().size(), 0.1 * static_cast<double>(i)));
      simulation.set_velocities(std::vector<double>(simulation.positions().size(), 0.2));
      run(simulation, 300);
      for (std::size_t row = 0; row < simulation.positions().size(); ++row) {
        INFO("servos " << stiffer << " times as stiff, instance " << i << ", row " << row);
        CHECK(batch.positions()(i, static_cast<Index>(row)) == Approx(simulation.positions()[row]).margin(1e-9));
      }
    }
  }
}

TEST_CASE("what was drawn acts where an instance is stepped alone, too", "[randomization]") {
  // a model with mimic joints is: every step of every instance
  const Model hand = load_urdf(model_file("hand.urdf"), Base::fixed);
  Effects effects;
  effects.servos = {{.row = 1, .stiffness = 0.5, .damping = 0.01, .target = 0.4}};
  const Randomization randomization{.masses = {}, .friction = {}, .joint_friction = {}, .gains = Range{0.2, 4}};
  const Options options = options_of(1e-3, {0, 0, -kG});
  Batch batch(hand, 4, options, effects);
  draw_all(batch, randomization, effects);
  batch.step(200);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    Simulation simulation(hand, options, effects);
    simulation.set_gains(draw(randomization, hand, effects, static_cast<std::uint64_t>(i) + 1).gain_factors);
    run(simulation, 200);
    for (std::size_t row = 0; row < simulation.positions().size(); ++row) {
      CHECK(batch.positions()(i, static_cast<Index>(row)) == Approx(simulation.positions()[row]).margin(1e-9));
    }
    if (i > 0) CHECK(std::abs(batch.positions()(i, 1) - batch.positions()(i - 1, 1)) > 1e-4);
  }
}

TEST_CASE("the ground has its drawn friction where joints are tied, too", "[randomization]") {
  // two balanced wheels in a box that turn as one leave its motion as it is
  TreeBuilder builder("box with wheels");
  LinkSpec trunk;
  trunk.name = "box";
  trunk.joint = "base";
  trunk.type = JointType::free;
  trunk.inertia = {0.8, Vector3d::Zero(), 0.01 * Eigen::Matrix3d::Identity()};
  builder.add(trunk);
  for (const char* const name : {"left", "right"}) {
    LinkSpec wheel;
    wheel.name = name;
    wheel.joint = std::string("to ") + name;
    wheel.parent = "box";
    wheel.inertia = {0.1, Vector3d::Zero(), 1e-4 * Eigen::Matrix3d::Identity()};
    if (wheel.name == "right") wheel.mimic = "to left";
    builder.add(wheel);
  }
  const Box box;
  const double slope = std::atan(0.7);
  const Randomization randomization{.masses = {}, .friction = Range{0.2, 0.6}, .joint_friction = {}, .gains = {}};
  Batch batch(builder.build(), 6, options_of(1e-3, {kG * std::sin(slope), 0, -kG * std::cos(slope)}), box.effects);
  draw_all(batch, randomization, box.effects);
  const std::vector<double> start = box.lying(slope);
  batch.reset_all([&](std::int64_t, std::span<double> q, std::span<double>) { std::ranges::copy(start, q.begin()); });
  batch.step(500);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    const double friction = *draw(randomization, batch.model(), box.effects, static_cast<std::uint64_t>(i) + 1).ground_friction;
    CHECK(batch.positions()(i, 0) == Approx(0.125 * kG * (std::sin(slope) - friction * std::cos(slope))).margin(1e-3));
  }
}

TEST_CASE("what is drawn gives the same bits in any company, on any threads, in any splitting, after a reset", "[randomization]") {
  // with an arm that bounces at its limits: those steps are taken alone
  TreeBuilder builder("box with an arm");
  LinkSpec trunk;
  trunk.name = "box";
  trunk.joint = "base";
  trunk.type = JointType::free;
  trunk.inertia = {1, Vector3d::Zero(), Vector3d(0.004, 0.006, 0.008).asDiagonal()};
  LinkSpec arm;
  arm.name = "arm";
  arm.joint = "shoulder";
  arm.parent = "box";
  arm.axis = Vector3d::UnitX();
  arm.placement.translation().y() = 0.15;
  arm.inertia = {0.2, Vector3d(0, 0, -0.05), 2e-4 * Eigen::Matrix3d::Identity()};
  const Model model = builder.add(trunk).add(arm).build();
  Effects effects = Box().effects;
  const Index shoulder = row_of(model, "shoulder");
  effects.limits = {{.row = shoulder, .lower = -0.2, .upper = 0.2, .restitution = 0.9}};
  effects.friction = {{.row = shoulder, .force = 0.005}};
  effects.servos = {{.row = shoulder, .stiffness = 2, .damping = 0.01, .target = 0.1, .target_velocity = {{0}, {3}}}};
  const Randomization randomization{.masses = Range{0.8, 1.2}, .friction = Range{0.2, 1}, .joint_friction = Range{0.5, 2}, .gains = Range{0.5, 2}};
  std::int64_t rescued = 0;
  const auto run = [&](std::int64_t size, int threads, std::int64_t first, const std::vector<std::int64_t>& parts, bool again = false) {
    Batch batch(model, size, {}, effects, {.threads = threads});
    const auto begin = [&] {
      for (std::int64_t i = 0; i < size; ++i) {
        const std::int64_t number = first + i;
        apply(draw(randomization, model, effects, static_cast<std::uint64_t>(number)), effects, batch, i);
        std::vector<double> q = model.neutral(), v(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
        q[2] = 0.1 + 0.01 * static_cast<double>(number);
        v[1] = 0.5 * static_cast<double>(number % 5);
        v[static_cast<std::size_t>(shoulder)] = 6;
        batch.reset(i, q, v);
      }
    };
    begin();
    if (again) {
      batch.step(77);
      begin();
    }
    for (const std::int64_t steps : parts) batch.step(steps);
    CHECK(batch.summary().frozen == 0);
    rescued = batch.summary().rescued;
    std::vector<std::string> bytes;
    for (std::int64_t i = 0; i < size; ++i) bytes.push_back(bytes_of(batch, i));
    return bytes;
  };
  const std::vector<std::string> reference = run(23, 1, 0, {300});
  CHECK(rescued > 20);
  CHECK(reference[3] != reference[4]);
  for (const int threads : {2, 3}) CHECK(run(23, threads, 0, {300}) == reference);
  CHECK(run(23, 2, 0, std::vector<std::int64_t>(300, 1)) == reference);
  CHECK(run(23, 2, 0, {1, 98, 201}) == reference);
  CHECK(run(23, 2, 0, {300}, true) == reference);
  const std::vector<std::string> shifted = run(9, 2, 11, {300});
  for (std::size_t i = 0; i < shifted.size(); ++i) CHECK(shifted[i] == reference[i + 11]);
}

TEST_CASE("factors of one and the effects' own friction change no bit", "[randomization]") {
  Arm arm;
  for (Servo& servo : arm.effects.servos) servo.stiffness = 3e4, servo.damping = 900;  // backward Euler, in part
  for (const bool single : {false, true}) {
    const auto run = [&](auto batch, bool written) {
      if (written) {
        for (std::int64_t i = 0; i < batch.size(); ++i) batch.gains()(i, 0) = 1;
        batch.friction();
        CHECK(batch.gains()(3, 2) == 1);
      }
      batch.step(100);
      std::vector<double> numbers;
      for (std::int64_t i = 0; i < batch.size(); ++i) {
        for (const auto number : batch.positions().instance(i)) numbers.push_back(static_cast<double>(number));
      }
      return numbers;
    };
    const Options options = options_of(1e-3, {0, 0, -kG});
    if (single) {
      CHECK(run(FloatBatch(arm.model, 5, options, arm.effects), true) == run(FloatBatch(arm.model, 5, options, arm.effects), false));
    } else {
      CHECK(run(Batch(arm.model, 5, options, arm.effects), true) == run(Batch(arm.model, 5, options, arm.effects), false));
    }
  }
  const Box box;
  const double slope = 0.3;
  const auto slide = [&](bool written) {
    Batch batch(box.model, 5, options_of(1e-3, {kG * std::sin(slope), 0, -kG * std::cos(slope)}), box.effects);
    if (written) CHECK(batch.ground_friction()(2, 0) == 0.5);
    batch.reset_all([&](std::int64_t, std::span<double> q, std::span<double> v) {
      std::ranges::copy(box.lying(slope), q.begin());
      v[3] = 0.5;
    });
    batch.step(200);
    return bytes_of(batch, 4);
  };
  CHECK(slide(true) == slide(false));
}

TEST_CASE("a mass far from its body's origin may be drawn: what is left about its centre is rounding", "[randomization]") {
  LinkSpec link;
  link.name = "bob";
  link.joint = "joint";
  link.axis = Vector3d::UnitY();
  link.inertia = {0.3, {0.1, 0.7, -0.9}, Eigen::Matrix3d::Zero()};
  const Model pendulum = TreeBuilder("point").add(link).build();
  Batch batch(pendulum, 50);
  draw_all(batch, {.masses = Range{0.1, 10}, .friction = {}, .joint_friction = {}, .gains = {}}, {});
  batch.step(10);
  CHECK(batch.summary().frozen == 0);
}

TEST_CASE("what a simulation or a batch has none of is refused", "[randomization]") {
  const Arm arm;
  Simulation simulation(arm.model, {}, arm.effects);
  CHECK_THROWS_WITH(simulation.set_ground_friction(0.5), Contains("there is no ground"));
  CHECK_THROWS_WITH(simulation.set_gains(std::vector{1.0}), Contains("factors of gains: 1 numbers"));
  std::vector<double> gains(arm.effects.servos.size(), 1.0);
  gains[2] = -1;
  CHECK_THROWS_WITH(simulation.set_gains(gains), Contains("servo 2 is -1"));
  Simulation lying(Box().model, {}, Box().effects);
  CHECK_THROWS_WITH(lying.set_ground_friction(-0.1), Contains("expected a finite number, zero or more"));
  CHECK_THROWS_WITH(lying.set_gains(std::vector{1.0}), Contains("factors of gains"));
  Batch batch(arm.model, 3, {}, arm.effects);
  CHECK_THROWS_WITH(batch.ground_friction()(0, 0), Contains("there is no row 0: there are none"));
  CHECK_THROWS_WITH(batch.gains()(0, 99), Contains("there is no row 99"));
  CHECK_THROWS_WITH(batch.gains()(3, 0), Contains("there is no instance 3"));
}

TEST_CASE("a scene says what is randomised", "[randomization][scene]") {
  const std::string arm = "model: " LINDEN_MODELS_DIR "/arm.urdf\n";
  const Scene scene = parse_scene(arm +
                                      "initial: {seed: 5, spread: 0}\n"
                                      "effects: {friction: 0.1, servo: {stiffness: 100, damping: 2}}\n"
                                      "randomize: {masses: 0.2, joint_friction: [0.5, 3], gains: 0.1}\n",
                                  "s.yaml");
  CHECK(*scene.randomization.masses == Range{0.8, 1.2});
  CHECK_FALSE(scene.randomization.friction);
  CHECK(*scene.randomization.joint_friction == Range{0.5, 3});
  CHECK(*scene.randomization.gains == Range{0.9, 1.1});
  CHECK(scene.seed == 5);
  CHECK(scene.effects.servos[0].stiffness == 100);  // as it was written: instances differ, not the scene

  // a simulation of the scene is the instance that the seed draws
  const DrawnNumbers numbers = draw(scene.randomization, scene.model, scene.effects, 5);
  const Simulation simulation(scene);
  CHECK(simulation.effects().servos[0].stiffness == 100 * numbers.gain_factors[0]);
  CHECK(simulation.effects().servos[0].damping == 2 * numbers.gain_factors[0]);
  CHECK(simulation.effects().friction[1].force == 0.1 * numbers.joint_friction_factors[1]);
  double mass = 0;
  for (Index slot = 1; slot <= scene.model.tree.bodies(); ++slot) {
    mass += numbers.mass_factors[static_cast<std::size_t>(slot - 1)] * scene.model.constants.inertia(slot, 0);
    for (int k = 0; k < 10; ++k) {
      CHECK(simulation.model().constants.inertia(slot, k) ==
            numbers.mass_factors[static_cast<std::size_t>(slot - 1)] * scene.model.constants.inertia(slot, k));
    }
  }
  CHECK(simulation.model().constants.subtree_mass(0) - scene.model.constants.inertia(0, 0) == Approx(mass).epsilon(1e-14));

  CHECK_FALSE(parse_scene(arm, "s.yaml").randomization.any());
  CHECK(parse_scene(arm + "initial: {seed: 5}\n", "s.yaml", {.seed = 9, .spread = {}}).seed == 9);
  CHECK(parse_scene(arm, "s.yaml").seed == kDefaultSeed);
}

TEST_CASE("a scene that randomises what it has not, or by no range, is refused with its line", "[randomization][scene]") {
  const std::string chain = "model: chain:3\n";
  const auto check = [](const std::string& text, int line, const std::string& expected) {
    const std::string found = refusal(text);
    INFO(text);
    CHECK_THAT(found, StartsWith(fmt::format("s.yaml:{}: ", line)) && Contains(expected));
    CHECK(std::ranges::count(found, ';') >= 2);
  };
  check(chain + "randomize:\n  friction: 0.2\n", 3, "randomize.friction: there is no ground");
  check(chain + "randomize:\n  masses: 0.1\n  gains: 0.2\n", 4, "randomize.gains: there is no servo");
  check(chain + "randomize: {joint_friction: 0.3}\n", 2, "there is no joint friction");
  check(chain + "randomize: {mases: 0.2}\n", 2, "did you mean masses?");
  check(chain + "randomise: {masses: 0.2}\n", 2, "did you mean randomize?");
  check(chain + "randomize: {masses: 1}\n", 2, "expected p from 0 to below 1");
  check(chain + "randomize: {masses: -0.1}\n", 2, "expected p from 0 to below 1");
  check(chain + "randomize: {masses: [1.2, 0.8]}\n", 2, "the lower one first");
  check(chain + "randomize: {masses: [0, 1]}\n", 2, "above zero");
  check(chain + "randomize: {masses: [0.5, 1, 2]}\n", 2, "a number, or a pair [low, high]");
  check(chain + "randomize: {masses: much}\n", 2, "a number, or a pair [low, high]");
  check(chain + "randomize: 0.2\n", 2, "a map of masses, friction, joint_friction, gains");
}

}  // namespace
}  // namespace linden::randomization_test
