#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include "engine/batch.hpp"
#include "engine/drift.hpp"
#include "engine/scene/scene_file.hpp"
#include "folder.hpp"
#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "scenes.hpp"

namespace linden::effects_test {
namespace {

constexpr double kG = 9.81;

/// One body of the given mass and inertia on a joint along or about z, its centre of mass at `center`.
Model one_joint(JointType type, double mass, double inertia, const Eigen::Vector3d& center = Eigen::Vector3d::Zero(),
                const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ()) {
  LinkSpec link;
  link.name = "link";
  link.joint = "joint";
  link.type = type;
  link.axis = axis;
  link.inertia = {mass, center, inertia * Eigen::Matrix3d::Identity()};
  return TreeBuilder("one joint").add(link).build();
}
Model rotor(double inertia = 0.02) { return one_joint(JointType::revolute, 1, inertia); }
Model slider(double mass = 2) { return one_joint(JointType::prismatic, mass, 0.01); }
Model body(double mass = 2, double inertia = 0.01) { return one_joint(JointType::free, mass, inertia); }

Options still(double step = 1e-3) { return {.step = step, .gravity = {0, 0, 0}}; }

void set(Simulation& simulation, std::vector<double> q, std::vector<double> v) {
  simulation.set_positions(q);
  simulation.set_velocities(v);
}

/// Position after `duration` seconds.
double after(Simulation simulation, double duration) {
  run(simulation, static_cast<int>(std::lround(duration / simulation.options().step)));
  return simulation.positions()[0];
}

/// Of a x'' + c x' + k x = 0 from x = x0 at rest.
double oscillator(double a, double c, double k, double x0, double t) {
  const double decay = c / (2 * a), square = k / a - decay * decay;
  if (std::abs(square) < 1e-9 * decay * decay) return x0 * std::exp(-decay * t) * (1 + decay * t);
  const double w = std::sqrt(std::abs(square));
  if (square > 0) return x0 * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
  return x0 * std::exp(-decay * t) * (std::cosh(w * t) + decay / w * std::sinh(w * t));
}

/// Energy plus what effects took less what they gave.
double balance(Simulation& simulation) {
  return simulation.energy().total() + simulation.effect_work().taken() - simulation.effect_work().given();
}

}  // namespace

TEST_CASE("a damped oscillator follows its closed form, whatever its damping, to second order", "[effects]") {
  const double a = 0.02, k = 3, x0 = 0.4, critical = 2 * std::sqrt(a * k);
  for (const double c : {0.1 * critical, critical, 3 * critical}) {
    Effects effects;
    effects.springs = {{.row = 0, .stiffness = k, .rest = 0.1}};
    effects.damping = {{.row = 0, .coefficient = c}};
    double error[2];
    for (int halving = 0; halving < 2; ++halving) {
      Simulation simulation(rotor(a), still(1e-3 / (1 + halving)), effects);
      set(simulation, {0.1 + x0}, {0});
      run(simulation, 200);
      CHECK(balance(simulation) == Approx(0.5 * k * x0 * x0).epsilon(1e-11));
      set(simulation, {0.1 + x0}, {0});
      error[halving] = std::abs(after(std::move(simulation), 0.7) - 0.1 - oscillator(a, c, k, x0, 0.7));
    }
    INFO("damping " << c << ": errors " << error[0] << ", " << error[1]);
    CHECK(error[0] < 1e-4 * x0);
    CHECK(error[0] / error[1] == Approx(4).epsilon(0.1));
  }
}

TEST_CASE("a rotor's inertia acts as if the link had it", "[effects]") {
  const Eigen::Vector3d center(0.3, 0, 0);
  LinkSpec link;
  link.name = "link";
  link.joint = "joint";
  link.axis = Eigen::Vector3d::UnitY();
  link.inertia = {1, center, 0.01 * Eigen::Matrix3d::Identity()};
  const Model bare = TreeBuilder("pendulum").add(link).build();
  link.inertia.about_center(1, 1) += 0.05;
  const Model heavy = TreeBuilder("pendulum").add(link).build();
  Effects effects;
  effects.armature = {{.row = 0, .inertia = 0.05}};
  Simulation one(bare, {}, effects), other(heavy, {});
  set(one, {0.3}, {1});
  set(other, {0.3}, {1});
  CHECK(one.momenta()[0] == Approx(other.momenta()[0]).epsilon(1e-14));
  run(one, 1000);
  run(other, 1000);
  CHECK(one.positions()[0] == Approx(other.positions()[0]).margin(1e-11));
  CHECK(one.energy().total() == Approx(other.energy().total()).margin(1e-11));
  CHECK(one.velocities()[0] == Approx(other.velocities()[0]).margin(1e-10));
}

TEST_CASE("a spring sags by weight over stiffness", "[effects]") {
  Effects effects;
  effects.springs = {{.row = 0, .stiffness = 500}};
  effects.damping = {{.row = 0, .coefficient = 40}};
  CHECK(after(Simulation(slider(2), {}, effects), 3) == Approx(-2 * kG / 500).epsilon(1e-9));
}

TEST_CASE("a ball joint's spring swings as slowly as its stiffness says, keeps energy and its turn about the axis of a symmetric body",
          "[effects]") {
  const Model model = one_joint(JointType::ball, 1, 0.02);
  Effects effects;
  const double half = 0.5 * 0.3;
  effects.ball_springs = {{.slot = 1, .stiffness = 3, .rest = {std::sin(half), 0, 0, std::cos(half)}}};
  // a sphere about one axis: an oscillator, at any amplitude
  Simulation simulation(model, still(), effects);
  set(simulation, {std::sin(half + 0.4), 0, 0, std::cos(half + 0.4)}, {0, 0, 0});
  const double before = simulation.energy().total();
  run(simulation, 700);
  const double angle = 2 * std::atan2(simulation.positions()[0], simulation.positions()[3]) - 0.3;
  CHECK(angle == Approx(oscillator(0.02, 0, 3, 0.8, 0.7)).margin(1e-4));
  CHECK(simulation.energy().total() == Approx(before).epsilon(1e-9));
  // tumbling about another axis: conserved along every axis of space is the energy alone
  effects.ball_springs[0].stiffness = 30;
  Simulation tumbling(model, still(), effects);
  set(tumbling, {0.1, 0.2, -0.1, 0.9}, {3, -2, 5});
  const double start = tumbling.energy().total();
  double band = 0;
  for (int k = 0; k < 20000; ++k) {
    run(tumbling, 1);
    band = std::max(band, std::abs(tumbling.energy().total() - start));
  }
  CHECK(band < 1e-4 * start);
}

TEST_CASE("a servo steps as the oscillator it is, and with too little force at constant acceleration first", "[effects]") {
  const double a = 0.02, k = 3, c = 0.2;
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = k, .damping = c, .target = 0.5}};
  Simulation free(rotor(a), still(), effects);
  CHECK(after(std::move(free), 0.4) == Approx(0.5 + oscillator(a, c, k, -0.5, 0.4)).margin(2e-5));
  effects.servos[0].max_force = 0.4;
  Simulation limited(rotor(a), still(), effects);
  CHECK(after(std::move(limited), 0.1) == Approx(0.5 * 0.4 / a * 0.01).epsilon(0.02));
  Simulation arrived(rotor(a), still(), effects);
  CHECK(after(std::move(arrived), 5) == Approx(0.5).margin(1e-9));
}

TEST_CASE("a joint below its break-away force does not creep, above it slides as Coulomb says", "[effects]") {
  const double mass = 2, f = 5;
  Effects effects;
  effects.friction = {{.row = 0, .force = f}};
  effects.torques = {{.row = 0, .force = {{0}, {0.999 * f}}}};
  Simulation holding(slider(mass), still(), effects);
  run(holding, 5000);
  CHECK(holding.positions()[0] == 0);
  effects.torques[0].force = {{0, 10}, {0, 2 * f}};
  Simulation rising(slider(mass), still(), effects);
  run(rising, 4990);
  CHECK(rising.positions()[0] == 0);
  run(rising, 20);
  CHECK(rising.positions()[0] > 0);
  run(rising, 990);
  // from t = 5 on the force in excess rises by f / 5 a second
  CHECK(rising.positions()[0] == Approx(f / 5 / mass / 6).epsilon(0.02));
  effects.torques.clear();
  for (const double speed : {0.7, -0.7}) {
    Simulation sliding(slider(mass), still(), effects);
    set(sliding, {0}, {speed});
    run(sliding, 1000);
    const double stopped = sliding.positions()[0];
    CHECK(stopped == Approx(speed * std::abs(speed) / (2 * f / mass)).epsilon(0.01));
    CHECK(sliding.effect_work().of<JointFriction>() == Approx(0.5 * mass * speed * speed).epsilon(1e-3));
    run(sliding, 100);
    CHECK(sliding.positions()[0] == stopped);
  }
}

TEST_CASE("a joint stops at its limit, or bounces with its restitution, and never gains energy", "[effects]") {
  for (const double e : {0.0, 0.5, 0.9, 1.0}) {
    Effects effects;
    effects.limits = {{.row = 0, .lower = -0.2, .upper = 1, .restitution = e}};
    Simulation falling(slider(2), {}, effects);
    double most = 0, least = 0, rebound = -1;
    bool met = false;
    for (int k = 0; k < 1500; ++k) {
      run(falling, 1);
      most = std::max(most, falling.energy().total());
      const double q = falling.positions()[0];
      least = std::min(least, q);
      met = met || falling.velocities()[0] > 0 || q <= -0.2 + 1e-12;  // a blow is met within a step
      if (met && falling.time() < 0.5) rebound = std::max(rebound, q);
    }
    INFO("restitution " << e);
    CHECK(most < 1e-9);
    CHECK(least >= -0.2 - 1e-12);
    CHECK(rebound == Approx(-0.2 + 0.2 * e * e).margin(0.006));
    if (e == 0) {
      CHECK(falling.positions()[0] == Approx(-0.2).margin(1e-12));
      CHECK(balance(falling) == Approx(0).margin(0.05));
    }
  }
}

TEST_CASE("a joint that rests on its limit leaves it when it is pulled away", "[effects]") {
  Effects effects;
  effects.limits = {{.row = 0, .lower = -0.1}};
  effects.torques = {{.row = 0, .force = {{0, 0.999, 1, 2}, {0, 0, 40, 40}}}};
  Simulation simulation(slider(2), {}, effects);
  run(simulation, 990);
  CHECK(simulation.positions()[0] == Approx(-0.1).margin(1e-12));
  run(simulation, 510);
  CHECK(simulation.positions()[0] == Approx(-0.1 + 0.5 * (20 - kG) * 0.25).epsilon(0.01));
}

TEST_CASE("a falling body reaches its terminal velocity along tanh, wind carries it along", "[effects]") {
  const double mass = 2, b = 0.3, terminal = std::sqrt(mass * kG / b);
  Effects effects;
  effects.drag = {{.slot = 1, .quadratic = b}};
  Simulation falling(body(mass), {}, effects);
  run(falling, 1000);
  CHECK(falling.velocities()[5] == Approx(-terminal * std::tanh(kG / terminal)).epsilon(1e-5));
  run(falling, 9000);
  CHECK(falling.velocities()[5] == Approx(-terminal).epsilon(1e-5));
  CHECK(balance(falling) == Approx(0).margin(1e-3));
  effects.drag = {{.slot = 1, .linear = 3}};
  effects.wind = {4, -1, 0};
  Simulation blown(body(mass), still(), effects);
  run(blown, 2000);
  const double share = 1 - std::exp(-3 / mass * 2);
  CHECK(blown.velocities()[3] == Approx(4 * share).epsilon(1e-5));
  CHECK(blown.velocities()[4] == Approx(-share).epsilon(1e-5));
}

TEST_CASE("a wrench accelerates as its force over the mass, in the world's or in the body's directions", "[effects]") {
  Effects effects;
  effects.wrenches = {{.slot = 1, .force = {4, 0, 0}, .from = 0.5, .to = 1.0}};
  Simulation pushed(body(2), still(), effects);
  set(pushed, {0, 0, 0, 0, 0, 0, 1}, {0, 0, 2, 0, 0, 0});
  run(pushed, 1000);
  CHECK(pushed.momentum().linear[0] == Approx(4 * 0.5).epsilon(1e-9));
  CHECK(pushed.positions()[0] == Approx(0.5 * 2 * 0.25).epsilon(1e-6));
  effects.wrenches = {{.slot = 1, .force = {4, 0, 0}, .in_world = false}};
  Simulation turning(body(2), still(), effects);
  set(turning, {0, 0, 0, 0, 0, 0, 1}, {0, 0, 2, 0, 0, 0});
  run(turning, 1000);
  CHECK(turning.momentum().linear[0] == Approx(4 * std::sin(2.0) / 2).epsilon(5e-5));
  CHECK(turning.momentum().linear[1] == Approx(4 * (1 - std::cos(2.0)) / 2).epsilon(5e-5));
  effects.wrenches = {{.slot = 1, .point = {0, 0.1, 0}, .force = {4, 0, 0}, .moment = {0, 0, 0.4}, .in_world = false}};
  Simulation balanced(body(2), still(), effects);
  run(balanced, 500);
  CHECK(balanced.velocities()[2] == Approx(0).margin(1e-12));
  CHECK(balanced.velocities()[3] == Approx(1).epsilon(1e-9));
}

/// A ball of 1 kg, or a box of 2 kg and 0.2 x 0.2 x 0.1 m, on a floating joint.
Effects ball_on_ground(double radius) {
  Effects effects;
  effects.ground = Ground{.stiffness = 2e4, .damping = 0, .friction = 0.5};
  effects.ground->contacts.spheres = {{.slot = 1, .center = {0, 0, 0}, .radius = radius}};
  return effects;
}
Model box() {
  LinkSpec link;
  link.name = "box";
  link.joint = "base";
  link.type = JointType::free;
  link.inertia = box_inertia(2, {0.2, 0.2, 0.1}, Eigen::Vector3d::Zero());
  return TreeBuilder("box").add(link).build();
}
Effects box_on_ground(const std::array<double, 3>& normal, double friction) {
  Effects effects;
  effects.ground = Ground{.normal = normal, .stiffness = 2e5, .damping = 200, .friction = friction};
  for (const double x : {-0.1, 0.1}) {
    for (const double y : {-0.1, 0.1}) {
      for (const double z : {-0.05, 0.05}) effects.ground->contacts.spheres.push_back({.slot = 1, .center = {x, y, z}, .radius = 0});
    }
  }
  return effects;
}

/// Speed with which a body leaves a spring and damper that only push, by RK4 at a thousandth of the contact's time.
double rebound_speed(double mass, double k, double c, double speed) {
  const auto force = [&](double x, double v) { return std::max(0.0, -k * x - c * v) / mass - kG; };
  double x = 0, v = -speed;
  const double h = 1e-3 * std::sqrt(mass / k);
  while (x < 0 || v < 0) {
    const double a1 = force(x, v), v2 = v + h / 2 * a1, a2 = force(x + h / 2 * v, v2), v3 = v + h / 2 * a2;
    const double a3 = force(x + h / 2 * v2, v3), v4 = v + h * a3, a4 = force(x + h * v3, v4);
    x += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return v;
}

TEST_CASE("a ball bounces back to where it fell from on elastic ground, and as high as its damping says on lossy ground", "[effects]") {
  const double mass = 1, k = 2e4, fall = 0.5;
  for (const double zeta : {0.0, 0.1, 0.4}) {
    Effects effects = ball_on_ground(0.1);
    effects.ground->damping = 2 * zeta * std::sqrt(k * mass);
    Simulation simulation(one_joint(JointType::free, mass, 0.004), {.step = 2e-4}, effects);
    set(simulation, {0, 0, 0.1 + fall, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
    const double start = simulation.energy().total();
    double rebound = 0, most = -1e9;
    bool met = false;
    for (int step = 0; step < 4000; ++step) {
      run(simulation, 1);
      met = met || simulation.positions()[2] < 0.1;
      if (met) rebound = std::max(rebound, simulation.positions()[2] - 0.1);
      most = std::max(most, simulation.energy().total());
    }
    const double e = rebound_speed(mass, k, effects.ground->damping, std::sqrt(2 * kG * fall)) / std::sqrt(2 * kG * fall);
    INFO("damping ratio " << zeta << ", e " << e);
    CHECK(most < start + 1e-6);
    if (zeta == 0) {
      CHECK(rebound == Approx(fall).epsilon(1e-3));
      CHECK(simulation.energy().total() == Approx(start).epsilon(1e-7));
    } else {
      CHECK(rebound == Approx(fall * e * e).epsilon(0.01));
    }
    CHECK(balance(simulation) == Approx(start).epsilon(1e-4));
  }
}

TEST_CASE("a block holds on a slope below its angle of friction and slides above it as Coulomb says", "[effects]") {
  const double friction = 0.6, angle_of_friction = std::atan(friction);
  for (const double share : {0.9, 1.1}) {
    const double angle = share * angle_of_friction;
    const std::array<double, 3> normal{std::sin(angle), 0, std::cos(angle)};
    Simulation simulation(box(), {}, box_on_ground(normal, friction));
    const double sag = 2 * kG * std::cos(angle) / (4 * 2e5), height = 0.05 - sag;
    set(simulation, {height * normal[0], 0, height * normal[2], 0, std::sin(angle / 2), 0, std::cos(angle / 2)}, std::vector<double>(6, 0.0));
    run(simulation, 1000);
    const double along = simulation.positions()[0] * std::cos(angle) - simulation.positions()[2] * std::sin(angle);
    INFO("slope of " << share << " of the angle of friction");
    if (share < 1) {
      CHECK(std::abs(along) < 1e-5);
      const double before = along;
      run(simulation, 10000);
      const double later = simulation.positions()[0] * std::cos(angle) - simulation.positions()[2] * std::sin(angle);
      CHECK(std::abs(later - before) < 1.1e-5);
    } else {
      CHECK(along == Approx(0.5 * kG * (std::sin(angle) - friction * std::cos(angle))).epsilon(0.01));
    }
  }
}

TEST_CASE("a rolling ball rolls on at five sevenths of the speed it slid in with", "[effects]") {
  Simulation simulation(one_joint(JointType::free, 1, 0.4 * 0.01), {}, ball_on_ground(0.1));
  set(simulation, {0, 0, 0.1 - kG / 2e4, 0, 0, 0, 1}, {0, 0, 0, 2, 0, 0});
  run(simulation, 2000);
  CHECK(simulation.momentum().linear[0] == Approx(2 * 5.0 / 7).epsilon(0.01));
}

TEST_CASE("nothing stiff blows up or gains energy, with steps far beyond its time constant", "[effects]") {
  const double inertia = 1e-3 * 0.1 * 0.1;
  for (const double h : {1e-3, 1e-2}) {
    for (const char* const kind : {"spring", "damper", "servo", "servo without damping", "ball spring", "all"}) {
      const std::string what = kind;
      const bool ball = what == "ball spring";
      Effects effects;
      if (what == "spring" || what == "all") effects.springs = {{.row = 0, .stiffness = 1e9}};
      if (what == "damper" || what == "all") effects.damping = {{.row = 0, .coefficient = 1e9}};
      if (what == "servo" || what == "all") effects.servos = {{.row = 0, .stiffness = 1e7, .damping = 1e7}};
      if (what == "servo without damping") effects.servos = {{.row = 0, .stiffness = 1e7}};
      if (ball) effects.ball_springs = {{.slot = 1, .stiffness = 1e9}};
      if (what == "all") effects.friction = {{.row = 0, .force = 1e-3}};
      const Model model = one_joint(ball ? JointType::ball : JointType::revolute, 1e-3, inertia, {0.1, 0, 0}, Eigen::Vector3d::UnitY());
      Simulation simulation(model, {.step = h}, effects);
      if (ball) {
        simulation.set_velocities(std::vector<double>{0.3, 1, -0.5});
      } else {
        simulation.set_velocities(std::vector<double>{1});
      }
      const double start = simulation.energy().total();
      double most = start;
      INFO(what << " at " << h << " s");
      for (int k = 0; k < 2000; ++k) {
        run(simulation, 1);
        most = std::max(most, simulation.energy().total());
      }
      CHECK(most <= start * (1 + 1e-6) + 1e-9);
      if (!ball) CHECK(std::abs(simulation.positions()[0]) < 1e-2);
    }
  }
}

TEST_CASE("a batch with effects moves as simulations of its own, to the bit whatever the neighbours and the threads", "[effects][batch]") {
  const Scene scene = load_scene(model_file("scenes/humanoid_drop.yaml"));
  const auto model = std::make_shared<const Model>(scene.model);
  const auto start = [&](std::int64_t i) {
    std::vector<double> q = scene.initial.positions;
    q[2] += 0.013 * static_cast<double>(i);
    return q;
  };
  const std::vector<double> rest(static_cast<std::size_t>(model->tree.shape.velocities), 0.0);
  constexpr std::int64_t kSize = 11;
  constexpr int kSteps = 350;
  const auto rolled = [&](int threads, std::int64_t first, std::int64_t size, std::vector<std::int64_t> parts) {
    Batch batch(model, size, scene.options, scene.effects, {.threads = threads});
    for (std::int64_t i = 0; i < size; ++i) batch.reset(i, start(first + i), rest);
    for (const std::int64_t steps : parts) batch.step(steps);
    CHECK(batch.summary().frozen == 0);
    std::vector<std::vector<double>> ends;
    for (std::int64_t i = 0; i < size; ++i) {
      const auto q = batch.positions().instance(i);
      ends.emplace_back(q.begin(), q.end());
    }
    return ends;
  };
  const auto all = rolled(2, 0, kSize, {kSteps});
  for (std::int64_t i = 0; i < kSize; i += 5) {
    Simulation simulation(model, scene.options, scene.effects);
    simulation.set_positions(start(i));
    run(simulation, kSteps);
    CHECK(distance(simulation.positions(), all[static_cast<std::size_t>(i)]) < 1e-6);
  }
  const auto others = rolled(1, 3, 5, {100, 1, kSteps - 101});
  for (std::size_t i = 0; i < others.size(); ++i) CHECK(others[i] == all[i + 3]);
}

TEST_CASE("instances of a batch have servo targets of their own", "[effects][batch]") {
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 30, .damping = 1.5, .target = 0.2}};
  const Options options = still();
  Batch batch(rotor(), 9, options, effects);
  batch.step(10);
  for (std::int64_t i = 0; i < 9; ++i) batch.servo_targets()(i, 0) = 0.1 * static_cast<double>(i);
  batch.step(5000);
  for (std::int64_t i = 0; i < 9; ++i) CHECK(batch.positions()(i, 0) == Approx(0.1 * static_cast<double>(i)).margin(1e-9));
  Simulation simulation(rotor(), still(), effects);
  simulation.set_servo_targets(std::vector<double>{-0.3});
  run(simulation, 5000);
  CHECK(simulation.positions()[0] == Approx(-0.3).margin(1e-9));
}

TEST_CASE("instances of a batch have joint friction of their own", "[effects][batch]") {
  const double inertia = 0.02, v = 2;
  Effects effects;
  effects.friction = {{.row = 0, .force = 0.4}};
  const Options options = still();
  Batch batch(rotor(inertia), 9, options, effects);
  for (std::int64_t i = 0; i < 9; ++i) {
    batch.friction()(i, 0) = 0.05 * static_cast<double>(i + 1);
    batch.reset(i, std::vector<double>{0}, std::vector<double>{v});
  }
  batch.step(2000);
  // v^2 I / 2 f, taken at the beginnings of steps: half a step of the first velocity more or less
  const auto stops = [&](double force) { return Approx(0.5 * inertia * v * v / force).margin(0.51e-3 * v); };
  for (std::int64_t i = 0; i < 9; ++i) CHECK(batch.positions()(i, 0) == stops(0.05 * static_cast<double>(i + 1)));
  Simulation simulation(rotor(inertia), still(), effects);
  set(simulation, {0}, {v});
  simulation.set_friction(std::vector<double>{0.1});
  run(simulation, 2000);
  CHECK(simulation.positions()[0] == stops(0.1));
  CHECK_THROWS_AS(simulation.set_friction(std::vector<double>{-0.1}), InputError);
  CHECK_THROWS_AS(simulation.set_friction(std::vector<double>{}), InputError);
}

TEST_CASE("what is an instance's own stays its own where joints are tied", "[effects][batch]") {
  const std::shared_ptr<const Model> hand = std::make_shared<const Model>(load_urdf(model_file("hand.urdf"), Base::fixed));
  Effects effects;
  effects.friction = {{.row = 0, .force = 0.1}};
  effects.servos = {{.row = 1, .stiffness = 0.5, .damping = 0.01, .target = 0}};
  Options options;
  Batch batch(hand, 5, options, effects);
  const auto friction = [](std::int64_t i) { return 2e-3 * static_cast<double>(i); };
  const auto target = [](std::int64_t i) { return 0.1 * static_cast<double>(i); };
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    batch.friction()(i, 0) = friction(i);
    batch.servo_targets()(i, 0) = target(i);
  }
  constexpr int kSteps = 200;
  batch.step(kSteps);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    Simulation simulation(hand, options, effects);
    simulation.set_friction(std::vector<double>{friction(i)});
    simulation.set_servo_targets(std::vector<double>{target(i)});
    run(simulation, kSteps);
    for (std::size_t row = 0; row < simulation.positions().size(); ++row) {
      INFO("instance " << i << ", " << hand->names.position[row]);
      CHECK(batch.positions()(i, static_cast<Index>(row)) == Approx(simulation.positions()[row]).margin(1e-7));
    }
    if (i == 0) continue;
    for (const Index row : {0, 1}) CHECK(std::abs(batch.positions()(i, row) - batch.positions()(i - 1, row)) > 1e-5);
  }
}

TEST_CASE("every effect moves an instance of a batch as it moves a simulation, in single precision nearly", "[effects][batch]") {
  const Model model = ball_chain(2);
  const std::shared_ptr<const Model> chained = std::make_shared<const Model>(chain(4));
  Effects joints;
  joints.armature = {{.row = 0, .inertia = 0.02}};
  joints.springs = {{.row = 1, .stiffness = 3, .rest = 0.2}};
  joints.damping = {{.row = 2, .coefficient = 0.05}};
  joints.friction = {{.row = 0, .force = 0.1}};
  joints.limits = {{.row = 3, .lower = -0.2, .upper = 0.3}};
  joints.servos = {{.row = 1, .stiffness = 5, .damping = 0.3, .target = 0.4, .max_force = 0.6}};
  joints.torques = {{.row = 2, .force = {{0, 0.05, 0.1}, {0, 0.4, -0.2}}}};
  joints.drag = {{.slot = 4, .linear = 0.1, .quadratic = 0.2}};
  joints.wind = {0.5, -0.2, 0.1};
  joints.wrenches = {{.slot = 3, .force = {0.3, 0, 0.1}, .moment = {0, 0.1, 0}, .from = 0.02, .to = 0.15}};
  const std::vector<double> q{0.1, -0.2, 0.3, 0.25}, v{0.5, -0.4, 0.8, 1.5};
  constexpr int kSteps = 200;
  const auto numbers_of = [](const auto& batch) {
    std::vector<double> numbers;
    for (const auto value : batch.positions().instance(4)) numbers.push_back(static_cast<double>(value));
    return numbers;
  };
  const auto end_of = [&](auto& batch) {
    for (std::int64_t i = 0; i < batch.size(); ++i) batch.reset(i, q, v);
    batch.step(kSteps);
    CHECK(batch.summary().frozen == 0);
    return numbers_of(batch);
  };
  Simulation simulation(chained, {}, joints);
  set(simulation, q, v);
  run(simulation, kSteps);
  Options options;
  Batch batch(chained, 5, options, joints);
  CHECK(distance(simulation.positions(), end_of(batch)) < 1e-8);
  FloatBatch single(chained, 5, options, joints);
  CHECK(distance(simulation.positions(), end_of(single)) < 1e-3);

  // an instance that starts late is at its own time: the table and the wrench begin anew
  batch.step(37);
  batch.reset(4, q, v);
  batch.step(kSteps);
  CHECK(distance(simulation.positions(), numbers_of(batch)) < 1e-8);

  // the speed that a limit gives back is remembered in single precision
  joints.limits[0].restitution = 0.5;
  Simulation bounced(chained, {}, joints);
  set(bounced, q, v);
  run(bounced, kSteps);
  Batch bounced_batch(chained, 5, options, joints);
  CHECK(distance(bounced.positions(), end_of(bounced_batch)) < 1e-4);
  CHECK(distance(bounced.positions(), simulation.positions()) > 1e-2);

  Effects ball;
  ball.ball_springs = {{.slot = 1, .stiffness = 2, .rest = {0, 0, std::sin(0.2), std::cos(0.2)}}};
  ball.damping = {{.row = 3, .coefficient = 0.02}};
  Simulation turned(model, {}, ball);
  run(turned, kSteps);
  Batch turned_batch(model, 5, options, ball);
  turned_batch.step(kSteps);
  CHECK(distance(turned.positions(), numbers_of(turned_batch)) < 1e-8);
}

TEST_CASE("what is damped far beyond its time constant comes to rest without ringing", "[effects]") {
  for (const double coefficient : {20.0 * 2, 20.0 * 50, 20.0 * 1e6}) {  // ratio 2 and more at 1 ms and 0.02 kg m^2
    Effects effects;
    effects.damping = {{.row = 0, .coefficient = coefficient}};
    Simulation simulation(rotor(), still(), effects);
    set(simulation, {0}, {1});
    double before = simulation.positions()[0], last = 1;
    for (int k = 0; k < 20; ++k) {
      run(simulation, 1);
      const double moved = simulation.positions()[0] - before;
      before = simulation.positions()[0];
      INFO("coefficient " << coefficient << ", step " << k);
      CHECK(moved >= 0);
      CHECK(moved <= last);
      last = moved;
    }
    CHECK(last < 1e-8);
  }
}

TEST_CASE("a cylinder stands upright on its rim and does not wander", "[effects]") {
  LinkSpec can;
  can.name = "can";
  can.joint = "base";
  can.type = JointType::free;
  can.inertia = {1, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.01, 0.01, 0.005).asDiagonal()};
  Effects effects;
  effects.ground = Ground{.stiffness = 1e5, .damping = 300, .friction = 0.6};
  for (const double z : {-0.1, 0.1}) effects.ground->contacts.rims.push_back({.slot = 1, .center = {0, 0, z}, .axis = {0, 0, 1}, .radius = 0.05});
  Simulation standing(TreeBuilder("can").add(can).build(), {}, effects);
  set(standing, {0, 0, 0.1005, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
  run(standing, 5000);
  const auto q = standing.positions();
  CHECK(std::abs(q[0]) + std::abs(q[1]) < 1e-6);
  CHECK(q[2] == Approx(0.1 - 9.81 / 1e5 / 4).margin(1e-6));  // four points of the rim bear the weight
  CHECK(std::abs(q[3]) + std::abs(q[4]) < 1e-6);
  CHECK(std::abs(standing.velocities()[2]) < 1e-6);
}

TEST_CASE("a caller changes wrenches and forces from step to step", "[effects]") {
  Effects effects;
  effects.wrenches = {{.slot = 1}};
  Simulation pushed(body(2), still(), effects);
  for (int k = 0; k < 1000; ++k) {
    pushed.set_wrench(1, {0.001 * k, 0, 0}, {0, 0, 0});
    run(pushed, 1);
  }
  CHECK(pushed.momentum().linear[0] == Approx(0.5 * 0.999).epsilon(1e-9));
  CHECK(pushed.effect_work().of<BodyWrench>() == Approx(0.5 * 2 * std::pow(0.5 * 0.999 / 2, 2)).epsilon(1e-3));
  CHECK_THROWS_AS(pushed.set_wrench(2, {}, {}), InputError);
  CHECK_THROWS_AS(pushed.set_wrench(1, {0, std::nan(""), 0}, {}), InputError);
}

TEST_CASE("a rim rolls, a step in the ground is climbed by what stands on it", "[effects]") {
  // a wheel of 1 kg on its two rims, let go on a slope of 0.1 rad: rolls without slipping, acceleration g sin / (1 + I / m r^2)
  const double r = 0.2, inertia = 0.5 * r * r, angle = 0.1;
  LinkSpec wheel;
  wheel.name = "wheel";
  wheel.joint = "base";
  wheel.type = JointType::free;
  wheel.inertia = {1, Eigen::Vector3d::Zero(), (Eigen::Vector3d(0.03, inertia, 0.03)).asDiagonal()};
  Effects effects;
  effects.ground = Ground{.normal = {std::sin(angle), 0, std::cos(angle)}, .stiffness = 1e5, .damping = 300, .friction = 0.8};
  for (const double y : {-0.05, 0.05}) effects.ground->contacts.rims.push_back({.slot = 1, .center = {0, y, 0}, .axis = {0, 1, 0}, .radius = r});
  Simulation rolling(TreeBuilder("wheel").add(wheel).build(), {}, effects);
  const double height = r - kG * std::cos(angle) / 2e5;
  set(rolling, {height * std::sin(angle), 0, height * std::cos(angle), 0, 0, 0, 1}, std::vector<double>(6, 0.0));
  run(rolling, 1000);
  const double along = rolling.positions()[0] * std::cos(angle) - rolling.positions()[2] * std::sin(angle);
  CHECK(along == Approx(0.5 * kG * std::sin(angle) / (1 + inertia / (r * r))).epsilon(0.01));
  // a ball let fall on a height field rests in its valley
  Effects valley = ball_on_ground(0.1);
  valley.ground->damping = 60;
  HeightField field{.columns = 5, .rows = 3, .spacing_x = 0.5, .spacing_y = 1, .origin_x = -1, .origin_y = -1, .heights = {}};
  for (int row = 0; row < 3; ++row) field.heights.insert(field.heights.end(), {0.5, 0.25, 0, 0.25, 0.5});
  valley.ground->terrain = field;
  valley.drag = {{.slot = 1, .linear = 1}};
  Simulation ball(one_joint(JointType::free, 1, 0.004), {}, valley);
  set(ball, {0.4, 0.1, 0.5, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
  run(ball, 15000);
  CHECK(std::abs(ball.positions()[0]) < 0.03);
  CHECK(ball.positions()[2] > 0.09);
  CHECK(ball.positions()[2] < 0.12);
}

TEST_CASE("the dropped humanoid comes to rest within its limits and stays there without creeping", "[effects]") {
  const Scene scene = load_scene(model_file("scenes/humanoid_drop.yaml"));
  Simulation simulation(scene);
  const auto& attributes = simulation.model().attributes;
  const Tree& tree = simulation.model().tree;
  double beyond = 0;
  std::int64_t iterations = 0;
  const auto simulate = [&](int steps) {
    for (int k = 0; k < steps; ++k) {
      const StepReport report = simulation.step();
      if (!report.ok()) FAIL(simulation.describe(report));
      iterations += report.iterations;
      for (Index i = 2; i < tree.shape.slots; ++i) {
        const double q = simulation.positions()[static_cast<std::size_t>(tree.first_q(i))];
        beyond = std::max({beyond, q - attributes.upper(tree.first_v(i)), attributes.lower(tree.first_v(i)) - q});
      }
    }
  };
  simulate(12000);
  const std::vector<double> rested(simulation.positions().begin(), simulation.positions().end());
  CHECK(rested[2] > 0.88);  // it stands
  simulate(10000);
  CHECK(distance(simulation.positions(), rested) < 1e-3 / 6);
  double fastest = 0;
  for (const double v : simulation.velocities()) fastest = std::max(fastest, std::abs(v));
  CHECK(fastest < 1e-3);
  CHECK(beyond < 1e-9);
  CHECK(static_cast<double>(iterations) / 22000 < 5);
}

TEST_CASE("a run of effects that goes on from a checkpoint is the run that went on", "[effects]") {
  const Folder folder;
  const Scene scene = load_scene(model_file("scenes/humanoid_drop.yaml"));
  Simulation one(scene), other(scene);
  run(one, 400);
  one.save(folder.file("a.checkpoint"));
  run(one, 100);
  other.load(folder.file("a.checkpoint"));
  run(other, 100);
  CHECK(std::ranges::equal(one.positions(), other.positions()));
  CHECK(std::ranges::equal(one.momenta(), other.momenta()));
  CHECK(one.velocities() == other.velocities());
  Simulation without(scene.model, scene.options);
  CHECK_THROWS_WITH(without.load(folder.file("a.checkpoint")), Catch::Contains("was saved with ") && Catch::Contains("the simulation has no "));
}

TEST_CASE("a checkpoint names the joints and bodies that its effects act on, and is refused by others", "[effects]") {
  const Folder folder;
  const Model model = chain(4);
  const std::string file = folder.file("a.checkpoint");
  const auto load = [&](const Effects& saved, const Effects& here) {
    Simulation one(model, {}, saved), other(model, {}, here);
    run(one, 5);
    one.save(file);
    try {
      other.load(file);
      return std::string("loaded");
    } catch (const InputError& error) {
      CHECK(other.steps() == 0);
      const std::string text = error.what();
      return text.substr(0, text.find(", so it would"));
    }
  };
  const std::string begin = file + ": this checkpoint was saved with ";
  Effects one, other;
  one.limits = {{.row = 0, .lower = -1, .upper = 1}};
  other.limits = {{.row = 1, .lower = -1, .upper = 1}};
  CHECK(load(one, other) == begin + "limits on joint1, the simulation has limits on joint2");
  // other numbers are a choice
  other = one;
  other.limits[0].upper = 0.5;
  CHECK(load(one, other) == "loaded");
  // the first kind that differs, what both have left out
  for (Index row = 1; row < 4; ++row) other.limits.push_back({.row = row, .lower = -1, .upper = 1});
  CHECK(load(other, one) == begin + "limits on joint2, joint3, joint4, the simulation has no more limits");
  CHECK(load(one, other) == begin + "no more limits, the simulation has limits on joint2, joint3, joint4");
  other = one;
  other.damping = {{.row = 2, .coefficient = 0.1}};
  CHECK(load(one, other) == begin + "no damping, the simulation has damping on joint3");
  CHECK(load(other, one) == begin + "damping on joint3, the simulation has no damping");
  // what servos remember goes by their order
  one.servos = {{.row = 0, .stiffness = 1}, {.row = 1, .stiffness = 1}};
  other = one;
  std::swap(other.servos[0], other.servos[1]);
  CHECK(load(one, other) == begin + "servos on joint1, joint2, the simulation has servos on joint2, joint1, in another order");
  other = one;
  other.servos[0].stiffness = 2;
  CHECK(load(one, other) == "loaded");
}

TEST_CASE("conservative effects leave no slope in the energy over 100,000 steps, damping's account closes", "[effects]") {
  const Model model = chain(4);
  Effects effects;
  for (Index row = 0; row < 4; ++row) effects.springs.push_back({.row = row, .stiffness = 0.3, .rest = 0.1});
  effects.armature = {{.row = 1, .inertia = 1e-4}};
  Simulation conserving(model, {}, effects);
  random_start(conserving, 3, 0.3);
  EnergyDrift drift(20000);
  drift.add(0, conserving.energy());
  for (int k = 0; k < 20000; ++k) {
    run(conserving, 5);
    drift.add(conserving.time(), conserving.energy());
  }
  INFO("slope " << drift.slope() << " +- " << drift.slope_error() << " J/s, band " << drift.band() << " J");
  CHECK(drift.band() < 1e-3 * drift.scale());
  CHECK(std::abs(drift.slope()) < 4 * drift.slope_error());

  effects.springs.clear();
  for (Index row = 0; row < 4; ++row) effects.damping.push_back({.row = row, .coefficient = 2e-4});
  Simulation damped(model, {.step = 2e-4}, effects);
  random_start(damped, 3, 0.3);
  const double before = damped.energy().total();
  run(damped, 20000);
  CHECK(damped.effect_work().of<JointDamping>() > 0.01);
  CHECK(balance(damped) == Approx(before).margin(1e-4 * damped.effect_work().of<JointDamping>()));
}

TEST_CASE("what the damping of servos takes is taken, not given", "[effects]") {
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 0, .damping = 0.01}};
  Simulation simulation(chain(1), {.gravity = {0, 0, 0}}, effects);
  simulation.set_velocities(std::vector<double>{1});
  const double before = simulation.energy().kinetic;
  run(simulation, 300);
  CHECK(simulation.effect_work().given() == 0);
  CHECK(simulation.effect_work().taken() == Approx(before - simulation.energy().kinetic).epsilon(1e-3));
  CHECK(simulation.effect_work().taken() > 0.1 * before);
}

}  // namespace linden::effects_test
