// What is observed of bodies that touch each other: the same in a simulation and in a batch, and what weights and blows say.
#include <catch2/catch.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/queries/observations.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/engine/solids.hpp"

namespace linden::observed_contact_test {
namespace {

using namespace solids_test;
constexpr double kWeight = kGravity;  // of 1 kg
const std::string kFloor = "  - {type: plane, name: floor}\n";

TEST_CASE("a block that carries a ball is pushed at five places by three weights, and the ball at one by its own", "[observed_contact]") {
  const Solids solids;
  const Scene scene = solids.scene(kFloor, body("block", {0, 0, 0.1}) + body("ball", {0.02, 0, 0.3}) + body("can", {3, 0, 2}), 0.5, 1e-3);
  Simulation simulation(scene);
  Observations seen(scene.model, scene.effects, {"contact:block/block", "contact:ball/ball", "contact:can/can"});
  std::vector<double> row(6, -1);
  seen.observe(simulation, row);
  CHECK(row == std::vector<double>(6, 0.0));
  run(simulation, 400);
  seen.observe(simulation, row);
  CHECK(row[0] == 5);
  CHECK(row[1] == Approx(3 * kWeight).epsilon(1e-6));
  CHECK(row[2] == 1);
  CHECK(row[3] == Approx(kWeight).epsilon(1e-6));
  CHECK(row[4] == 0);
  CHECK(row[5] == 0);
  // as the places that are told of have it
  simulation.keep_forces();
  run(simulation, 1);
  seen.observe(simulation, row);
  double told = 0;
  for (const ContactPoint& point : simulation.contact_points()) {
    if (point.link != "block/block" && point.other_link != "block/block") continue;
    told += std::abs(point.force[0] * point.normal[0] + point.force[1] * point.normal[1] + point.force[2] * point.normal[2]);
  }
  CHECK(row[1] == Approx(told).epsilon(1e-12));
  simulation.set_positions(scene.initial.positions);
  seen.observe(simulation, row);
  CHECK(row == std::vector<double>(6, 0.0));
}

TEST_CASE("of the ground and of bodies that stand on it contacts are told together", "[observed_contact]") {
  const Solids solids;
  Scene scene = parse_scene("models:\n" + body("block", {0, 0, 0.0999}) + body("ball", {0, 0, 0.2998}) +
                                "effects: {gravity: [0, 0, -9.81], ground: {stiffness: 1e5, damping: 1e3, friction: 0.5}, contact: {}}\n",
                            solids.file("scene.yaml"));
  Simulation simulation(scene);
  Observations seen(scene.model, scene.effects, {"contact:block/block", "contact:ball/ball"});
  run(simulation, 2000);
  std::vector<double> row(4);
  seen.observe(simulation, row);
  CHECK(row[0] == 5);
  CHECK(row[1] == Approx(3 * kWeight).epsilon(1e-3));
  CHECK(row[2] == 1);
  CHECK(row[3] == Approx(kWeight).epsilon(1e-3));
}

TEST_CASE("a batch sees contacts of bodies as simulations do, in lanes that touch and in those that do not, blows too", "[observed_contact][batch]") {
  const Solids solids;
  Scene scene = solids.scene(kFloor, body("block", {0, 0, 0.12}) + body("ball", {0.02, 0, 0.35}, ", velocity: [0.3, 0, 0]"), 0.5, 1e-3);
  scene.effects.contact->materials[0].restitution = 0.4;
  const std::vector<std::string> names{"contact:block/block", "q", "contact:ball/ball"};
  constexpr std::int64_t kSize = 9;
  Batch batch(scene, kSize, {.threads = 2});
  Observations seen(scene.model, scene.effects, names);
  const auto width = static_cast<std::size_t>(seen.width());
  std::vector<double> rows(kSize * width), row(width);
  std::vector<Simulation> alone;
  for (std::int64_t i = 0; i < kSize; ++i) {
    std::vector<double> q = scene.initial.positions;
    for (const std::size_t z : {2u, 9u}) q[z] += 0.05 * static_cast<double>(i);
    batch.reset(i, q, scene.initial.velocities);
    alone.emplace_back(scene).set_positions(q);
    alone.back().set_velocities(scene.initial.velocities);
  }
  double most = 0, apart = 0;
  int pushed = 0, free = 0;
  for (int k = 0; k < 300; ++k) {
    batch.step(1);
    batch.observe(seen, rows);
    for (std::int64_t i = 0; i < kSize; ++i) {
      const auto at = static_cast<std::size_t>(i);
      REQUIRE(alone[at].step().ok());
      seen.observe(alone[at], row);
      const double* const there = &rows[at * width];
      for (const std::size_t link : {std::size_t{0}, width - 2}) {
        REQUIRE(there[link] == row[link]);
        // lanes round otherwise than one instance, and a blow is as large as the speed that it stops, over a step
        apart = std::max(apart, std::abs(there[link + 1] - row[link + 1]));
        most = std::max(most, row[link + 1]);
        ++(row[link] > 0 ? pushed : free);
      }
    }
  }
  CAPTURE(most, apart, pushed, free);
  CHECK(apart < 1e-5 * most);
  CHECK(most > 100);
  CHECK(pushed > 300);
  CHECK(free > 300);
  batch.reset(0, scene.initial.positions, scene.initial.velocities);
  batch.observe(seen, rows);
  CHECK(rows[1] == 0);
}

TEST_CASE("contacts of a scene with neither ground nor contact are refused", "[observed_contact]") {
  const Solids solids;
  Scene scene = solids.scene(kFloor, body("ball", {0, 0, 1}), 0.5, 1e-3);
  scene.effects.contact.reset();
  CHECK_THROWS_WITH(Observations(scene.model, scene.effects, {"contact:ball/ball"}), Catch::Contains("no ground") && Catch::Contains("contact among the effects"));
}

}  // namespace
}  // namespace linden::observed_contact_test
