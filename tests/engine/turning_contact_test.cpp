// Contact that resists rolling and spinning: closed forms on planes and on bodies that move, rest, piles, batches, and what is told of it.
#include <catch2/catch.hpp>
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/scene/scene_bytes.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/engine/solids.hpp"

namespace linden::turning_contact_test {
namespace {

using Eigen::Vector3d;
using namespace solids_test;

constexpr double kRadius = 0.1, kMass = 1, kBallInertia = 0.004;
#ifdef LINDEN_SANITIZED  // which takes ten times as long
constexpr std::array kSteps{5e-3};
constexpr double kRest = 2;
#else
constexpr std::array kSteps{5e-4, 1e-3, 5e-3};
constexpr double kRest = 60;
#endif
const std::string kFloor = "  - {type: plane, name: floor}\n";

/// What touches resists rolling and spinning so [m].
struct Resists {
  double rolling = 0, torsional = 0;
};

Simulation made(const Solids& solids, const std::string& world, const std::string& models, const Resists& resists, double step, double friction = 0.5) {
  Scene scene = solids.scene(world, models, friction, step);
  for (ContactMaterial& material : scene.effects.contact->materials) {
    material.rolling_friction = resists.rolling;
    material.torsional_friction = resists.torsional;
  }
  return Simulation(scene);
}

std::string slope_of(double angle) { return fmt::format("  - {{type: plane, name: floor, normal: [{:.17g}, 0, {:.17g}]}}\n", std::sin(angle), std::cos(angle)); }

/// How far down it a body has come that began on its normal through the origin.
double way_down(const Simulation& simulation, double angle) { return place(simulation).dot(Vector3d(std::cos(angle), 0, -std::sin(angle))); }

double fastest(Simulation& simulation) {
  double most = 0;
  for (const double v : simulation.velocities()) most = std::max(most, std::abs(v));
  return most;
}

/// Of a body that turns about z alone [rad].
double turned(const Simulation& simulation) { return 2 * std::atan2(simulation.positions()[5], simulation.positions()[6]); }

TEST_CASE("a ball on a slope stays where its tangent is below rolling friction over the radius, and rolls down above", "[turning_contact]") {
  const Solids solids;
  const Resists resists{.rolling = 0.02};
  for (const double step : kSteps) {
    for (const double share : {0.5, 0.95, 1.1, 2.0}) {
      CAPTURE(step, share);
      const double angle = std::atan(share * resists.rolling / kRadius);
      const Vector3d up(std::sin(angle), 0, std::cos(angle));
      Simulation simulation = made(solids, slope_of(angle), body("ball", kRadius * up), resists, step);
      run(simulation, steps_of(2, step));
      const double pull = kGravity * (std::sin(angle) - resists.rolling / kRadius * std::cos(angle)), way = way_down(simulation, angle);
      if (share < 1) CHECK((way >= 0 && way < 2.5e-6));
      else CHECK(way == Approx(5.0 / 14 * pull * 4).epsilon(1.5 * step + 1e-5));
      CHECK(std::abs(place(simulation).y()) < 1e-9);
    }
  }
}

TEST_CASE("a ball that rolls on a plane stops after 7 v^2 r / 10 g mu, and stands", "[turning_contact]") {
  const Solids solids;
  const Resists resists{.rolling = 0.01};
  for (const double step : kSteps) {
    CAPTURE(step);
    const std::string rolls = ", velocity: [0.3, 0.4, 0], angular_velocity: [-4, 3, 0]";
    Simulation simulation = made(solids, kFloor, body("ball", {0, 0, kRadius}, rolls), resists, step);
    const double before = simulation.energy().total();
    double last = before, rises = 0;
    for (int k = 0; k < steps_of(1.5, step); ++k) {
      REQUIRE(simulation.step().ok());
      const double now = simulation.energy().total();
      rises += std::max(0.0, now - last);
      last = now;
    }
    const double way = 7 * 0.25 * kRadius / (10 * kGravity * resists.rolling);
    CHECK(place(simulation).x() == Approx(0.6 * way).epsilon(3 * step));
    CHECK(place(simulation).y() == Approx(0.8 * way).epsilon(3 * step));
    CHECK(fastest(simulation) < 1e-9);
    CHECK(rises < 1e-11);  // of 1.2 J, rounding of up to 3,000 steps
    // all that it had was taken
    CHECK(simulation.effect_work().taken() == Approx(0.7 * kMass * 0.25).epsilon(5 * step));
    CHECK(std::abs(last + simulation.effect_work().taken() - before) < 2e-3 * step / 1e-3);
  }
}

TEST_CASE("a ball that spins on a plane stops after w I / mu N seconds, and turns by half of w in that time", "[turning_contact]") {
  const Solids solids;
  const Resists resists{.torsional = 0.02};
  const double w = 8, time = w * kBallInertia / (resists.torsional * kMass * kGravity);
  for (const double step : kSteps) {
    CAPTURE(step);
    Simulation simulation = made(solids, kFloor, body("ball", {0, 0, kRadius}, fmt::format(", angular_velocity: [0, 0, {}]", w)), resists, step);
    run(simulation, static_cast<int>(std::floor(0.5 * time / step)));
    CHECK(simulation.velocities()[2] == Approx(0.5 * w).epsilon(0.02 + 4 * step / time));
    CHECK(simulation.velocities()[2] > 0.4 * w);
    run(simulation, static_cast<int>(std::ceil(0.5 * time / step)) + 12);
    CHECK(std::abs(simulation.velocities()[2]) < 1e-9);
    CHECK(turned(simulation) == Approx(0.5 * w * time).epsilon(2 * step / time));
    CHECK(place(simulation).head<2>().norm() < 1e-9);
  }
}

TEST_CASE("a can that rolls is held at both ends of its side, once by its load", "[turning_contact]") {
  const Solids solids;
  const Resists resists{.rolling = 0.01};
  const std::string rolls = ", rotation: [1.5707963267948966, 0, 0], velocity: [0.5, 0, 0], angular_velocity: [0, 5, 0]";
  Simulation simulation = made(solids, kFloor, body("can", {0, 0, kRadius}, rolls), resists, 1e-3);
  run(simulation, 500);
  const double slows = resists.rolling * kMass * kGravity * kRadius / (0.04 / 6 + kMass * kRadius * kRadius);
  CHECK(place(simulation).x() == Approx(0.25 - 0.5 * slows * 0.25).epsilon(1e-3));
  CHECK(std::abs(place(simulation).y()) < 1e-9);
}

TEST_CASE("a block that spins on its face is held by friction at its corners and by torsional friction together", "[turning_contact]") {
  const Solids solids;
  const double mu = 0.05, torsional = 0.004, w = 3;
  Simulation simulation = made(solids, kFloor, body("block", {0, 0, 0.1}, fmt::format(", angular_velocity: [0, 0, {}]", w)), {.torsional = torsional}, 1e-3, mu);
  run(simulation, 100);
  const double slows = (mu * 0.1 * std::sqrt(2.0) + torsional) * kMass * kGravity / (0.04 / 6);
  CHECK(turned(simulation) == Approx(0.1 * w - 0.5 * slows * 0.01).epsilon(2e-3));
}

TEST_CASE("a ball on a block that is pulled is carried along up to rolling friction over the radius, and rolls back beyond", "[turning_contact]") {
  const Solids solids;
  const Resists resists{.rolling = 0.02};
  const double held = resists.rolling / kRadius * kGravity;
  for (const double share : {0.8, 2.0}) {
    CAPTURE(share);
    // the floor is smooth; links of a scene with two are block/block and ball/ball
    Scene scene = solids.scene(kFloor, body("block", {0, 0, 0.1}) + body("ball", {0, 0, 0.3}), 0.5, 1e-3);
    PairContact& contact = *scene.effects.contact;
    contact.materials = {{.friction = 0}, {.friction = 0.5, .rolling_friction = resists.rolling}};
    for (const auto& [a, b] : contact.pairs) contact.of_pair.push_back(contact.shapes[a].slot == 0 || contact.shapes[b].slot == 0 ? 0 : 1);
    const double force = 2 * share * held;
    scene.effects.wrenches.push_back({.slot = scene.model.names.link.at("block/block").slot, .force = {force, 0, 0}});
    Simulation simulation(scene);
    run(simulation, 200);
    const double block = share < 1 ? force / 2 : (force - 5.0 / 7 * held) / (1 + 2.0 / 7), ball = share < 1 ? block : (2 * block + 5 * held) / 7;
    CHECK(place(simulation, 0).x() == Approx(0.02 * block).epsilon(5e-3));
    CHECK(place(simulation, 1).x() == Approx(0.02 * ball).epsilon(5e-3));
    if (share < 1) CHECK(std::abs(place(simulation, 1).x() - place(simulation, 0).x()) < 1e-6);
  }
}

TEST_CASE("a ball at rest with rolling friction stays where it is for a minute, at any step", "[turning_contact]") {
  const Solids solids;
  for (const double step : kSteps) {
    CAPTURE(step);
    Simulation simulation = made(solids, kFloor, body("ball", {0, 0, kRadius}), {.rolling = 1e-3, .torsional = 1e-3}, step);
    run(simulation, steps_of(0.1, step));
    const Vector3d then = place(simulation);
    run(simulation, steps_of(kRest, step));
    CHECK((place(simulation) - then).norm() < 1e-12);
    CHECK(fastest(simulation) < 1e-10);
    CHECK(simulation.effect_work().taken() < 1e-6);
  }
}

TEST_CASE("balls that strike each other and resist turning keep their momentum, and gain no energy", "[turning_contact]") {
  const Solids solids;
  Scene scene = solids.scene("  - {type: plane, name: far, height: -100}\n",
                             body("ball", {0, 0, 0}, ", velocity: [1, 0, 0], angular_velocity: [10, 5, -8]") + body("block", {0.35, 0.05, 0.02}), 0.5, 1e-3);
  scene.options.gravity = {0, 0, 0};
  scene.effects.contact->materials = {{.stiffness = 1e5, .friction = 0.5, .rolling_friction = 0.03, .torsional_friction = 0.03}};
  Simulation simulation(scene);
  const Momentum first = simulation.momentum();
  const double start = simulation.energy().total();
  double last = start, rises = 0;
  for (int k = 0; k < 500; ++k) {
    REQUIRE(simulation.step().ok());
    rises += std::max(0.0, simulation.energy().total() - last);
    last = simulation.energy().total();
    CHECK(distance(simulation.momentum().linear, first.linear) < 1e-13);
    CHECK(distance(simulation.momentum().angular, first.angular) < 1e-13);
  }
  CHECK(last < 0.97 * start);
  CHECK(rises < 1e-10);
}

/// Balls in a pit, one above the other and a little aside.
std::string pile(int count) {
  std::string models;
  for (int k = 0; k < count; ++k) {
    const std::string one = body("ball", {0.03 * std::sin(5.0 * k), 0.03 * std::cos(3.0 * k), 0.12 + 0.21 * k}, fmt::format(", angular_velocity: [{}, 2, 5]", k));
    models += fmt::format("{}name: b{}{}", one.substr(0, one.find("name: ")), k, one.substr(one.find(", base")));
  }
  return models;
}

TEST_CASE("balls that fall on a plane and on each other come to rest where they resist rolling, and roll away where they do not", "[turning_contact]") {
  const Solids solids;
  for (const double step : kSteps) {
    CAPTURE(step);
    for (const bool resists : {true, false}) {
      Simulation simulation = made(solids, kFloor, pile(6), resists ? Resists{.rolling = 5e-3, .torsional = 5e-3} : Resists{}, step);
      const double start = simulation.energy().total();
      run(simulation, steps_of(6, step));
      CHECK(std::abs(simulation.energy().total() + simulation.effect_work().taken() - start) < 0.02 * start * step / 1e-3);
      if (resists) CHECK(fastest(simulation) < 1e-6);
      else CHECK(fastest(simulation) > 1e-2);
    }
  }
}

TEST_CASE("what resists turning goes on from a checkpoint, from bytes and in a batch as it does alone", "[turning_contact][batch]") {
  const Solids solids;
  Scene scene = solids.scene(kFloor, pile(3), 0.5, 1e-3);
  scene.effects.contact->materials = {{.friction = 0.5, .rolling_friction = 2e-3, .torsional_friction = 3e-3}};
  const auto positions = [](const Simulation& simulation) { return std::vector<double>(simulation.positions().begin(), simulation.positions().end()); };
  Simulation whole(scene), continued(scene), copied(scene_from_bytes(to_bytes(scene)));
  run(whole, 600);
  run(continued, 200);
  const std::string middle = continued.checkpoint();
  run(continued, 100);
  continued.restore(middle);
  run(continued, 400);
  run(copied, 600);
  CHECK(positions(continued) == positions(whole));
  CHECK(positions(copied) == positions(whole));

  constexpr std::int64_t kSize = 8;
  Batch batch(scene, kSize, {.threads = 2});
  const auto start = [&](std::int64_t i) {
    std::vector<double> q = scene.initial.positions;
    q[2] += 0.01 * static_cast<double>(i);
    return q;
  };
  for (std::int64_t i = 0; i < kSize; ++i) batch.reset(i, start(i), scene.initial.velocities);
  batch.step(600);
  for (std::int64_t i = 0; i < kSize; ++i) {
    Batch alone(scene, 1, {.threads = 1});
    alone.reset(0, start(i), scene.initial.velocities);
    alone.step(600);
    CHECK(alone.positions().instance(0) == batch.positions().instance(i));
    CHECK(alone.record(0) == batch.record(i));
    Simulation simulation(scene);
    simulation.set_positions(start(i));
    simulation.set_velocities(scene.initial.velocities);
    run(simulation, 600);
    CHECK((alone.positions().instance(0) - Eigen::Map<const Eigen::VectorXd>(simulation.positions().data(), 21)).cwiseAbs().maxCoeff() < 1e-7);
  }
}

TEST_CASE("where rolling and torsional friction are zero nothing is changed, to the bit", "[turning_contact]") {
  const Solids solids;
  Scene scene = solids.scene(kFloor, pile(3), 0.5, 1e-3);
  const auto positions = [](const Simulation& simulation) { return std::vector<double>(simulation.positions().begin(), simulation.positions().end()); };
  Simulation plain(scene);
  // a pair that resists turning and never meets: memory of contacts is another, motion is not
  PairContact& contact = *scene.effects.contact;
  contact.materials.push_back({.friction = 0.5, .rolling_friction = 1});
  contact.shapes.push_back(contact.shapes.back());
  contact.shapes.back().pose.shift = {0, 0, 1000};
  contact.pairs.emplace_back(1, static_cast<std::uint32_t>(contact.shapes.size() - 1));
  std::ranges::sort(contact.pairs);
  contact.of_pair.resize(contact.pairs.size());
  for (std::size_t k = 0; k < contact.pairs.size(); ++k) contact.of_pair[k] = contact.pairs[k].second + 1 == contact.shapes.size() ? 1 : 0;
  Simulation other(scene);
  run(plain, 600);
  run(other, 600);
  CHECK(positions(plain) == positions(other));
  CHECK(plain.effect_work().taken() == other.effect_work().taken());
}

TEST_CASE("moments of contact are told with its forces, and seen by the body", "[turning_contact]") {
  const Solids solids;
  const Resists resists{.rolling = 0.01, .torsional = 0.02};
  Simulation simulation = made(solids, kFloor, body("ball", {0, 0, kRadius}, ", velocity: [1, 0, 0], angular_velocity: [0, 10, 5]"), resists, 1e-3);
  simulation.keep_forces();
  run(simulation, 10);
  const std::vector<ContactPoint> points = simulation.contact_points();
  REQUIRE(points.size() == 1);
  CHECK(points[0].force[2] == Approx(kGravity).epsilon(1e-6));
  CHECK(points[0].moment[1] == Approx(-resists.rolling * kGravity).epsilon(1e-6));
  CHECK(points[0].moment[2] == Approx(-resists.torsional * kGravity).epsilon(1e-6));
  CHECK(std::abs(points[0].moment[0]) < 1e-4);
  // friction turns it forward, rolling friction backward: 2/7 of the latter are left
  const std::vector<double> wrenches = simulation.body_wrenches();
  const Vector3d moment(&wrenches[6]);
  CHECK(moment.norm() == Approx(std::hypot(2.0 / 7 * resists.rolling * kGravity, resists.torsional * kGravity)).epsilon(1e-2));
}

TEST_CASE("keys of rolling and torsional friction are read of all, and between links", "[turning_contact]") {
  const Solids solids;
  const auto read = [&](const std::string& contact) {
    return parse_scene("models:\n" + body("ball", {0, 0, 1}) + body("block", {1, 0, 1}) + "world: [{type: plane, name: floor}]\neffects: {contact: {" + contact + "}}\n",
                       solids.file("scene.yaml"));
  };
  const Scene scene = read("rolling_friction: 0.01, torsional_friction: 0.002, between: [{links: [ball/ball, world/floor], rolling_friction: 0.03}]");
  const PairContact& contact = *scene.effects.contact;
  REQUIRE(contact.materials.size() == 2);
  CHECK(contact.materials[0].rolling_friction == 0.01);
  CHECK(contact.materials[0].torsional_friction == 0.002);
  CHECK(contact.materials[1].rolling_friction == 0.03);
  CHECK(contact.materials[1].torsional_friction == 0.002);
  CHECK_THROWS_WITH(read("rolling_friction: -1"), Catch::Contains("effects.contact.rolling_friction"));
  CHECK_THROWS_WITH(read("torsional_friction: far"), Catch::Contains("effects.contact.torsional_friction"));
}

}  // namespace
}  // namespace linden::turning_contact_test
