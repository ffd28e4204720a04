#include "engine/program/pull.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "engine/queries/link_motion.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/scene/scene_file.hpp"
#include "models/urdf/urdf.hpp"

namespace linden::pull_test {
namespace {

const std::string kModels = LINDEN_MODELS_DIR;

std::array<double, 3> place_of_body(Simulation& simulation, const std::string& link) {
  return link_pose(Kinematics(simulation), place_of(simulation.model(), link)).shift;
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

void pulled(Simulation& simulation, Pulls& pulls, int steps) {
  for (int k = 0; k < steps; ++k) {
    pulls.apply();
    const StepReport report = simulation.step();
    INFO(simulation.describe(report));
    REQUIRE(report.ok());
  }
}

/// Of a pull to a place that stays, with what its spring may hold: k d^2 / 2.
double energy_with(Simulation& simulation, const Pull& pull, double mass) {
  const double d = distance(pull.to, place_of_body(simulation, simulation.model().names.body[static_cast<std::size_t>(pull.slot)]));
  return simulation.energy().total() + 0.5 * mass * 81 * d * d;
}

TEST_CASE("what is pulled is lifted, and hangs as far below its place as its weight says") {
  Simulation simulation(load_urdf(kModels + "/humanoid.urdf", Base::floating), {.step = 1e-3});
  Pulls pulls(simulation);
  const Index pelvis = place_of(simulation.model(), "pelvis").slot;
  const Pull pull{pelvis, {}, {0.2, -0.1, 0.6}};
  pulls.set(1, pull);
  pulled(simulation, pulls, 5000);
  // limbs swing on without an end, and the pelvis with them
  const std::array<double, 3> there = place_of_body(simulation, "pelvis");
  CHECK(std::abs(there[2] - (pull.to[2] - 9.81 / 81)) < 0.1);
  CHECK(std::hypot(there[0] - pull.to[0], there[1] - pull.to[1]) < 0.2);
  REQUIRE(pulls.drawn().size() == 1);
  CHECK(distance(pulls.drawn()[0].from, there) < 1e-12);
  pulls.release(1);
  pulled(simulation, pulls, 1000);
  CHECK(simulation.forces().empty());
  CHECK(place_of_body(simulation, "pelvis")[2] < pull.to[2] - 2);
}

TEST_CASE("without gravity a chain's end comes to where it is pulled, and all come to rest there") {
  Simulation simulation(load_model("chain:10", {}), {.step = 1e-3, .gravity = {0, 0, 0}});
  Pulls pulls(simulation);
  const Index end = simulation.model().tree.shape.slots - 1;
  std::array<double, 3> to = place_of_body(simulation, simulation.model().names.body[static_cast<std::size_t>(end)]);
  to[2] += 0.3;
  to[0] *= 0.8;
  const double begin = distance(to, place_of_body(simulation, simulation.model().names.body[static_cast<std::size_t>(end)]));
  pulls.set(1, {end, {}, to});
  pulled(simulation, pulls, 5000);
  CHECK(distance(to, place_of_body(simulation, simulation.model().names.body[static_cast<std::size_t>(end)])) < 0.1 * begin);
}

TEST_CASE("a pull gives no more energy than its spring holds, at a light body as at a heavy one, in small steps as in large ones") {
  struct Case {
    Model model;
    std::string body;
  };
  std::vector<Case> cases;
  cases.push_back({load_urdf(kModels + "/humanoid.urdf", Base::floating), "pelvis"});
  cases.push_back({load_urdf(kModels + "/humanoid.urdf", Base::floating), "left_hand"});
  cases.push_back({load_model("chain:10", {}), ""});
  cases.push_back({load_model("chain:50", {}), ""});
  cases.push_back({load_urdf(kModels + "/hand.urdf", Base::fixed), ""});
  for (const Case& one : cases) {
    for (const double step : {1e-3, 4e-3}) {
      Simulation simulation(one.model, {.step = step, .gravity = {0, 0, 0}});
      const Index slot = one.body.empty() ? simulation.model().tree.shape.slots - 1 : place_of(simulation.model(), one.body).slot;
      std::array<double, 3> to = place_of_body(simulation, simulation.model().names.body[static_cast<std::size_t>(slot)]);
      to[0] -= 0.2;
      to[2] += 0.15;
      const double mass = simulation.model().constants.subtree_mass(0);
      const Pull pull{slot, {}, to};
      Pulls pulls(simulation);
      pulls.set(1, pull);
      const double begin = energy_with(simulation, pull, mass);
      INFO(simulation.model().names.model << " " << one.body << " step " << step);
      double most = 0;
      for (int k = 0; k < 10; ++k) {
        pulled(simulation, pulls, static_cast<int>(0.05 / step));
        most = std::max(most, energy_with(simulation, pull, mass));
      }
      CHECK(most <= 1.01 * begin);
    }
  }
}

TEST_CASE("a pull from far away is no stronger than ten weights") {
  for (const std::string scene : {"humanoid_drop", "arm_servo"}) {
    Simulation simulation(load_scene(kModels + "/scenes/" + scene + ".yaml"));
    const Index slot = simulation.model().tree.shape.slots - 1;
    const Energy begin = simulation.energy();
    const std::string body = simulation.model().names.body[static_cast<std::size_t>(slot)];
    const double mass = simulation.model().constants.subtree_mass(0);
    Pulls pulls(simulation);
    double way = 0;
    std::array<double, 3> before = place_of_body(simulation, body);
    // to and fro, as somebody would who tries to break it
    for (int k = 0; k < 20; ++k) {
      pulls.set(1, {slot, {0.01, 0, 0}, {k % 2 == 0 ? 1e5 : -1e5, k % 3 - 1.0, 1e3}});
      for (int s = 0; s < 25; ++s) {
        pulled(simulation, pulls, 1);
        const std::array<double, 3> now = place_of_body(simulation, body);
        way += distance(now, before);
        before = now;
      }
    }
    INFO(scene << ": " << way << " m");
    CHECK(std::isfinite(way));
    CHECK(simulation.energy().total() - begin.total() <= 1.1 * (10 * mass * 9.81 * way + simulation.effect_work().given()));
    pulls.release_all();
    pulled(simulation, pulls, 500);
  }
}

}  // namespace
}  // namespace linden::pull_test
