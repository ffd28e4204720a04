// Couplings as scenes say them: every type, starts that are open, and what is wrong.
#include <catch2/catch.hpp>

#include <fmt/format.h>

#include "engine/mobility.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "engine/start_check.hpp"
#include "tests/engine/mechanisms.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::scene_couplings_test {
namespace {

constexpr const char* kPin = "{type: hinge, name: pin, between: [coupler, rocker], point: [2, 0, 2], axis: [0, 1, 0]}";

Scene with(const std::string& couplings, const std::string& more = "") {
  return parse_scene(fmt::format("model: {}\nduration: 1\ncouplings:\n  - {}\neffects: {{gravity: [0, 0, -9.81]}}\n{}\n", model_file("four_bar.urdf"), couplings, more),
                     "four_bar.yaml");
}

struct Case {
  const char* text;
  Index rows, freedom;  // of a four-bar that is cut open: three joints in a plane
};

/// Runs a case for half a second: rows, freedom, and energy plus what was taken.
Simulation run(const Case& c) {
  const Scene scene = with(c.text);
  const Mobility mobility = mobility_of(scene.model, scene.initial.positions);
  CHECK(mobility.rows == c.rows);
  CHECK(mobility.freedom == c.freedom);
  Simulation simulation(scene);
  const double before = simulation.energy().total();
  REQUIRE(simulation.run(500).ok());
  CHECK(simulation.energy().total() + simulation.effect_work().taken() == Approx(before).margin(1e-3));
  return simulation;
}

TEST_CASE("couplings of every type are read, leave what they say, and stay closed") {
  const auto c = GENERATE(Case{kPin, 5, 1}, Case{"{type: ball, between: [coupler, rocker], point: [2, 0, 2]}", 3, 1},
                          Case{"{type: universal, between: [coupler, rocker], point: [2, 0, 2], axis: [0, 1, 0], second_axis: [1, 0, 0]}", 4, 1},
                          Case{"{type: cylindrical, between: [coupler, rocker], point: [2, 0, 2], axis: [0, 1, 0]}", 4, 1},
                          Case{"{type: slider, between: [coupler, world], point: [2, 0, 2], axis: [0, 0, 1]}", 5, 1},
                          Case{"{type: weld, between: [coupler, rocker], point: [2, 0, 2]}", 6, 0},
                          Case{"{type: point_on_line, between: [world, coupler], point: [2, 0, 2], axis: [1, 0, 0]}", 2, 2},
                          Case{"{type: point_on_plane, between: [world, coupler], point: [2, 0, 2], axis: [0, 0, 1]}", 1, 2},
                          Case{"{type: rod, between: [coupler, rocker], points: [[2, 0, 1], [-0.5, 0, 1]]}", 1, 2},
                          Case{"{type: gear, joints: {crank: 2, rocker: -1}}", 1, 2});
  CAPTURE(c.text);
  CHECK(worst_gap(run(c).couplings()) < 1e-12);
}

TEST_CASE("couplings that give way are read, hold no coordinate, and keep the account") {
  const auto c = GENERATE(Case{"{type: spring, between: [coupler, rocker], points: [[2, 0, 1], [-0.5, 0, 1]], stiffness: 100, damping: 1}", 1, 3},
                          Case{"{type: spring, between: [world, rocker], points: [[2, 0, 1], [-1, 0, 2]], stiffness: 100, rest: 0}", 3, 3},
                          Case{"{type: hinge, between: [coupler, rocker], point: [2, 0, 2], axis: [0, 1, 0], turning_stiffness: 1e3}", 5, 1},
                          Case{"{type: weld, between: [coupler, rocker], point: [2, 0, 2], stiffness: 1e5, turning_stiffness: 10, turning_damping: 1}", 6, 3},
                          Case{"{type: weld, between: [coupler, rocker], point: [2, 0, 2], stiffness: [1e4, 0, 2e4], turning_stiffness: [10, 20, 30]}", 6, 3},
                          Case{"{type: bushing, between: [coupler, rocker], point: [2, 0, 2], stiffness: 1e4, turning_damping: [0, 2, 0]}", 4, 3},
                          Case{"{type: bushing, between: [coupler, rocker], frames: [{position: [2, 0, 1]}, {position: [-1, 0, 2], rotation: [0, 1, 0]}], turning_stiffness: [1, 9, 1]}", 3, 3},
                          Case{"{type: gear, joints: {crank: 2, rocker: -1}, turning_stiffness: 50, turning_damping: 2}", 1, 3});
  CAPTURE(c.text);
  run(c);
}

TEST_CASE("a start that is open is closed if it is told to be, or nearly closed already") {
  CHECK_THROWS_WITH(with(kPin, "initial: {positions: {crank: 0.4}}"),
                    Catch::Contains("coupling \"pin\" is open by") && Catch::Contains("assemble: true"));
  for (const char* start : {"initial: {positions: {crank: 0.4}}\nassemble: true", "initial: {positions: {crank: 0.0002}}"}) {
    Simulation simulation(with(kPin, start));
    CHECK(worst_gap(simulation.couplings()) < 1e-12);
  }
  CHECK_THROWS_WITH(with("{type: rod, between: [crank, world], points: [[0, 0, 1], [9, 0, 0]], length: 1}", "assemble: true"),
                    Catch::Contains("cannot be closed: 7 is the least that it is open by"));
  CHECK_THROWS_WITH(parse_scene(fmt::format("model: {}\nduration: 1\nassemble: true\n", model_file("four_bar.urdf")), "s.yaml"),
                    Catch::Contains("nothing to assemble"));
}

double at(const Simulation& simulation, const std::string& joint) {
  const Model& model = simulation.model();
  return simulation.positions()[static_cast<std::size_t>(model.tree.first_q(model.names.slot_of_joint.at(joint)))];
}

TEST_CASE("a cable comes to its length and no farther, or stretches from there, and begins where its links are") {
  const std::string cable = "{type: cable, name: rope, between: [world, crank, rocker], points: [[1, 0, 3], [0, 0, 1], [-1, 0, 2]]";
  const double apart = std::hypot(1.0, 2.0) + std::hypot(2.0, 1.0);  // (1, 0, 3) - (0, 0, 1) - (2, 0, 2)
  const Scene drawn_there = with(cable + "}");
  CHECK(at(Simulation(drawn_there), "rope") == Approx(apart).epsilon(1e-14));
  REQUIRE(drawn_there.effects.limits.size() == 1);
  CHECK(drawn_there.effects.limits[0].upper == Approx(apart).epsilon(1e-14));
  CHECK(drawn_there.effects.limits[0].row == drawn_there.model.tree.first_v(drawn_there.model.names.slot_of_joint.at("rope")));

  Simulation stops(with(cable + ", length: 5}"));
  double longest = 0;
  for (int k = 0; k < 2000; ++k) {
    REQUIRE(stops.step().ok());
    longest = std::max(longest, at(stops, "rope"));
    REQUIRE(worst_gap(stops.couplings()) < 1e-9);
  }
  CHECK(longest == Approx(5).epsilon(1e-11));

  const Scene elastic = with(cable + ", length: 5, stiffness: 1e4}");
  REQUIRE(elastic.effects.dead_zone_springs.size() == 1);
  CHECK(elastic.effects.limits.empty());
  Simulation stretches(elastic);
  const double before = stretches.energy().total();
  longest = 0;
  for (int k = 0; k < 2000; ++k) {
    REQUIRE(stretches.step().ok());
    longest = std::max(longest, at(stretches, "rope"));
  }
  CHECK(longest > 5.001);
  CHECK(longest < 5.2);
  CHECK(stretches.energy().total() == Approx(before).margin(1e4 * std::pow(1e-3 * 10, 2) / 8));  // what a step makes of an edge met at 10 m/s

  CHECK(elastic.effects.dead_zone_springs[0].damping == 0);
  CHECK(with(cable + ", length: 5, stiffness: 1e4, damping: 30}").effects.dead_zone_springs[0].damping == 30);
  CHECK_THROWS_WITH(with(cable + ", length: 5, damping: 30}"), Catch::Contains("has a damping and no stiffness") && Catch::Contains("effects.damping"));

  const Scene moved = with(cable + ", length: 5}", "initial: {positions: {crank: 0.2}}");
  CHECK(at(Simulation(moved), "rope") == Approx(std::hypot(1 - std::sin(0.2), 3 - std::cos(0.2)) + std::hypot(2 - std::sin(0.2), 2 - std::cos(0.2))).epsilon(1e-14));
  CHECK(at(Simulation(moved), "crank") == 0.2);
  const Scene written = with(cable + ", length: 5.2}", "initial: {positions: {crank: -0.01}}");
  CHECK(written.model.warnings.empty());
  const double there = at(Simulation(written), "rope");
  const Scene rounded = with(fmt::format("{}, length: {:.4f}}}", cable, there - 1e-4), "initial: {positions: {crank: -0.01}}");
  REQUIRE(rounded.model.warnings.size() == 1);
  CHECK_THAT(rounded.model.warnings[0], Catch::Contains("cable \"rope\" starts") && Catch::Contains("longer than its length"));
  CHECK(rounded.effects.limits[0].upper == Approx(there).epsilon(1e-14));
  CHECK_THROWS_WITH(checked_start(with(cable + ", length: 4}")), Catch::Contains("cable \"rope\" is 4.47") && Catch::Contains("outside its limits (at most 4 m)") &&
                                                                       Catch::Contains("give another length to \"rope\""));
  CHECK_THROWS_WITH(parse_scene(fmt::format("model: {}\nduration: 1\ncouplings:\n  - {}, length: 5}}\neffects: {{limits: {{rope: {{upper: 4}}}}}}\n", model_file("four_bar.urdf"), cable), "s.yaml"),
                    Catch::Contains("s.yaml:5") && Catch::Contains("effects.limits names \"rope\", a cable that has a length"));
  const Scene free = with("{type: cable, name: rope, joint: tendon, between: [world, crank], points: [[1, 0, 3], [0, 0, 1]]}");
  CHECK(free.effects.limits.empty());
  CHECK(free.model.names.slot_of_joint.contains("tendon"));
}

TEST_CASE("a floating model beside others is where the scene puts it, whatever couplings add before it") {
  const Scene scene = parse_scene(fmt::format("models:\n  - {{model: {}, name: crane}}\n  - {{model: {}, name: load, base: floating, position: [0.5, 0, 2]}}\n"
                                              "duration: 1\ncouplings:\n  - {{type: cable, name: rope, between: [crane/trolley, load/sheave], points: [[0, 0, 0], [0, 0, 0]]}}\n",
                                              model_file("crane.urdf"), model_file("crate.urdf")),
                                  "two.yaml");
  const Simulation simulation(scene);
  const Index q = scene.model.tree.first_q(scene.model.names.slot_of_joint.at("load/base"));
  CHECK(simulation.positions()[static_cast<std::size_t>(q)] == 0.5);
  CHECK(simulation.positions()[static_cast<std::size_t>(q) + 2] == 2);
  CHECK(at(simulation, "rope") == Approx(std::hypot(0.5, 3.5)).epsilon(1e-14));
}

TEST_CASE("what a coupling cannot be is told with its line") {
  const auto message = [](const std::string& text) -> std::string {
    try {
      with(text);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  CHECK_THAT(message("{type: hinge, between: [coupler, rocket], point: [0, 0, 0], axis: [0, 1, 0]}"),
             Catch::Contains("four_bar.yaml:4") && Catch::Contains("did you mean \"rocker\""));
  CHECK_THAT(message("{type: hing, between: [coupler, rocker]}"), Catch::Contains("hinge"));
  CHECK_THAT(message("{type: hinge, between: [coupler, rocker], axis: [0, 1, 0]}"), Catch::Contains("says not where"));
  CHECK_THAT(message("{type: hinge, between: [coupler, rocker], point: [2, 0, 2]}"), Catch::Contains("has no axis"));
  CHECK_THAT(message("{type: hinge, between: [coupler, rocker], point: [2, 0, 2], axis: [0, 0, 0]}"), Catch::Contains("no length"));
  CHECK_THAT(message("{type: ball, between: [coupler, coupler], point: [2, 0, 2]}"), Catch::Contains("both of its links"));
  CHECK_THAT(message("{type: gear, joints: {crank: 0, rocker: 1}}"), Catch::Contains("other than zero"));
  CHECK_THAT(message("{type: spring, between: [coupler, rocker], points: [[0, 0, 0], [0, 0, 1]]}"), Catch::Contains("neither pulls nor damps"));
  CHECK_THAT(message("{type: spring, between: [coupler, rocker], points: [[0, 0, 0], [0, 0, 1]], stiffness: -2}"), Catch::Contains("stiffness"));
  CHECK_THAT(message("{type: ball, between: [coupler, rocker], point: [2, 0, 2], turning_stiffness: 3}"), Catch::Contains("nothing that turns"));
  CHECK_THAT(message("{type: rod, between: [coupler, rocker], points: [[0, 0, 0], [0, 0, 1]], stiffness: 3}"), Catch::Contains("stiffness"));
  CHECK_THAT(message("{type: spring, between: [coupler, rocker], points: [[0, 0, 0], [0, 0, 1]], stiffness: [1, 2, 3]}"), Catch::Contains("stiffness"));
  CHECK_THAT(message("{type: bushing, between: [coupler, rocker], point: [2, 0, 2]}"), Catch::Contains("neither pulls nor damps"));
  CHECK_THAT(message("{type: bushing, between: [coupler, rocker], point: [2, 0, 2], stiffness: [1, -2, 3]}"), Catch::Contains("each a stiffness, zero or more"));
  CHECK_THAT(message("{type: bushing, between: [coupler, rocker], point: [2, 0, 2], axis: [0, 1, 0], damping: 1}"), Catch::Contains("axis"));
  CHECK_THAT(message("{type: cable, between: [coupler, rocker], points: [[0, 0, 0], [0, 0, 1]]}"), Catch::Contains("has no name"));
  CHECK_THAT(message("{type: cable, name: c, between: [coupler], points: [[0, 0, 0]]}"), Catch::Contains("write two links or more"));
  CHECK_THAT(message("{type: cable, name: c, between: [coupler, rocker], points: [[0, 0, 0]]}"), Catch::Contains("1 points and 2 links"));
  CHECK_THAT(message("{type: cable, name: c, between: [coupler, rocker], points: [[0, 0, 0], [0, 0, 1]], damping: 3}"), Catch::Contains("damping"));
  CHECK_THAT(message("{type: cable, name: crank, between: [coupler, rocker], points: [[0, 0, 0], [0, 0, 1]]}"), Catch::Contains("there is a joint \"crank\" already"));
}

}  // namespace
}  // namespace linden::scene_couplings_test
