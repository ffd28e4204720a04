// Generated solids: stacks, walls, heaps, houses of cards and dominoes, which lie on a floor of the world and stay where they come to rest.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "engine/start_check.hpp"
#include "models/build/generators.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::generated_solids_test {
namespace {

struct Solids {
  const char* name;
  Index bodies;
  double mass;  // [kg]
};
constexpr Solids kSolids[] = {{"boxes:1", 1, 1},          {"boxes:7", 7, 7},           {"wall:1", 1, 2},        {"wall:2", 2, 3},
                              {"wall:12", 12, 20},        {"pile:5", 5, 5},            {"pile:40", 40, 40},     {"cards:1", 2, 0.01},
                              {"cards:3", 15, 15 * 5e-3}, {"dominoes:1", 1, 20e-3}, {"dominoes:8", 8, 8 * 20e-3}};

std::vector<std::array<double, 3>> places(Simulation& simulation) {
  const Kinematics now(simulation);
  std::vector<std::array<double, 3>> middles;
  for (Index slot = 1; slot < simulation.model().tree.shape.slots; ++slot) {
    middles.push_back(link_pose(now, place_of(simulation.model(), simulation.model().names.body[static_cast<std::size_t>(slot)])).shift);
  }
  return middles;
}

double farthest(const std::vector<std::array<double, 3>>& a, const std::vector<std::array<double, 3>>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::hypot(a[k][0] - b[k][0], a[k][1] - b[k][1], a[k][2] - b[k][2]));
  return most;
}

Simulation ran(const std::string& name, double seconds) {
  Simulation simulation(load_scene(name));
  const StepsReport report = simulation.run(static_cast<int>(std::lround(seconds / simulation.options().step)));
  REQUIRE(report.ok());
  return simulation;
}

TEST_CASE("generated solids have the bodies and the mass that is said, stand on a floor, and begin without standing in each other") {
  for (const Solids& solids : kSolids) {
    CAPTURE(solids.name);
    REQUIRE(needs_contact(solids.name));
    const Scene scene = load_scene(solids.name);
    CHECK(scene.model.names.model == solids.name);
    CHECK(scene.model.tree.bodies() == solids.bodies);
    CHECK(generated_size(solids.name).bodies == solids.bodies);
    CHECK(scene.model.constants.subtree_mass(0) == Approx(solids.mass));
    CHECK(place_of(scene.model, "world/floor").slot == 0);
    CHECK(scene.model.warnings.empty());
    REQUIRE(scene.effects.contact);
    CHECK(scene.options.gravity == std::array<double, 3>{0, 0, -9.81});
    const StartFindings found = StartCheck(scene.model, scene.options, scene.effects).look(scene.initial.positions);
    CHECK(found.sound());
    CHECK(found.told.empty());
  }
  CHECK(!needs_contact("chain:3"));
  CHECK(!needs_contact("boxes.urdf"));
  CHECK_THROWS_WITH(load_scene("boxes:0"), StartsWith("model \"boxes:0\": \"0\" is no number of bodies"));
  CHECK_THROWS_WITH(load_scene("wall:1000000"), StartsWith("wall:1000000 needs about "));
}

TEST_CASE("a stack, a wall and a house of cards stand where they were put") {
  for (const char* name : {"boxes:4", "wall:7", "cards:2"}) {
    CAPTURE(name);
    Simulation simulation = ran(name, 0.25), start(load_scene(name));
    CHECK(farthest(places(simulation), places(start)) < 2e-5);
    CHECK(simulation.energy().kinetic < 1e-9);
  }
}

TEST_CASE("the first domino fells all others, and none passes through another") {
  Simulation simulation = ran("dominoes:4", 1.5);
  const std::vector<std::array<double, 3>> now = places(simulation);
  for (std::size_t k = 0; k < now.size(); ++k) {
    CHECK(now[k][2] < 0.025);  // 0.03 upright
    if (k > 0) CHECK(now[k][0] > now[k - 1][0] + 0.01);
  }
}

TEST_CASE("a pile drops and comes to lie on the floor") {
  Simulation simulation = ran("pile:3", 2);
  for (const std::array<double, 3>& middle : places(simulation)) {
    CHECK(middle[2] > 0.05 - 1e-4);
    CHECK(middle[2] < 0.2);
  }
  CHECK(simulation.energy().kinetic < 1e-3);
}

TEST_CASE("every step of a rigid pile is solved: what is rigid does not push by what is rounded of where boxes are") {
  Simulation simulation = ran("pile:20", 0.42);  // until most have landed
  for (const std::array<double, 3>& middle : places(simulation)) CHECK(middle[2] > 0.05 - 1e-4);
}

TEST_CASE("linden run takes generated solids with gravity and contact, and a scene names what acts itself") {
  const Shell shell;
  const Outcome outcome = shell.linden("run boxes:2 --duration 0.05");
  CHECK(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("contact: 3 shapes") && Contains("gravity 0 0 -9.81"));
  CHECK_THAT(shell.linden("run boxes:2 --base floating").err, Contains("--base is for URDF files"));
  CHECK_THAT(shell.linden("run boxes:2 --density 3").err, Contains("--density is for URDF files"));
  shell.write("s.yaml", "model: boxes:2\nduration: 0.05\neffects: {gravity: [0, 0, -1]}\n");
  CHECK_THAT(shell.linden("run s.yaml").out, !Contains("contact:"));
}

}  // namespace
}  // namespace linden::generated_solids_test
