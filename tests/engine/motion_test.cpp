// Joints whose motion is given are where it is, at the force that this takes, with the energy booked.
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include "engine/batch.hpp"
#include "engine/simulation.hpp"
#include "layout/smooth_curve.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/builder.hpp"
#include "scenes.hpp"
#include "tests/reference/plain_curve.hpp"
#include "tests/scratch_folder.hpp"

namespace linden::motion_test {
namespace {

using Eigen::Vector3d;

constexpr double kCart = 3, kBob = 2, kLength = 0.7;  // [kg, kg, m]

LinkSpec point_mass(const std::string& link, const std::string& joint, JointType type, double mass, const Vector3d& center) {
  LinkSpec spec;
  spec.name = link;
  spec.joint = joint;
  spec.type = type;
  spec.axis = type == JointType::prismatic ? Vector3d::UnitX() : Vector3d::UnitY();
  spec.inertia = {mass, center, Eigen::Matrix3d::Zero()};
  return spec;
}

/// A cart that slides along x, a bob on a rod below it.
Model crane() {
  TreeBuilder builder("crane");
  builder.add(point_mass("cart", "rail", JointType::prismatic, kCart, Vector3d::Zero()));
  LinkSpec bob = point_mass("bob", "rope", JointType::revolute, kBob, Vector3d(0, 0, -kLength));
  bob.parent = "cart";
  return builder.add(bob).build();
}

/// Of a joint still to be named.
JointMotion through(TimeTable table) { return {-1, std::move(table)}; }

/// A wave by its places and velocities, so many points a second.
JointMotion wave(double size, double w, double points, double duration) {
  JointMotion motion = through({{}, {}});
  for (int k = 0; k <= static_cast<int>(points * duration); ++k) {
    motion.position.times.push_back(k / points);
    motion.position.values.push_back(size * std::sin(w * k / points));
    motion.velocities.push_back(size * w * std::cos(w * k / points));
  }
  return motion;
}

Effects moved(const Model& model, const std::string& joint, JointMotion motion) {
  Effects effects;
  motion.row = row_of(model, joint);
  effects.motions.push_back(std::move(motion));
  return effects;
}

double balance(Simulation& simulation) {
  return simulation.energy().total() + simulation.effect_work().taken() - simulation.effect_work().given();
}

TEST_CASE("A joint is on the curve at the end of every step, however steps are split") {
  const Model model = crane();
  const Effects effects = moved(model, "rail", wave(0.4, 5, 40, 2));
  const SmoothCurve curve(effects.motions[0].position, effects.motions[0].velocities);
  Simulation one(model, {.step = 2e-3}, effects), many(model, {.step = 2e-3}, effects);
  for (int k = 1; k <= 500; ++k) {
    REQUIRE(one.step().ok());
    CHECK(one.positions()[0] == Approx(curve.at(one.time())).margin(1e-15));
  }
  many.run(500);
  CHECK(std::ranges::equal(one.positions(), many.positions()));
}

TEST_CASE("The force of a given motion is mass times acceleration") {
  const Model model = TreeBuilder("cart").add(point_mass("cart", "rail", JointType::prismatic, kCart, Vector3d::Zero())).build();
  constexpr double kSize = 0.3, kRate = 4;
  double errors[2];
  for (int fine = 0; fine < 2; ++fine) {
    const double h = fine == 0 ? 2e-3 : 1e-3;
    Simulation cart(model, {.step = h, .gravity = {0, 0, 0}}, moved(model, "rail", wave(kSize, kRate, 1000, 3)));
    double error = 0;
    for (int k = 0; k < static_cast<int>(2 / h); ++k) {
      const double begin = cart.time();
      REQUIRE(cart.step().ok());
      if (k > 0) error = std::max(error, std::abs(cart.motion_forces()[0] + kCart * kSize * kRate * kRate * std::sin(kRate * begin)));
    }
    errors[fine] = error;
  }
  const double most = kCart * kSize * kRate * kRate;
  CHECK(errors[0] < 2e-5 * most);
  CHECK(errors[1] < 0.3 * errors[0]);
}

/// Angle of the rope under a cart at x(t), by Runge and Kutta's method: l a'' = -x'' cos a - g sin a.
double angle_under(double size, double w, double duration) {
  const auto bend = [&](double t, double a) { return (size * w * w * std::sin(w * t) * std::cos(a) - 9.81 * std::sin(a)) / kLength; };
  constexpr int kSteps = 20000;
  const double h = duration / kSteps;
  double a = 0, v = -size * w / kLength;  // the bob hangs still in the world while the cart sets off
  for (int k = 0; k < kSteps; ++k) {
    const double t = k * h;
    const double v1 = v, a1 = bend(t, a), v2 = v + h / 2 * a1, a2 = bend(t + h / 2, a + h / 2 * v1), v3 = v + h / 2 * a2,
                 a3 = bend(t + h / 2, a + h / 2 * v2), v4 = v + h * a3, a4 = bend(t + h, a + h * v3);
    a += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return a;
}

TEST_CASE("What hangs on a joint that is moved swings as it must, to second order, and the account of energy stays") {
  constexpr double kSize = 0.2, kRate = 5, kDuration = 1.5;
  const Model model = crane();
  const double expected = angle_under(kSize, kRate, kDuration);
  double error[3], stray[3];
  for (int level = 0; level < 3; ++level) {
    const double h = 4e-3 / (1 << level);
    Simulation simulation(model, {.step = h}, moved(model, "rail", wave(kSize, kRate, 4000, 2)));
    simulation.set_velocities(std::vector<double>{0, kSize * kRate / kLength});
    const double first = balance(simulation);
    stray[level] = 0;
    for (int k = 0; k < static_cast<int>(std::lround(kDuration / h)); ++k) {
      REQUIRE(simulation.step().ok());
      stray[level] = std::max(stray[level], std::abs(balance(simulation) - first));
      CHECK(simulation.velocities()[0] == Approx(kSize * kRate * std::cos(kRate * simulation.time())).margin(20 * h * h));
    }
    error[level] = std::abs(simulation.positions()[1] + expected);  // about y a rope that swings forward turns the other way
    CHECK(simulation.effect_work().of<JointMotion>() != 0);
  }
  CHECK(error[1] < 0.3 * error[0]);
  CHECK(error[2] < 0.3 * error[1]);
  CHECK(error[2] < 1e-5);
  CHECK(stray[1] < 0.3 * stray[0]);
  CHECK(stray[2] < 0.3 * stray[1]);
}

TEST_CASE("A joint that is held in place is a fixed one") {
  TreeBuilder fixed("pendulum");
  LinkSpec alone = point_mass("bob", "rope", JointType::revolute, kBob, Vector3d(0, 0, -kLength));
  alone.placement.translation() = Vector3d(0.25, 0, 0);
  const Model pendulum = fixed.add(alone).build(), model = crane();
  Simulation free(pendulum, {.step = 1e-3}), held(model, {.step = 1e-3}, moved(model, "rail", through({{0}, {0.25}})));
  free.set_positions(std::vector<double>{1.2});
  held.set_positions(std::vector<double>{0, 1.2});
  for (int k = 0; k < 2000; ++k) {
    REQUIRE(free.step().ok());
    REQUIRE(held.step().ok());
    CHECK(held.positions()[0] == 0.25);
    CHECK(held.positions()[1] == Approx(free.positions()[0]).margin(1e-9));
    CHECK(held.velocities()[0] == 0);
    CHECK(held.velocities()[1] == Approx(free.velocities()[0]).margin(1e-8));
  }
  CHECK(std::abs(held.effect_work().of<JointMotion>()) < 1e-12);
  CHECK(held.energy().total() == Approx(free.energy().total()).epsilon(1e-9));
}

TEST_CASE("Instances of a batch move as a simulation does, each in its own time, and a checkpoint goes on to the bit") {
  const Model model = crane();
  Effects effects = moved(model, "rail", wave(0.3, 6, 50, 2));
  effects.damping.push_back({row_of(model, "rope"), 0.1});
  Simulation simulation(model, {.step = 1e-3}, effects);
  Batch batch(model, 19, {}, effects);
  batch.step(400);
  batch.reset(3, std::vector<double>{9, 0}, std::vector<double>{9, 0});
  batch.step(300);
  simulation.run(300);
  const auto of = [&](std::int64_t i) { return batch.positions().instance(i); };
  for (int row = 0; row < 2; ++row) CHECK(of(3)[row] == Approx(simulation.positions()[static_cast<std::size_t>(row)]).margin(1e-9));
  CHECK(batch.observe().velocities()(3, 1) == Approx(simulation.velocities()[1]).margin(1e-7));
  simulation.run(400);
  for (int row = 0; row < 2; ++row) CHECK(of(0)[row] == Approx(simulation.positions()[static_cast<std::size_t>(row)]).margin(1e-9));
  for (std::int64_t i = 1; i < 19; ++i) {
    if (i != 3) CHECK(of(i) == of(0));
  }
  CHECK(batch.summary().rescued == 0);

  const ScratchFolder folder;
  const std::string file = folder.file("state");
  simulation.save(file);
  Simulation other(model, {.step = 1e-3}, effects);
  other.load(file);
  CHECK(other.velocities() == simulation.velocities());
  simulation.run(200);
  other.run(200);
  CHECK(std::ranges::equal(other.positions(), simulation.positions()));
  CHECK(other.motion_forces() == simulation.motion_forces());
}

TEST_CASE("A motion that begins and ends at speed is a blow, with its work booked") {
  const Model model = crane();
  double stray[2];
  for (int fine = 0; fine < 2; ++fine) {
    const double h = fine == 0 ? 1e-3 : 5e-4;
    Simulation simulation(model, {.step = h}, moved(model, "rail", through({{0.1, 0.4}, {0, 0.6}})));
    const double first = balance(simulation);
    stray[fine] = 0;
    for (int k = 0; k < static_cast<int>(std::lround(0.7 / h)); ++k) {
      REQUIRE(simulation.step().ok());
      stray[fine] = std::max(stray[fine], std::abs(balance(simulation) - first));
    }
    CHECK(simulation.positions()[0] == 0.6);
    CHECK(simulation.velocities()[0] == 0);
    CHECK(simulation.effect_work().of<JointMotion>() > 0.1);  // what the bob is left with
    CHECK(stray[fine] < 1e-3 * simulation.effect_work().of<JointMotion>());
  }
  CHECK(stray[1] < 0.6 * stray[0]);  // first order: a blow acts along the mean of two displacements, between which bodies turn
}

TEST_CASE("What cannot be moved so is refused") {
  const Model model = crane();
  const auto refused = [&](const Effects& effects) {
    try {
      check(effects, model);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  Effects twice = moved(model, "rail", through({{0, 1}, {0, 1}}));
  twice.motions.push_back(twice.motions[0]);
  CHECK(refused(twice).find("named twice") != std::string::npos);
  CHECK(refused(moved(model, "rail", through({{0, 1, 1}, {0, 1, 2}}))).find("at two places at 1 s") != std::string::npos);
  Effects stopped = moved(model, "rail", through({{0, 1}, {0, 1}}));
  stopped.friction.push_back({row_of(model, "rail"), 1});
  CHECK(refused(stopped).find("effects.friction[0]: the motion of row 0 (rail) is given") != std::string::npos);
  CHECK_THROWS_AS(Simulation(model, {.step = 1e-3, .order = 4}, moved(model, "rail", through({{0, 1}, {0, 1}}))), InputError);
}

TEST_CASE("A joint that a table holds by two points stays there, however fast it moves next") {
  const Model model = crane();
  Simulation simulation(model, {.step = 1e-3}, moved(model, "rail", through({{0, 0.5, 0.6, 2}, {0.2, 0.2, 0.5, 0.5}})));
  for (int k = 0; k < 1500; ++k) {
    REQUIRE(simulation.step().ok());
    if (simulation.time() < 0.5) CHECK(simulation.positions()[0] == 0.2);
    if (simulation.time() > 0.6001) CHECK(simulation.positions()[0] == 0.5);
    if (simulation.time() < 0.4995) CHECK(simulation.energy().kinetic == 0);
  }
}

TEST_CASE("The smooth curve goes through its points, never beyond those around it, and has one slope at each") {
  const TimeTable table{{0, 0.3, 0.5, 1.1, 1.2, 1.6, 2.5, 2.6}, {1, -0.5, -0.5, -0.4999, 2, 2.5, 0, 0.4}};
  const SmoothCurve curve(table);
  const reference::PlainCurve plain(through(table));
  for (std::size_t k = 0; k < table.times.size(); ++k) CHECK(curve.at(table.times[k]) == Approx(table.values[k]).margin(1e-15));
  for (double t = -0.2; t < 2.8; t += 0.0137) {
    CHECK(curve.at(t) == Approx(plain.derivative(0, t)).margin(1e-13));
    CHECK(curve.slope(t) == Approx(plain.derivative(1, t)).margin(1e-12));
    std::size_t k = 0;
    while (k + 2 < table.times.size() && table.times[k + 1] < t) ++k;
    const auto [least, most] = std::minmax(table.values[k], table.values[k + 1]);
    CHECK(curve.at(t) >= least - 1e-12);
    CHECK(curve.at(t) <= most + 1e-12);
    if (t > 0.3 && t < 0.5) CHECK(curve.at(t) == -0.5);
  }
  for (std::size_t k = 1; k + 1 < table.times.size(); ++k) {
    CHECK(curve.slope(table.times[k] - 1e-9) == Approx(curve.slope(table.times[k])).margin(1e-5));
  }
}

TEST_CASE("Slopes that are given make the curve of a smooth motion exact to fourth order, and it says how far it goes") {
  double error[2] = {};
  for (int fine = 0; fine < 2; ++fine) {
    const JointMotion motion = wave(1, 3, fine == 0 ? 5 : 10, 2);
    const SmoothCurve smooth(motion.position, motion.velocities);
    const reference::PlainCurve plain(motion);
    for (double t = 0.001; t < 1.99; t += 0.01) {
      error[fine] = std::max(error[fine], std::abs(smooth.at(t) - std::sin(3 * t)));
      CHECK(smooth.at(t) == Approx(plain.derivative(0, t)).margin(1e-13));
    }
    double most = 0, least = 0;
    for (const auto& [time, value] : smooth.extremes()) {
      CHECK(smooth.at(time) == Approx(value).margin(1e-12));
      most = std::max(most, value);
      least = std::min(least, value);
    }
    CHECK(most == Approx(1).margin(2e-3));
    CHECK(least == Approx(-1).margin(2e-3));
  }
  CHECK(error[1] < 0.08 * error[0]);
}

}  // namespace
}  // namespace linden::motion_test
