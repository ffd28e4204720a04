// Forces over time act with their integral whatever the step, servos follow tables, limits of velocity hold.
#include <catch2/catch.hpp>

#include <cmath>
#include <complex>
#include <numbers>

#include "engine/batch.hpp"
#include "models/build/builder.hpp"
#include "models/build/random.hpp"
#include "scenes.hpp"

namespace linden::forces_test {
namespace {

Model one_joint(JointType type, double mass, double inertia, const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  LinkSpec link;
  link.name = "link";
  link.joint = "joint";
  link.type = type;
  link.axis = Eigen::Vector3d::UnitY();
  link.inertia = {mass, center, inertia * Eigen::Matrix3d::Identity()};
  return TreeBuilder("one joint").add(link).build();
}
Model rotor(double inertia = 0.02) { return one_joint(JointType::revolute, 1, inertia); }
Model body(double mass = 2) { return one_joint(JointType::free, mass, 0.01); }

Options still(double step = 1e-3) { return {.step = step, .gravity = {0, 0, 0}}; }

void set(Simulation& simulation, std::vector<double> q, std::vector<double> v) {
  simulation.set_positions(q);
  simulation.set_velocities(v);
}

/// Energy plus what effects took less what they gave.
double balance(Simulation& simulation) {
  return simulation.energy().total() + simulation.effect_work().taken() - simulation.effect_work().given();
}

/// Integral of a table over [from, to], trapezoid by trapezoid.
double integral(const TimeTable& table, double from, double to) {
  double sum = table.values.front() * std::max(0.0, std::min(to, table.times.front()) - from) +
               table.values.back() * std::max(0.0, to - std::max(from, table.times.back()));
  for (std::size_t k = 1; k < table.times.size(); ++k) {
    const double t0 = table.times[k - 1], t1 = table.times[k], a = std::max(from, t0), b = std::min(to, t1);
    if (!(b > a)) continue;
    const auto value = [&](double t) { return table.values[k - 1] + (t - t0) / (t1 - t0) * (table.values[k] - table.values[k - 1]); };
    sum += 0.5 * (b - a) * (value(a) + value(b));
  }
  return sum;
}

/// A table that jumps here and there, with points much closer than steps of `h` and much farther apart.
TimeTable random_time_table(Random& random, double duration, double h, double most) {
  TimeTable table{{}, {}};
  double time = random.uniform(-2 * h, 0.2 * duration);
  while (time < duration) {
    table.times.push_back(time);
    table.values.push_back(random.uniform(-most, most));
    if (random.uniform(0, 1) < 0.3) continue;
    time += random.uniform(0, 1) < 0.5 ? random.uniform(0, 0.3 * h) : random.uniform(0, 5 * h);
  }
  return table;
}

/// amplitude sin(rate t) and its derivatives, on points so close that straight lines between them do.
TimeTable sinusoid(double amplitude, double rate, double duration, double phase = 0) {
  TimeTable table{{}, {}};
  constexpr int kPoints = 200'000;
  for (int k = 0; k <= kPoints; ++k) {
    const double time = duration * k / kPoints;
    table.times.push_back(time);
    table.values.push_back(amplitude * std::sin(rate * time + phase));
  }
  return table;
}

}  // namespace

TEST_CASE("a push gives a free body its impulse, wherever it begins and ends between steps", "[forces]") {
  Random random(1);
  constexpr double kMass = 2, kForce = 0.5, kSpeed = 3;
  for (int sample = 0; sample < 200; ++sample) {
    const double h = std::pow(10, random.uniform(-4, -2)), duration = 40 * h;
    Effects effects;
    BodyWrench push{.slot = 1, .force = {kForce, 0, 0}};
    push.from = random.uniform(-h, 0.6 * duration);
    push.to = push.from + (sample % 2 == 0 ? random.uniform(0, h) : random.uniform(0, 0.5 * duration));
    if (sample % 3 == 0) push.scale = random_time_table(random, duration, h, 1);
    effects.wrenches = {push};
    Simulation simulation(body(kMass), still(h), effects);
    set(simulation, {0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, kSpeed, 0, 0});
    const double before = simulation.energy().total();
    run(simulation, 40);
    const double impulse = kForce * integral(push.scale, std::max(push.from, 0.0), std::min(push.to, simulation.time()));
    INFO("h " << h << ", from " << push.from << " to " << push.to);
    CHECK(simulation.momentum().linear[0] == Approx(kMass * kSpeed + impulse).epsilon(1e-13));
    // what is booked is the kinetic energy that it gave
    const double given = 0.5 * std::pow(kMass * kSpeed + impulse, 2) / kMass - before;
    CHECK(simulation.effect_work().of<BodyWrench>() == Approx(given).margin(1e-13 * before));
    CHECK(balance(simulation) == Approx(before).epsilon(1e-13));
  }
}

TEST_CASE("a torque's table acts with its integral, points within a step and jumps too", "[forces]") {
  Random random(2);
  constexpr double kInertia = 0.02, kRate = 5;
  for (int sample = 0; sample < 100; ++sample) {
    const double h = std::pow(10, random.uniform(-4, -2));
    Effects effects;
    effects.torques = {{.row = 0, .force = random_time_table(random, 40 * h, h, 0.2)}, {.row = 0, .force = {{0}, {0.01}}}};
    Simulation simulation(rotor(kInertia), still(h), effects);
    set(simulation, {0}, {kRate});
    const double before = simulation.energy().total();
    run(simulation, 40);
    const double impulse = integral(effects.torques[0].force, 0, simulation.time()) + 0.01 * simulation.time();
    CHECK(simulation.momenta()[0] == Approx(kInertia * kRate + impulse).epsilon(1e-13));
    CHECK(balance(simulation) == Approx(before).epsilon(1e-12));
  }
}

TEST_CASE("a push that begins with a step begins with it whatever the rounding of times", "[forces]") {
  constexpr double kMass = 2, kForce = 0.5;
  for (const int per_second : {10, 100, 1000, 3, 7}) {
    const double h = 1.0 / per_second;
    for (const int first : {1, 3, 6, 7, 29, 57}) {
      Effects effects;
      // three tenths, not three times a tenth
      effects.wrenches = {{.slot = 1, .force = {kForce, 0, 0}, .from = static_cast<double>(first) / per_second}};
      effects.wrenches[0].to = static_cast<double>(first + 4) / per_second;
      Simulation pushed(body(kMass), still(h), effects), free(body(kMass), still(h));
      for (Simulation* one : {&pushed, &free}) {
        set(*one, {0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, 3, 0.1, 0});
        run(*one, first);
      }
      INFO("step " << first << " of " << h << " s");
      CHECK(std::ranges::equal(pushed.positions(), free.positions()));
      CHECK(std::ranges::equal(pushed.momenta(), free.momenta()));
      run(pushed, 4);
      const double all = pushed.momenta()[3];
      // a step is solved to 1e-10
      CHECK(all == Approx(kMass * 3 + kForce * 4 * h).epsilon(1e-9));
      run(pushed, 3);
      CHECK(pushed.momenta()[3] == Approx(all).epsilon(1e-9));
    }
  }
}

TEST_CASE("steps that are split take the tables of their parts", "[forces]") {
  // 4 rad a step: more than a step can turn
  constexpr double kInertia = 0.02, kRate = 40, kStep = 0.1;
  Effects effects;
  effects.torques = {{.row = 0, .force = {{0.013, 0.013, 0.061, 0.09, 0.212, 0.212}, {0, 0.4, 0.3, -0.2, 0.5, 0}}}};
  Simulation simulation(rotor(kInertia), still(kStep), effects);
  set(simulation, {0}, {kRate});
  const StepReport report = simulation.step();
  REQUIRE(report.ok());
  REQUIRE(report.substeps > 1);
  CHECK(simulation.momenta()[0] == Approx(kInertia * kRate + integral(effects.torques[0].force, 0, kStep)).epsilon(1e-13));
  run(simulation, 4);
  CHECK(simulation.momenta()[0] == Approx(kInertia * kRate + integral(effects.torques[0].force, 0, 1)).epsilon(1e-13));
}

TEST_CASE("the work of pushes that come and go is booked to second order of the step on an arm", "[forces]") {
  Effects effects;
  effects.torques = {{.row = 1, .force = {{0.1003, 0.1003, 0.2011, 0.2011}, {0, 0.05, 0.02, 0}}}};
  effects.wrenches = {{.slot = 3, .point = {0.02, 0, 0.05}, .force = {0.6, 0, 0.3}, .moment = {0, 0.01, 0}, .from = 0.0507, .to = 0.1213},
                      {.slot = 2, .force = {0, 0, 0.4}, .in_world = false, .from = 0.1307, .to = 0.1711}};
  double error[2];
  for (int halving = 0; halving < 2; ++halving) {
    Simulation simulation(chain(3), {.step = 1e-3 / (1 + halving)}, effects);
    set(simulation, {0.3, -0.4, 0.5}, {1, -2, 3});
    const double before = simulation.energy().total();
    error[halving] = 0;
    for (int k = 0; k < 250 * (1 + halving); ++k) {
      run(simulation, 1);
      error[halving] = std::max(error[halving], std::abs(balance(simulation) - before));
    }
    CHECK(std::abs(simulation.effect_work().of<JointTorque>()) > 1e-3);
    CHECK(std::abs(simulation.effect_work().of<BodyWrench>()) > 1e-3);
  }
  INFO("errors " << error[0] << ", " << error[1]);
  CHECK(error[0] < 1e-4);
  CHECK(error[0] / error[1] > 3.5);
}

TEST_CASE("a servo follows a sinusoid as the driven oscillator it is, to second order", "[forces]") {
  const double a = 0.02, k = 3, c = 0.2, amplitude = 0.4, w = 9, duration = 2;
  struct Drive {
    const char* name;
    bool velocity, feedforward;
  };
  for (const Drive drive : {Drive{"target alone", false, false}, Drive{"with its velocity", true, false}, Drive{"and force", true, true}}) {
    // a x'' + c x' + k x = Im(force e^iwt): x = Im(answer e^iwt), started on it
    const std::complex<double> i(0, 1);
    const std::complex<double> force =
        amplitude * (k + (drive.velocity ? i * c * w : 0) - (drive.feedforward ? std::complex<double>(a * w * w) : 0));
    const std::complex<double> answer = force / (k - a * w * w + i * c * w);
    if (drive.feedforward) CHECK(std::abs(answer - amplitude) < 1e-12);  // it lacks nothing
    Effects effects;
    effects.servos = {{.row = 0, .stiffness = k, .damping = c, .target_over_time = sinusoid(amplitude, w, duration)}};
    if (drive.velocity) effects.servos[0].target_velocity = sinusoid(amplitude * w, w, duration, std::numbers::pi / 2);
    if (drive.feedforward) effects.servos[0].feedforward = sinusoid(-a * amplitude * w * w, w, duration);
    double error[2];
    for (int halving = 0; halving < 2; ++halving) {
      Simulation simulation(rotor(a), still(4e-3 / (1 + halving)), effects);
      set(simulation, {answer.imag()}, {(i * w * answer).imag()});
      const double before = balance(simulation);
      error[halving] = 0;
      for (int step = 0; step < 450 * (1 + halving); ++step) {
        run(simulation, 1);
        const double exact = (answer * std::exp(i * w * simulation.time())).imag();
        error[halving] = std::max(error[halving], std::abs(simulation.positions()[0] - exact));
      }
      CHECK(balance(simulation) == Approx(before).margin(1e-10));
    }
    INFO(drive.name << ": errors " << error[0] << ", " << error[1]);
    CHECK(error[0] < 1e-3 * amplitude);
    CHECK(error[0] / error[1] == Approx(4).epsilon(0.1));
  }
}

TEST_CASE("a servo that holds its joint fast is at its table's target at the end of the step, and not before its time", "[forces]") {
  // 200 times what a step needs to stop the rotor
  constexpr double kInertia = 1e-3, kStep = 1e-3;
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 2e5, .damping = 20, .target_over_time = {{0, 0.1, 0.1, 1}, {0, 0, 0.2, 2}}}};
  Simulation simulation(rotor(kInertia), still(kStep), effects);
  run(simulation, 100);
  CHECK(simulation.positions()[0] == 0);
  run(simulation, 400);
  // what is left is what damping asks for: the target's velocity is not given
  CHECK(simulation.positions()[0] == Approx(0.2 + 2 * 0.4 - 20 * 2 / 2e5).epsilon(1e-5));
}

TEST_CASE("a feed-forward torque that equals the weight's holds an arm where it stands", "[forces]") {
  constexpr double kMass = 1.5, kArm = 0.3, kAngle = 0.7;
  // about y a turn brings the x axis down
  const double weight = kMass * kArm * 9.81 * std::cos(kAngle);
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 0, .feedforward = {{0}, {-weight}}}};
  Simulation simulation(one_joint(JointType::revolute, kMass, 0.01, {kArm, 0, 0}), {}, effects);
  set(simulation, {kAngle}, {0});
  run(simulation, 200);
  CHECK(simulation.positions()[0] == Approx(kAngle).margin(1e-12));
  CHECK(simulation.velocities()[0] == Approx(0).margin(1e-10));
}

TEST_CASE("a servo's force limit holds for all that it gives, feed-forward too", "[forces]") {
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 1, .target = 100, .max_force = 0.4, .feedforward = {{0}, {30}}}};
  Simulation simulation(rotor(0.02), still(), effects);
  set(simulation, {0}, {2});
  run(simulation, 100);
  CHECK(simulation.velocities()[0] == Approx(2 + 0.4 / 0.02 * 0.1).epsilon(1e-12));
}

TEST_CASE("a target that is set goes over the servo's table until the table has it back", "[forces][batch]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 30, .damping = 1.5, .target = 9, .target_over_time = {{0, 0}, {7, 0.5}}}};
  Simulation simulation(rotor(), still(), effects);
  const auto settled = [&] {
    run(simulation, 3000);
    return simulation.positions()[0];
  };
  CHECK(settled() == Approx(0.5).margin(1e-9));
  simulation.set_servo_targets(std::vector<double>{-0.3});
  CHECK(settled() == Approx(-0.3).margin(1e-9));
  simulation.set_servo_targets(std::vector<double>{nan});
  CHECK(settled() == Approx(0.5).margin(1e-9));
  effects.servos[0].target_over_time = {{}, {}};
  Simulation without(rotor(), still(), effects);
  CHECK_THROWS_AS(without.set_servo_targets(std::vector<double>{nan}), InputError);

  effects.servos[0].target_over_time = {{0, 0}, {7, 0.5}};
  Batch batch(rotor(), 5, still(), effects);
  for (std::int64_t i = 0; i < 5; ++i) CHECK(std::isnan(batch.servo_targets()(i, 0)));
  batch.servo_targets()(2, 0) = -0.3;
  batch.step(3000);
  for (std::int64_t i = 0; i < 5; ++i) CHECK(batch.positions()(i, 0) == Approx(i == 2 ? -0.3 : 0.5).margin(1e-9));
  batch.servo_targets()(2, 0) = nan;
  batch.step(3000);
  CHECK(batch.positions()(2, 0) == Approx(0.5).margin(1e-9));
}

TEST_CASE("a joint goes no faster than its limit of velocity, and what that takes is booked", "[forces][limits]") {
  constexpr double kInertia = 0.1, kTorque = 1, kMost = 0.5, kReached = kMost * kInertia / kTorque;
  for (const double way : {1.0, -1.0}) {
    for (const double h : {1e-3, 7e-3}) {
      Effects effects;
      effects.torques = {{.row = 0, .force = {{0}, {way * kTorque}}}};
      effects.limits = {{.row = 0, .velocity = kMost}};
      Simulation simulation(rotor(kInertia), still(h), effects);
      double last = 0;
      for (int step = 0; step < 200; ++step) {
        run(simulation, 1);
        const double moved = simulation.positions()[0] - last;
        last = simulation.positions()[0];
        REQUIRE(std::abs(moved) <= kMost * h * (1 + 1e-12));
        if (simulation.time() < kReached + 3 * h) continue;
        REQUIRE(moved == Approx(way * kMost * h).epsilon(1e-12));
        REQUIRE(simulation.velocities()[0] == Approx(way * kMost).epsilon(1e-9));
      }
      // from rest at constant acceleration, then at constant velocity
      const double exact = 0.5 * kMost * kReached + kMost * (simulation.time() - kReached);
      CHECK(simulation.positions()[0] == Approx(way * exact).margin(kMost * h));
      const EffectWork& work = simulation.effect_work();
      CHECK(work.of<JointTorque>() == Approx(kTorque * std::abs(simulation.positions()[0])).epsilon(1e-12));
      CHECK(work.of<JointLimit>() == Approx(work.of<JointTorque>() - 0.5 * kInertia * kMost * kMost).margin(kTorque * kMost * h));
    }
  }
}

TEST_CASE("a joint that is let go leaves its limit of velocity, and one that starts beyond it is slowed at once", "[forces][limits]") {
  constexpr double kInertia = 0.1, kMost = 0.5;
  Effects effects;
  effects.torques = {{.row = 0, .force = {{0.3, 0.3}, {1, -0.5}}}};
  effects.limits = {{.row = 0, .velocity = kMost}};
  Simulation simulation(rotor(kInertia), still(), effects);
  set(simulation, {0}, {3});
  run(simulation, 1);
  CHECK(simulation.positions()[0] == Approx(kMost * 1e-3).epsilon(1e-12));
  CHECK(simulation.effect_work().of<JointLimit>() == Approx(0.5 * kInertia * (9 - kMost * kMost)).epsilon(0.01));
  run(simulation, 299);
  CHECK(simulation.positions()[0] == Approx(kMost * 0.3).epsilon(1e-12));
  run(simulation, 50);
  // 5 rad/s^2 down from the limit, met at half a step
  CHECK(simulation.velocities()[0] == Approx(kMost - 0.5 / kInertia * 0.05).margin(0.006));
  run(simulation, 300);
  CHECK(simulation.velocities()[0] == Approx(-kMost).epsilon(1e-9));
}

TEST_CASE("limits of velocity and of position are one joint's together", "[forces][limits]") {
  Effects effects;
  effects.limits = {{.row = 0, .lower = -0.2, .upper = 1, .velocity = 0.8}};
  Simulation falling(one_joint(JointType::prismatic, 2, 0.01), {.step = 1e-3, .gravity = {0, -9.81, 0}}, effects);
  // along y: held to 0.8 m/s from 0.0815 s on, at the stop after 0.2 m
  const double reached = 0.8 / 9.81, met = reached + (0.2 - 0.5 * 0.8 * reached) / 0.8;
  run(falling, static_cast<int>(std::floor(met / 1e-3)) - 2);
  CHECK(falling.positions()[0] > -0.2);
  CHECK(falling.velocities()[0] == Approx(-0.8).epsilon(1e-9));
  run(falling, 5);
  CHECK(falling.positions()[0] == Approx(-0.2).margin(1e-12));
  run(falling, 500);
  CHECK(falling.positions()[0] == Approx(-0.2).margin(1e-12));
  // the weight's work is all that there was to take
  CHECK(falling.effect_work().of<JointLimit>() == Approx(2 * 9.81 * 0.2).margin(2 * 9.81 * 0.8 * 1e-3));

  effects.limits = {{.row = 0, .velocity = 0}};
  Simulation locked(one_joint(JointType::prismatic, 2, 0.01), {.gravity = {0, -9.81, 0}}, effects);
  run(locked, 200);
  CHECK(locked.positions()[0] == 0);
}

TEST_CASE("every joint of a falling chain keeps to its limit of velocity, and the limits only take", "[forces][limits]") {
  Effects effects;
  for (Index row = 0; row < 4; ++row) effects.limits.push_back({.row = row, .velocity = 1.0 + 0.5 * row});
  effects.damping = {{.row = 1, .coefficient = 1e-4}};
  Simulation simulation(chain(4), {}, effects);
  set(simulation, {0.3, -0.2, 0.4, 0.1}, {0, 0, 0, 0});
  const double before = simulation.energy().total();
  std::vector<double> last(simulation.positions().begin(), simulation.positions().end());
  double taken = 0;
  int held = 0;
  for (int step = 0; step < 2000; ++step) {
    run(simulation, 1);
    for (std::size_t row = 0; row < 4; ++row) {
      const double moved = std::abs(simulation.positions()[row] - last[row]), most = effects.limits[row].velocity * 1e-3;
      REQUIRE(moved <= most * (1 + 1e-9));
      held += moved >= most * (1 - 1e-9) ? 1 : 0;
    }
    REQUIRE(simulation.effect_work().of<JointLimit>() >= taken - 1e-12);
    taken = simulation.effect_work().of<JointLimit>();
    last.assign(simulation.positions().begin(), simulation.positions().end());
  }
  CHECK(held > 100);
  CHECK(taken > 0.1);
  CHECK(balance(simulation) == Approx(before).margin(0.01 * taken));
}

TEST_CASE("a follower's limit of velocity holds its leader", "[forces][limits]") {
  const Model hand = load_urdf(model_file("hand.urdf"), Base::fixed);
  REQUIRE_FALSE(hand.mimics.empty());
  const Mimic& mimic = hand.mimics.front();
  constexpr double kMost = 0.5;
  Effects effects;
  effects.limits = on_leaders(hand, {JointLimit{.row = mimic.follower_v, .velocity = kMost}});
  effects.torques = {{.row = mimic.leader_v, .force = {{0}, {1e-3}}}};
  Simulation simulation(hand, still(), effects);
  const auto position = [&] { return simulation.positions()[static_cast<std::size_t>(mimic.follower_q)]; };
  double last = position(), fastest = 0;
  for (int step = 0; step < 300; ++step) {
    run(simulation, 1);
    fastest = std::max(fastest, std::abs(position() - last) / 1e-3);
    last = position();
  }
  CHECK(fastest == Approx(kMost).epsilon(1e-9));
}

TEST_CASE("a humanoid that starts with its joints at and beyond all their limits at once finds out which of them hold", "[forces][limits]") {
  const std::shared_ptr<const Model> humanoid = std::make_shared<const Model>(load_urdf(model_file("humanoid.urdf"), Base::floating));
  for (const double velocity : {0.0, 0.5, 0.1}) {
    Effects effects;
    effects.limits = urdf_limits(*humanoid);
    if (velocity > 0) {
      for (JointLimit& limit : effects.limits) limit.velocity = velocity;
    }
    Simulation simulation(humanoid, still(), effects);
    Batch batch(humanoid, 40, still(), effects);
    batch.reset_all([&](std::int64_t i, std::span<double> q, std::span<double> v) {
      const InitialState start = random_state(*humanoid, static_cast<std::uint64_t>(i + 120), 1);
      std::ranges::copy(start.positions, q.begin());
      std::ranges::copy(start.velocities, v.begin());
    });
    batch.step(20);
    CHECK(batch.summary().frozen == 0);
    for (const std::uint64_t seed : {3u, 4u, 5u, 29u, 60u, 139u, 143u, 1059u}) {
      random_start(simulation, seed, 1);
      const double energy = simulation.energy().total();
      for (int step = 0; step < 30; ++step) {
        INFO("velocity " << velocity << ", seed " << seed << ", step " << step);
        const StepReport report = simulation.step();
        REQUIRE(report.ok());
        CHECK(report.substeps == 1);
      }
      CHECK(simulation.energy().total() < energy * (1 + 1e-9));
    }
  }
}

TEST_CASE("forces over time and limits of velocity move an instance of a batch as a simulation, in any parts and company",
          "[forces][batch]") {
  const std::shared_ptr<const Model> model = std::make_shared<const Model>(chain(4));
  Effects effects;
  effects.torques = {{.row = 2, .force = {{0, 0.0513, 0.0513, 0.1}, {0.1, 0.4, -0.3, -0.2}}}};
  effects.wrenches = {{.slot = 3, .force = {0.3, 0, 0.1}, .moment = {0, 0.1, 0}, .from = 0.02021, .to = 0.1507}};
  effects.servos = {{.row = 1,
                     .stiffness = 5,
                     .damping = 0.3,
                     .max_force = 0.6,
                     .target_over_time = {{0, 0.0707, 0.2}, {0, 0.4, 0.1}},
                     .target_velocity = {{0, 0.0707, 0.0707}, {5, 5, -2}},
                     .feedforward = {{0.03, 0.0333}, {0, 0.1}}}};
  effects.limits = {{.row = 3, .lower = -0.5, .upper = 0.6, .velocity = 2}, {.row = 0, .velocity = 1.5}};
  const std::vector<double> q{0.1, -0.2, 0.3, 0.25}, v{0.5, -0.4, 0.8, 1.5};
  constexpr int kSteps = 200;
  Simulation whole(model, {}, effects), parts(model, {}, effects);
  for (Simulation* one : {&whole, &parts}) set(*one, q, v);
  run(whole, kSteps);
  for (int step = 0; step < kSteps; ++step) run(parts, 1);
  CHECK(std::ranges::equal(whole.positions(), parts.positions()));
  CHECK(std::ranges::equal(whole.momenta(), parts.momenta()));

  const auto rolled = [&](std::int64_t size, std::int64_t which, const std::vector<std::int64_t>& steps) {
    Batch batch(model, size, {}, effects);
    for (std::int64_t i = 0; i < size; ++i) {
      std::vector<double> mine = q;
      mine[0] += 0.01 * static_cast<double>(i - which);
      batch.reset(i, mine, v);
    }
    for (const std::int64_t n : steps) batch.step(n);
    CHECK(batch.summary().frozen == 0);
    const auto end = batch.positions().instance(which);
    return std::vector<double>(end.begin(), end.end());
  };
  const std::vector<double> alone = rolled(1, 0, {kSteps});
  CHECK(distance(whole.positions(), alone) < 1e-7);
  CHECK(rolled(7, 3, {kSteps}) == alone);
  CHECK(rolled(4, 1, {1, 50, kSteps - 51}) == alone);

  // an instance that starts late is at its own time, in single precision nearly and after long
  FloatBatch single(model, 3, {}, effects);
  for (std::int64_t i = 0; i < 3; ++i) single.reset(i, q, v);
  single.step(20'037);
  single.reset(1, q, v);
  single.step(kSteps);
  std::vector<double> numbers;
  for (const float value : single.positions().instance(1)) numbers.push_back(static_cast<double>(value));
  CHECK(distance(whole.positions(), numbers) < 2e-3);
}

TEST_CASE("in single precision a push after an hour still gives its impulse", "[forces][batch]") {
  Effects effects;
  effects.wrenches = {{.slot = 1, .force = {2, 0, 0}, .from = 360.0523, .to = 360.1004}};
  FloatBatch batch(body(2), 1, still(1e-2), effects);
  batch.reset(0, std::vector<double>{0, 0, 0, 0, 0, 0, 1}, std::vector<double>{0, 0, 0, 1, 0, 0});
  batch.step(36'020);
  CHECK(batch.momenta()(0, 3) == Approx(2 + 2 * 0.0481).epsilon(1e-4));
}

}  // namespace linden::forces_test
