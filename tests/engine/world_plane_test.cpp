// Planes without end that stand in the world: what rests, slides, rolls and tumbles on them, alone and in a batch, and as a thick slab has it.
#include <catch2/catch.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <random>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "engine/start_check.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/engine/solids.hpp"

namespace linden::world_plane_test {
namespace {

using Catch::Matchers::Contains;
using Eigen::Vector3d;

using namespace solids_test;

#ifdef LINDEN_SANITIZED  // which takes ten times as long
constexpr int kDrops = 1;
constexpr std::array kSteps{5e-3};
#else
constexpr int kDrops = 6;
constexpr std::array kSteps{5e-4, 1e-3, 5e-3};
#endif

/// A floor that falls towards +x by an angle.
struct Slope {
  double angle;
  Vector3d up{std::sin(angle), 0, std::cos(angle)}, down{std::cos(angle), 0, -std::sin(angle)};
  std::string world() const { return fmt::format("  - {{type: plane, name: floor, normal: [{:.17g}, 0, {:.17g}]}}\n", up.x(), up.z()); }
  std::string turn() const { return fmt::format(", rotation: [0, {:.17g}, 0]", angle); }
};

TEST_CASE("a ball rolls down a plane with five sevenths of the pull", "[world_plane]") {
  const Solids solids;
  const Slope slope{0.2};
  for (const double step : kSteps) {
    CAPTURE(step);
    Simulation simulation(solids.scene(slope.world(), body("ball", 0.1 * slope.up), 0.5, step));
    run(simulation, steps_of(2, step));
    const Vector3d way = place(simulation) - 0.1 * slope.up;
    CHECK(way.dot(slope.down) == Approx(5.0 / 14 * kGravity * std::sin(slope.angle) * 4).epsilon(1.5 * step));
    CHECK(std::abs(way.dot(slope.up)) < 1e-6);
    CHECK(std::abs(way.y()) < 1e-9);
  }
}

TEST_CASE("a block holds on a plane below the angle of friction, and slides above it as Coulomb has it", "[world_plane]") {
  const Solids solids;
  for (const double step : kSteps) {
    for (const double share : {0.9, 1.1}) {
      CAPTURE(step, share);
      const Slope slope{std::atan(share * 0.5)};
      Simulation simulation(solids.scene(slope.world(), body("block", 0.1 * slope.up, slope.turn()), 0.5, step));
      run(simulation, steps_of(2, step));
      const double way = (place(simulation) - 0.1 * slope.up).dot(slope.down);
      if (share < 1) CHECK((way > 0 && way < 2.5e-6));
      else CHECK(way == Approx(2 * kGravity * (std::sin(slope.angle) - 0.5 * std::cos(slope.angle))).epsilon(2 * step + 1e-4));
    }
  }
}

TEST_CASE("what tumbles on a plane moves as on the top of a slab, and gains no energy", "[world_plane]") {
  const Solids solids;
  for (const double step : kSteps) {
    for (std::uint64_t seed = 1; seed <= kDrops; ++seed) {
      CAPTURE(step, seed);
      std::mt19937_64 engine(seed);
      std::uniform_real_distribution<double> random(-1, 1);
      const auto next = [&] { return random(engine); };
      std::string models;
      double x = -1;
      for (const char* const name : {"ball", "block", "can"}) {
        const double roll = 3 * next(), pitch = next(), yaw = 3 * next(), v = next(), w = 5 * next();
        models += body(name, {x, 0, 0.5}, fmt::format(", rotation: [{}, {}, {}], velocity: [0, {}, 0], angular_velocity: [{}, 0, 1]", roll, pitch, yaw, v, w));
        x += 1;
      }
      Simulation plane(solids.scene("  - {type: plane, name: floor}\n", models, 0.5, step));
      Simulation slab(solids.scene("  - {type: box, name: floor, size: [40, 40, 2], position: [0, 0, -1]}\n", models, 0.5, step));
      const double start = plane.energy().total();
      double last = start, rises = 0, last_on_slab = start, rises_on_slab = 0, apart = 0;
      for (int k = 0; k < steps_of(3, step); ++k) {
        const StepReport report = plane.step();
        if (!report.ok()) FAIL(plane.describe(report));
        if (!slab.step().ok()) FAIL("on the slab");
        const double now = plane.energy().total();
        rises += std::max(0.0, now - last);
        last = now;
        rises_on_slab += std::max(0.0, slab.energy().total() - last_on_slab);
        last_on_slab = slab.energy().total();
        // until the first of them has bounced about: what differs by rounding grows then
        if (k * step < 0.3) apart = std::max(apart, distance(plane.positions(), slab.positions()));
        CHECK(std::abs(now + plane.effect_work().taken() - start) < 1e-2 * start);
      }
      CHECK(apart < 1e-9);
      CHECK(rises < (step > 2e-3 ? 2e-2 : 2e-4));  // [J], of some 15
      CHECK(rises == Approx(rises_on_slab).margin(1e-8));
      CHECK(last < 0.6 * start);
      for (std::size_t k = 0; k < 3; ++k) CHECK(place(plane, k).z() > 0.1 - 1e-5 - 0.2 * kGravity * step * step);
    }
  }
}

TEST_CASE("a room of planes holds what flies about in it, far from the world's origin too", "[world_plane]") {
  const Solids solids;
  const std::string world = "  - {type: plane, name: floor, height: -1}\n  - {type: plane, name: ceiling, normal: [0, 0, -1], height: 0}\n"
                            "  - {type: plane, name: left, normal: [1, 0, 0], height: 2000}\n  - {type: plane, name: right, normal: [-1, 0, 0], height: -2001}\n"
                            "  - {type: plane, name: front, normal: [0, 1, 0], height: 0}\n  - {type: plane, name: back, normal: [0, -1, 0], height: -1}\n";
  Scene scene = solids.scene(world, body("block", {2000.5, 0.5, -0.5}, ", velocity: [3, 4, 5], angular_velocity: [1, 2, 3]"), 0, 1e-3);
  for (ContactMaterial& material : scene.effects.contact->materials) material.restitution = 1;
  Simulation simulation(scene);
  for (int k = 0; k < 40; ++k) {
    run(simulation, 50);
    const Vector3d at = place(simulation) - Vector3d(2000.5, 0.5, -0.5);
    CHECK(at.cwiseAbs().maxCoeff() < 0.5 - 0.1 + 1e-3);
  }
  CHECK(simulation.energy().kinetic > 5);
}

TEST_CASE("whoever begins in a plane is told so", "[world_plane]") {
  const Solids solids;
  const Scene scene = solids.scene("  - {type: plane, name: floor}\n", body("block", {0, 0, 0.05}), 0.5, 1e-3);
  const StartFindings found = StartCheck(scene.model, scene.options, scene.effects).look(scene.initial.positions);
  CHECK(found.sound());
  REQUIRE(found.told.size() == 1);
  CHECK_THAT(found.told[0], Contains("\"world/floor\"") && Contains("start 0.05 m deep in each other"));
}

TEST_CASE("in a batch those near a plane go alone and the others together, each as it does in any company", "[world_plane][batch]") {
  const Solids solids;
  const Slope slope{0.3};
  const Scene scene = solids.scene(slope.world(), body("can", {0, 0, 0.3}, ", angular_velocity: [1, 2, 0]"), 0.5, 1e-3);
  constexpr std::int64_t kSize = 9;
  Batch batch(scene, kSize, {.threads = 2});
  const auto start = [&](std::int64_t i) {
    std::vector<double> q = scene.initial.positions;
    q[2] += 0.3 * static_cast<double>(i);
    return q;
  };
  for (std::int64_t i = 0; i < kSize; ++i) batch.reset(i, start(i), scene.initial.velocities);
  batch.step(300);
  CHECK(batch.record(0).rescued > 100);
  CHECK(batch.record(kSize - 1).rescued == 0);
  for (std::int64_t i = 0; i < kSize; ++i) {
    Batch alone(scene, 1, {.threads = 1});
    alone.reset(0, start(i), scene.initial.velocities);
    alone.step(300);
    CHECK(alone.positions().instance(0) == batch.positions().instance(i));
    CHECK(alone.record(0) == batch.record(i));
    Simulation simulation(scene);
    simulation.set_positions(start(i));
    simulation.set_velocities(scene.initial.velocities);
    run(simulation, 300);
    CHECK((alone.positions().instance(0) - Eigen::Map<const Eigen::VectorXd>(simulation.positions().data(), 7)).cwiseAbs().maxCoeff() < 1e-8);
  }
}

}  // namespace
}  // namespace linden::world_plane_test
