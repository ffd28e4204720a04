// Height fields that stand in the world: what rests, slides, rolls and tumbles on them, alone and in a batch; level and tilted ones as planes have it.
#include <catch2/catch.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fmt/format.h>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/queries/kinematics.hpp"
#include "engine/queries/proximity.hpp"
#include "engine/scene/scene_bytes.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "engine/start_check.hpp"
#include "engine/view/drawing.hpp"
#include "kernels/effects/terrain_height.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/engine/solids.hpp"

namespace linden::world_heights_test {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Eigen::Vector3d;

using namespace solids_test;

#ifdef LINDEN_SANITIZED  // which takes ten times as long
constexpr int kDrops = 1;
constexpr std::array kSteps{5e-3};
#else
constexpr int kDrops = 4;
constexpr std::array kSteps{5e-4, 1e-3, 5e-3};
#endif

/// With heights.
class SolidsInHills : public Solids {
 public:
  /// Heights about the origin, as a shape of the world.
  std::string field(int columns, int rows, double spacing, const std::function<double(double, double)>& height, const std::string& more = "") const {
    std::string table;
    const double x = -0.5 * spacing * (columns - 1), y = -0.5 * spacing * (rows - 1);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) table += fmt::format("{}{:.17g}", i > 0 ? "," : "", height(x + spacing * i, y + spacing * j));
      table += "\n";
    }
    write("field.csv", table);
    return fmt::format("  - {{type: heights, name: hills, file: field.csv, spacing: [{0:.17g}, {0:.17g}], origin: [{1:.17g}, {2:.17g}]{3}}}\n", spacing, x, y, more);
  }
};

const HeightField& field_of(const Simulation& simulation) { return *simulation.model().welded.shapes.at(0).shape.heights; }

/// A ball that rolls along x at a place of a field, its middle 0.1 m over it.
std::string rolling(double x, double height, double v) {
  return body("ball", {x, 0.013, height + 0.1}, fmt::format(", velocity: [{0:.17g}, 0, 0], angular_velocity: [0, {1:.17g}, 0]", v, v / 0.1));
}

TEST_CASE("on level heights a block slides and a ball rolls as on a plane", "[world_heights]") {
  const SolidsInHills solids;
  const std::string level = solids.field(31, 21, 0.15, [](double, double) { return 0.3; }), plane = "  - {type: plane, name: floor, height: 0.3}\n";
  for (const double step : kSteps) {
    for (const char* const name : {"block", "ball"}) {
      CAPTURE(step, name);
      const std::string models = body(name, {-1, -0.3, 0.4}, ", rotation: [0, 0, 0.4], velocity: [2, 0.7, 0], angular_velocity: [0, 0, 3]");
      Simulation on_heights(solids.scene(level, models, 0.3, step)), on_plane(solids.scene(plane, models, 0.3, step));
      double apart = 0;
      for (int k = 0; k < steps_of(1.5, step); ++k) {
        if (!on_heights.step().ok() || !on_plane.step().ok()) FAIL("no step");
        apart = std::max(apart, distance(on_heights.positions(), on_plane.positions()));
      }
      CHECK((place(on_heights) - Vector3d(-1, -0.3, 0.4)).norm() > 0.5);
      CHECK(apart < 1e-7);
    }
  }
}

TEST_CASE("a ball rolls down tilted heights with five sevenths of the pull, whether they are tilted or turned", "[world_heights]") {
  const SolidsInHills solids;
  const double angle = 0.2;
  const Vector3d up(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
  for (const bool turned : {false, true}) {
    const std::string world = turned ? solids.field(41, 5, 0.25, [](double, double) { return 0.0; }, fmt::format(", rotation: [0, {:.17g}, 0]", angle))
                                     : solids.field(41, 5, 0.25, [&](double x, double) { return -std::tan(angle) * x; });
    for (const double step : kSteps) {
      CAPTURE(turned, step);
      Simulation simulation(solids.scene(world, body("ball", 0.1 * up + Vector3d(0, 0.03, 0)), 0.5, step));
      run(simulation, steps_of(2, step));
      const Vector3d way = place(simulation) - 0.1 * up - Vector3d(0, 0.03, 0);
      CHECK(way.dot(down) == Approx(5.0 / 14 * kGravity * std::sin(angle) * 4).epsilon(1.5 * step));
      CHECK(std::abs(way.dot(up)) < 1e-6);
      CHECK(std::abs(way.y()) < 1e-8);
    }
  }
}

TEST_CASE("a ball rolls over a crease that turns down without a jump of energy", "[world_heights]") {
  const SolidsInHills solids;
  const std::string world = solids.field(41, 9, 0.2, [&](double x, double) { return -0.1 * std::max(0.0, x); });
  for (const double step : kSteps) {
    CAPTURE(step);
    Simulation simulation(solids.scene(world, rolling(-0.4, 0, 0.8), 0.8, step));
    const double start = simulation.energy().total();
    double last = start, rises = 0;
    for (int k = 0; k < steps_of(1, step); ++k) {
      const StepReport report = simulation.step();
      if (!report.ok()) FAIL(simulation.describe(report));
      rises += std::max(0.0, simulation.energy().total() - last);
      last = simulation.energy().total();
    }
    CHECK(place(simulation).x() > 0.4);
    // of some 0.45 J: the square of the step is what energy is told to, and a blow would be of no order at all
    CHECK(rises < 25 * step * step);
    CHECK(std::abs(last - start) < 5 * step * step);
  }
}

TEST_CASE("at a crease that turns up a ball loses what the blow takes, as where two planes meet", "[world_heights]") {
  const SolidsInHills solids;
  const std::string world = solids.field(41, 9, 0.2, [&](double x, double) { return 0.1 * std::max(0.0, x); });
  const std::string planes = "  - {type: plane, name: floor}\n  - {type: plane, name: ramp, normal: [-0.1, 0, 1]}\n";
  for (const double step : kSteps) {
    CAPTURE(step);
    const double v = 0.8, rolls = 0.7 * v * v;  // [J]: half of 7/5 of 1 kg
    Simulation simulation(solids.scene(world, rolling(-0.4, 0, v), 0.8, step)), on_planes(solids.scene(planes, rolling(-0.4, 0, v), 0.8, step));
    const double start = simulation.energy().total();
    double apart = 0;
    for (int k = 0; k < steps_of(1, step); ++k) {
      if (!simulation.step().ok() || !on_planes.step().ok()) FAIL("no step");
      apart = std::max(apart, distance(simulation.positions(), on_planes.positions()));
    }
    CHECK(place(simulation).x() > 0.3);
    CHECK(apart < 1e-7);
    // it turns on about the place that it strikes, with the spin about it that it has
    const double kept = std::pow((0.4 + std::cos(std::atan(0.1))) / 1.4, 2);
    CHECK(start - simulation.energy().total() == Approx((1 - kept) * rolls).margin(1.2 * step));
  }
}

TEST_CASE("what tumbles over hills falls through nowhere, and gains as little energy as on a slab", "[world_heights]") {
  const SolidsInHills solids;
  const auto hill = [](double x, double y) { return 0.15 * std::sin(2.1 * x + 0.3) * std::cos(1.7 * y) + 0.05 * std::sin(7 * x - 5 * y); };
  const std::string hills = solids.field(81, 81, 0.1, hill), slab = "  - {type: box, name: floor, size: [40, 40, 2], position: [0, 0, -1]}\n";
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
        models += body(name, {x, 0, 0.6}, fmt::format(", rotation: [{}, {}, {}], velocity: [0, {}, 0], angular_velocity: [{}, 0, 1]", roll, pitch, yaw, v, w));
        x += 1;
      }
      std::array<double, 2> rises{};
      for (const bool on_hills : {true, false}) {
        Simulation simulation(solids.scene(on_hills ? hills : slab, models, 0.5, step));
        const double start = simulation.energy().total();
        double last = start, deepest = 0, strays = 0;
        for (int k = 0; k < steps_of(3, step); ++k) {
          const StepReport report = simulation.step();
          if (!report.ok()) FAIL(simulation.describe(report));
          const double now = simulation.energy().total();
          rises[on_hills ? 0 : 1] += std::max(0.0, now - last);
          last = now;
          strays = std::max(strays, std::abs(now + simulation.effect_work().taken() - start));
          for (std::size_t b = 0; b < 3 && on_hills; ++b) {
            const Vector3d at = place(simulation, b);
            deepest = std::max(deepest, 0.1 - (at.z() - height_below(field_of(simulation), at.x(), at.y())));
          }
        }
        CHECK(strays < 5e-3 * start);
        CHECK(deepest < 1e-4);
      }
      CHECK(rises[0] < rises[1] + (step > 2e-3 ? 5e-3 : 5e-4));  // [J], of some 18 that they begin with
    }
  }
}

TEST_CASE("beyond the edge of a map its heights go on", "[world_heights]") {
  const SolidsInHills solids;
  // a gutter along x, whose map ends at x = 1 and y = 0.4
  const std::string world = solids.field(11, 5, 0.2, [](double, double y) { return 0.25 * std::abs(y); });
  Simulation simulation(solids.scene(world, body("ball", {0, 0, 0.1 * std::sqrt(1 + 0.0625)}, ", velocity: [3, 0, 0]"), 0.5, 1e-3));
  run(simulation, 2000);
  CHECK(place(simulation).x() > 4);
  CHECK(std::abs(place(simulation).y()) < 1e-6);
  CHECK(place(simulation).z() == Approx(0.1 * std::sqrt(1 + 0.0625)).margin(1e-6));
  // and across it: level as its last row
  Simulation across(solids.scene(world, body("block", {0.3, 2, 0.2}, ", velocity: [0, 1, 0]"), 0.5, 1e-3));
  run(across, 1000);
  CHECK(place(across).z() == Approx(0.2).margin(1e-5));
  CHECK(place(across).y() == Approx(2 + 0.5 / (0.5 * kGravity)).epsilon(2e-2));
}

TEST_CASE("in a batch those near heights go alone and the others together, each as it does in any company", "[world_heights][batch]") {
  const SolidsInHills solids;
  const std::string world = solids.field(21, 21, 0.2, [](double x, double y) { return 0.1 * std::sin(5 * x) * std::cos(4 * y) - 0.3 * x; });
  const Scene scene = solids.scene(world, body("can", {0, 0, 0.25}, ", angular_velocity: [1, 2, 0]"), 0.5, 1e-3);
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

TEST_CASE("whoever begins in heights is told so", "[world_heights]") {
  const SolidsInHills solids;
  const Scene scene = solids.scene(solids.field(5, 5, 0.3, [](double, double) { return 0.0; }), body("block", {0, 0, 0.05}), 0.5, 1e-3);
  const StartFindings found = StartCheck(scene.model, scene.options, scene.effects).look(scene.initial.positions);
  CHECK(found.sound());
  REQUIRE(found.told.size() == 1);
  CHECK_THAT(found.told[0], Contains("\"world/hills\"") && Contains("start 0.05 m deep in each other"));
}

TEST_CASE("what is near heights is told for each normal of theirs, and their distance is refused", "[world_heights]") {
  const SolidsInHills solids;
  const std::string groove = solids.field(5, 5, 0.5, [](double x, double) { return 0.5 * std::abs(x); });
  const double over = 0.1 * std::sqrt(1.25);  // a ball that touches both sides
  Simulation simulation(solids.scene(groove, body("ball", {0, 0, over + 1e-3}), 0.5, 1e-3));
  const Proximity shapes(simulation.model());
  const Kinematics now(simulation);
  const std::vector<NearPair> pairs = shapes.near(now, 1e-2);
  REQUIRE(pairs.size() == 2);
  for (const NearPair& pair : pairs) {
    CHECK(pair.link_a == "world/hills");
    CHECK(pair.link_b == "ball/ball");
    CHECK(pair.distance == Approx(1e-3 / std::sqrt(1.25)).margin(1e-12));
    CHECK(std::abs(pair.normal[0]) == Approx(0.5 / std::sqrt(1.25)));
    REQUIRE(pair.points.size() == 1);
    CHECK(pair.points[0].gap == pair.distance);
  }
  CHECK(pairs[0].normal[0] * pairs[1].normal[0] < 0);
  CHECK(shapes.near(now, 1e-4).empty());
  CHECK_THROWS_WITH(shapes.distance(now, "ball/ball", "world/hills"), Contains("\"world/hills\" are heights; expected links of other shapes"));
}

TEST_CASE("a scene with heights goes into bytes and comes back with them, and is drawn where they are", "[world_heights]") {
  const SolidsInHills solids;
  const std::string world = solids.field(4, 3, 0.5, [](double x, double y) { return x + 10 * y; }, ", position: [1, 2, 3]");
  const Scene scene = solids.scene(world, body("ball", {0, 0, 30}), 0.5, 1e-3), again = scene_from_bytes(to_bytes(scene));
  REQUIRE(again.effects.contact->shapes[0].shape.heights);
  const HeightField& field = *again.effects.contact->shapes[0].shape.heights;
  CHECK(field.columns == 4);
  CHECK(field.rows == 3);
  CHECK(field.spacing_y == 0.5);
  CHECK(field.origin_x == -0.75);
  CHECK(field.heights == scene.model.welded.shapes.at(0).shape.heights->heights);
  CHECK(field.heights[4] == -0.75);
  int drawn = 0;
  for (const DrawnPart& part : drawing_of(scene.model, scene.effects).parts) {
    if (part.link != "world/hills") continue;
    drawn += 1;
    CHECK(part.layer == Layer::ground);
    CHECK(part.pose.shift == std::array<double, 3>{1, 2, 3});
  }
  CHECK(drawn == 1);
}

TEST_CASE("what is wrong with heights of the world is said in one line", "[world_heights]") {
  const SolidsInHills solids;
  solids.write("good.csv", "0,1,2\n3,4,5\n");
  solids.write("ragged.csv", "0,1,2\n3,4\n");
  solids.write("row.csv", "0,1,2\n");
  solids.write("words.csv", "0,1\n2,high\n");
  const auto check = [&](const std::string& keys, const std::vector<std::string>& parts) {
    CAPTURE(keys);
    std::string found;
    try {
      solids.scene("  - {type: heights" + keys + "}\n", body("ball", {0, 0, 10}), 0.5, 1e-3);
    } catch (const InputError& error) {
      found = error.what();
    }
    CHECK_THAT(found, StartsWith(solids.file("scene.yaml") + ":4: "));
    CHECK(found.find('\n') == found.npos);
    for (const std::string& part : parts) CHECK_THAT(found, Contains(part));
  };
  check("", {"world[0] has no file", "file and spacing"});
  check(", file: good.csv", {"world[0] has no spacing", "file and spacing"});
  check(", file: none.csv, spacing: [1, 1]", {"none.csv"});
  check(", file: ragged.csv, spacing: [1, 1]", {"ragged.csv:2"});
  check(", file: row.csv, spacing: [1, 1]", {"row.csv has one row", "two or more"});
  check(", file: words.csv, spacing: [1, 1]", {"words.csv:2"});
  check(", file: good.csv, spacing: [0, 1]", {"world[0].spacing holds 0 and 1", "two numbers above zero"});
  check(", file: good.csv, spacing: [1, -2]", {"world[0].spacing holds 1 and -2"});
  check(", file: good.csv, spacing: 1", {"world[0].spacing", "[dx, dy]"});
  check(", file: good.csv, spacing: [1, 1], origin: [1]", {"world[0].origin", "[x, y]"});
  check(", file: good.csv, spacing: [1, 1], size: [1, 1]", {"the key \"size\" of world[0] is not known"});
}

}  // namespace
}  // namespace linden::world_heights_test
