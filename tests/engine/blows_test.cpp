// Joints that strike their limits.
#include <catch2/catch.hpp>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/batch.hpp"
#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "scenes.hpp"
#include "tests/reference/plain_scene.hpp"

namespace linden::blows_test {
namespace {

/// `links` links of half a kilogram about y, 0.2 m apart.
Model links_in_a_row(int links) {
  TreeBuilder builder("row");
  for (int k = 0; k < links; ++k) {
    LinkSpec link;
    link.name = "l" + std::to_string(k);
    link.joint = "j" + std::to_string(k);
    if (k > 0) {
      link.parent = "l" + std::to_string(k - 1);
      link.placement.translation().z() = -0.2;
    }
    link.axis = Eigen::Vector3d::UnitY();
    link.inertia = {0.5, Eigen::Vector3d(0, 0, -0.1), 0.002 * Eigen::Matrix3d::Identity()};
    builder.add(link);
  }
  return builder.build();
}

Effects limited(int joints, double at, double restitution) {
  Effects effects;
  for (int k = 0; k < joints; ++k) effects.limits.push_back({.row = k, .lower = -at, .upper = at, .restitution = restitution});
  return effects;
}

Options weightless(double h) { return {.step = h, .gravity = {0, 0, 0}}; }

}  // namespace

TEST_CASE("a joint between two limits bounces as the closed form says, at any step", "[blows]") {
  // a triangle wave; with e its speed falls by e at each limit
  for (const double h : {1e-4, 1e-3, 7e-3}) {
    for (const double e : {1.0, 0.5}) {
      Simulation simulation(links_in_a_row(1), weightless(h), limited(1, 0.3, e));
      simulation.set_positions(std::vector<double>{0.10003});  // no step ends on a limit
      simulation.set_velocities(std::vector<double>{2.0});
      double q = 0.10003, v = 2;
      const int steps = static_cast<int>(1 / h);
      for (int k = 0; k < steps; ++k) {
        run(simulation, 1);
        q += h * v;
        if (std::abs(q) > 0.3) {
          q = std::copysign(0.3 - e * (std::abs(q) - 0.3), q);
          v *= -e;
        }
        REQUIRE(simulation.positions()[0] == Approx(q).margin(1e-9));
        REQUIRE(simulation.velocities()[0] == Approx(v).margin(1e-9));
      }
      const double inertia = 0.002 + 0.5 * 0.01;
      CHECK(simulation.energy().kinetic == Approx(0.5 * inertia * v * v).epsilon(1e-9));
      CHECK(simulation.effect_work().of<JointLimit>() == Approx(0.5 * inertia * (4 - v * v)).margin(1e-12));
    }
  }
}

TEST_CASE("a joint bounces from the first step on: at its limit, or within a step of it", "[blows]") {
  for (const double gap : {0.0, 1e-12, 1e-5, 0.5e-3}) {
    Simulation simulation(links_in_a_row(1), weightless(1e-3), limited(1, 0.3, 1));
    simulation.set_positions(std::vector<double>{0.3 - gap});
    simulation.set_velocities(std::vector<double>{1.0});
    run(simulation, 100);
    CHECK(simulation.positions()[0] == Approx(0.3 + gap - 0.1).margin(1e-9));
    CHECK(simulation.velocities()[0] == Approx(-1).margin(1e-9));
  }
}

TEST_CASE("joints that all bounce elastically keep their energy, with gravity and without", "[blows]") {
  for (const int joints : {2, 3, 6}) {
    for (const double gravity : {0.0, -9.81}) {
      for (const double h : {5e-4, 2e-3}) {
        Simulation simulation(links_in_a_row(joints), {.step = h, .gravity = {0, 0, gravity}}, limited(joints, 0.5, 1));
        std::vector<double> v;
        for (int k = 0; k < joints; ++k) v.push_back(k % 2 == 0 ? 6 + k : -9 + k);
        simulation.set_velocities(v);
        const double before = simulation.energy().total();
        const double kinetic = simulation.energy().kinetic;
        run(simulation, static_cast<int>(5 / h));
        INFO(joints << " joints, gravity " << gravity << ", step " << h);
        CHECK(std::abs(simulation.energy().total() - before) < 2e-2 * kinetic * (h / 5e-4));
        for (const double q : simulation.positions()) CHECK(std::abs(q) < 0.5 + 1e-12);
        CHECK(std::abs(simulation.effect_work().of<JointLimit>()) < 1e-9 * kinetic);
        CHECK(simulation.passive_gifts().empty());
      }
    }
  }
}

TEST_CASE("after a blow the velocity is the one after the blow, and its work is booked with it", "[blows]") {
  for (const double e : {0.0, 0.6}) {
    Effects effects = limited(2, 10, 0);
    effects.limits[1] = {.row = 1, .lower = -10, .upper = 0.2, .restitution = e};
    Simulation simulation(links_in_a_row(2), weightless(1e-3), effects);
    simulation.set_velocities(std::vector<double>{0.5, 1.3});
    const double before = simulation.energy().kinetic;
    std::vector<double> last = simulation.velocities();
    for (int k = 0; simulation.effect_work().of<JointLimit>() == 0; ++k) {
      last = simulation.velocities();
      REQUIRE(k < 1000);
      run(simulation, 1);
      CHECK(simulation.energy().kinetic + simulation.effect_work().of<JointLimit>() == Approx(before).epsilon(1e-5));
    }
    CHECK(simulation.velocities()[1] == Approx(-e * last[1]).margin(2e-2 * e + 1e-12));
    CHECK(simulation.effect_work().of<JointLimit>() > 0);
    run(simulation, 200);
    CHECK(simulation.energy().kinetic + simulation.effect_work().of<JointLimit>() == Approx(before).epsilon(1e-5));
  }
}

TEST_CASE("a blow leaves no joint faster than its limit of velocity, nor one that rests on a limit within it, and all is booked", "[blows]") {
  // the second of three joints strikes; the third is thrown about by it, the first rests on its limit
  for (const double h : {2e-4, 1e-3}) {
    Effects effects = limited(3, 10, 0.8);
    effects.limits[0] = {.row = 0, .lower = 0, .upper = 10};
    effects.limits[1] = {.row = 1, .lower = -10, .upper = 0.2, .restitution = 0.8};
    effects.limits[2].velocity = 0.3;
    Simulation simulation(links_in_a_row(3), weightless(h), effects);
    simulation.set_velocities(std::vector<double>{0, 1.3, 0});
    const double before = simulation.energy().kinetic;
    bool struck = false;
    for (int k = 0; k < static_cast<int>(0.6 / h); ++k) {
      const StepReport report = simulation.step();
      REQUIRE(report.ok());
      struck = struck || report.blows > 1;
      const std::vector<double> v = simulation.velocities();
      REQUIRE(std::abs(v[2]) <= 0.3);
      REQUIRE((simulation.positions()[0] > 1e-9 || v[0] >= 0));
      REQUIRE(simulation.energy().kinetic + simulation.effect_work().of<JointLimit>() == Approx(before).epsilon(h / 2e-4 * 1e-3));
    }
    CHECK(struck);
    CHECK(simulation.passive_gifts().empty());
  }
}

TEST_CASE("what rests on a limit stays there while another joint bounces, as long as its limit has to push", "[blows]") {
  // a blow on the second of two links throws the first one up
  for (const double e : {0.0, 0.6, 1.0}) {
    Effects effects = limited(2, 0.3, e);
    for (const bool into : {true, false}) {
      Simulation simulation(links_in_a_row(2), weightless(1e-6), effects);
      simulation.set_positions(std::vector<double>{into ? 0.3 : -0.3, 0.3});
      simulation.set_velocities(std::vector<double>{0, 1.3});
      const double before = simulation.energy().kinetic;
      run(simulation, 1);
      CHECK(simulation.velocities()[1] == Approx(-e * 1.3).margin(1e-5));
      if (into) CHECK(simulation.velocities()[0] == 0);
      if (!into) CHECK(simulation.velocities()[0] > 0.1);
      CHECK(simulation.energy().kinetic + simulation.effect_work().of<JointLimit>() == Approx(before).epsilon(1e-5));
      if (into) CHECK(simulation.energy().kinetic == Approx(e * e * before).margin(1e-5 * before));
    }
  }
}

TEST_CASE("of many joints that are stopped at once no limit pulls, and none that pushes lets its joint go", "[blows]") {
  // v+ - v = M^-1 lambda, by the plain mass matrix; some joints move into limits, some rest on them, some leave them
  const int joints = 12;
  const Model model = links_in_a_row(joints);
  for (int trial = 0; trial < 20; ++trial) {
    Effects effects = limited(joints, 0.3, 0);
    effects.limits[5].velocity = 0.1;
    Simulation simulation(model, weightless(1e-8), effects);
    std::vector<double> q, v;
    for (int k = 0; k < joints; ++k) {
      const int turn = (k + 1) * (trial % 6 + 1) % 7;
      q.push_back(k == 5 ? 0.1 : (k * k + trial) % 3 == 0 ? -0.3 : 0.3);
      v.push_back(k == 5 ? 0 : turn - 3);
    }
    simulation.set_positions(q);
    simulation.set_velocities(v);
    const double before = simulation.energy().kinetic;
    run(simulation, 1);
    reference::PlainScene plain(model, {}, {0, 0, 0});
    plain.start(Eigen::Map<const Eigen::VectorXd>(q.data(), joints), Eigen::Map<const Eigen::VectorXd>(v.data(), joints));
    const std::vector<double> after = simulation.velocities();
    const Eigen::VectorXd change = Eigen::Map<const Eigen::VectorXd>(after.data(), joints) - plain.v;
    const Eigen::VectorXd impulse = plain.mass_matrix() * change;
    const double scale = impulse.cwiseAbs().maxCoeff();
    CAPTURE(trial, impulse.transpose(), plain.v.transpose(), change.transpose());
    REQUIRE(scale > 1e-3);
    for (int k = 0; k < joints; ++k) {
      const auto row = static_cast<std::size_t>(k);
      if (k == 5) {
        // neither at a limit; it may be thrown about no faster than its limit of velocity
        CHECK(std::abs(after[row]) < 0.1 + 1e-9);
        CHECK((std::abs(impulse[k]) < 1e-4 * scale || impulse[k] * after[row] < 0));
        continue;
      }
      const double out = q[row] > 0 ? -1 : 1;
      CHECK(out * after[row] > -1e-9);
      CHECK(out * impulse[k] > -1e-4 * scale);
      CHECK(std::min(std::abs(after[row]), std::abs(impulse[k]) / scale) < 1e-4);
    }
    CHECK(simulation.energy().kinetic + simulation.effect_work().of<JointLimit>() == Approx(before).epsilon(1e-4));
    CHECK(simulation.effect_work().of<JointLimit>() > 0);
  }
}

TEST_CASE("what a blow makes the drive of a given motion give is booked, once", "[blows]") {
  for (const double e : {0.0, 0.6}) {
    Effects effects;
    effects.motions = {{.row = 0, .position = {{0, 1}, {0, 0.5}}}};
    effects.limits = {{.row = 1, .lower = -10, .upper = 0.2, .restitution = e}};
    Simulation simulation(links_in_a_row(2), weightless(1e-4), effects);
    simulation.set_velocities(std::vector<double>{0.5, 1.3});
    const auto balance = [&] {
      return simulation.energy().kinetic + simulation.effect_work().taken() - simulation.effect_work().given();
    };
    run(simulation, 1000);
    const double before = balance(), driven = simulation.effect_work().of<JointMotion>();
    REQUIRE(simulation.effect_work().of<JointLimit>() == 0);
    run(simulation, 1000);
    REQUIRE(simulation.effect_work().of<JointLimit>() > 0);
    CHECK(std::abs(simulation.effect_work().of<JointMotion>() - driven) > 1e-3);
    CHECK(balance() == Approx(before).margin(1e-5));
  }
}

TEST_CASE("a step that fails leaves all as it was, a start that was struck and what effects remember", "[blows]") {
  Effects effects = limited(2, 0.3, 0);
  effects.limits[1].velocity = 1;
  effects.damping = {{.row = 0, .coefficient = 0.01}, {.row = 1, .coefficient = 0.01}};
  // at its upper limit and into it; faster than it may be; and so fast that it turns by more than pi, half a step too
  Options options = weightless(1e-3);
  options.max_splits = 1;
  Simulation simulation(links_in_a_row(3), options, effects);
  simulation.set_positions(std::vector<double>{0.3, 0.1, 0});
  simulation.set_velocities(std::vector<double>{0.7, 2, 1e4});
  const std::vector<double> q(simulation.positions().begin(), simulation.positions().end()), v = simulation.velocities();
  const double energy = simulation.energy().total();
  REQUIRE_FALSE(simulation.step().ok());
  CHECK(std::ranges::equal(simulation.positions(), q));
  CHECK(simulation.velocities() == v);
  CHECK(simulation.energy().total() == energy);
  CHECK(simulation.effect_work().of<JointLimit>() == 0);
}

TEST_CASE("what bounces ever lower under gravity comes to rest on its limit", "[blows]") {
  for (const double e : {0.5, 0.95}) {
    Effects effects;
    effects.limits = {{.row = 0, .lower = 0.4, .upper = 1, .restitution = e}};
    Simulation simulation(links_in_a_row(1), {}, effects);
    simulation.set_positions(std::vector<double>{0.6});
    double highest = 0;
    run(simulation, 30'000);
    for (int k = 0; k < 1000; ++k) {
      run(simulation, 1);
      highest = std::max(highest, simulation.positions()[0] - 0.4);
    }
    CHECK(highest < 1e-9);
    CHECK(std::abs(simulation.velocities()[0]) < 1e-12);
    CHECK(simulation.passive_gifts().empty());
  }
}

TEST_CASE("instances of a batch bounce as simulations do", "[blows]") {
  const Model model = links_in_a_row(3);
  const Effects effects = limited(3, 0.1, 0.8);
  Options options;
  options.gravity = {0, 0, -9.81};
  Batch batch(model, 11, options, effects);
  const auto speeds = [](std::int64_t i) { return std::vector<double>{1.0 + 0.1 * static_cast<double>(i), -2.0, 1.5}; };
  for (std::int64_t i = 0; i < batch.size(); ++i) batch.reset(i, std::vector<double>(3, 0.0), speeds(i));
  batch.step(400);
  CHECK(batch.summary().rescued > 0);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    Simulation simulation(model, options, effects);
    simulation.set_velocities(speeds(i));
    run(simulation, 400);
    for (Index row = 0; row < 3; ++row) CHECK(batch.positions()(i, row) == Approx(simulation.positions()[static_cast<std::size_t>(row)]).margin(1e-5));
  }
}

}  // namespace linden::blows_test
