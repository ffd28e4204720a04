// A batch that starts from a scene is many simulations of that scene, each as its own seed draws it.
#include <catch2/catch.hpp>
#include <cmath>

#include "engine/batch.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::scene_batch_test {
namespace {

/// A hand-sized chain that hangs bent, turns, is held by a servo and rubs in one joint.
Scene bent_chain(const std::string& more = "") {
  return parse_scene(
      "model: chain:4\n"
      "step: 1e-3\n"
      "tolerance: 1e-13\n"
      "initial: {positions: {joint1: 0.3, joint3: -0.2}, velocities: {joint2: 1.5}, seed: 7, spread: 0}\n"
      "effects:\n"
      "  gravity: [0, 0, -9.81]\n"
      "  servo: {joints: {joint2: {stiffness: 2, damping: 0.02, target: 0.4}}}\n"
      "  friction: {joint4: 0.001}\n" +
          more,
      "chain.yaml");
}

double difference(const Batch& batch, std::int64_t i, const Simulation& simulation) {
  double worst = 0;
  for (Index row = 0; row < batch.positions().rows(); ++row) {
    worst = std::max(worst, std::abs(batch.positions()(i, row) - simulation.positions()[static_cast<std::size_t>(row)]));
  }
  return worst;
}

}  // namespace

TEST_CASE("every instance of a batch of a scene starts and moves as a simulation of that scene", "[scene][batch]") {
  const Scene scene = bent_chain();
  Batch batch(scene, 5);
  Simulation simulation(scene);
  for (std::int64_t i = 0; i < 5; ++i) CHECK(difference(batch, i, simulation) == 0);
  CHECK(batch.options().tolerance == 1e-13);
  batch.step(500);
  run(simulation, 500);
  for (std::int64_t i = 0; i < 5; ++i) CHECK(difference(batch, i, simulation) < 1e-9);
  // it has moved far more than that
  CHECK(std::abs(simulation.positions()[0] - 0.3) > 0.01);
}

TEST_CASE("instances of a randomised scene are drawn by its seed and those that follow it", "[scene][batch]") {
  const Scene scene = bent_chain("randomize: {masses: 0.3, joint_friction: [0.5, 2], gains: 0.4}\n");
  REQUIRE(scene.seed == 7);
  Batch batch(scene, 6);
  batch.step(400);
  std::vector<double> ends;
  for (std::int64_t i = 0; i < 6; ++i) {
    Scene alone = scene;
    alone.seed = 7 + static_cast<std::uint64_t>(i);
    Simulation simulation(alone);
    run(simulation, 400);
    CHECK(difference(batch, i, simulation) < 1e-9);
    ends.push_back(simulation.positions()[0]);
  }
  // no two are alike
  for (std::size_t i = 1; i < ends.size(); ++i) CHECK(std::abs(ends[i] - ends[i - 1]) > 1e-6);
}

TEST_CASE("a batch of a scene has what draw and apply give it, in every bit and after a reset", "[scene][batch]") {
  const Scene scene = bent_chain("randomize: {masses: 0.3, joint_friction: [0.5, 2], gains: 0.4}\n");
  Batch batch(scene, 4), by_hand(scene.model, 4, scene.options, scene.effects);
  for (std::int64_t i = 0; i < 4; ++i) {
    apply(draw(scene.randomization, scene.model, scene.effects, 7 + static_cast<std::uint64_t>(i)), scene.effects, by_hand, i);
    by_hand.reset(i, scene.initial.positions, scene.initial.velocities);
  }
  const auto same = [&] {
    for (std::int64_t i = 0; i < 4; ++i) {
      CHECK(batch.positions().instance(i) == by_hand.positions().instance(i));
      CHECK(batch.momenta().instance(i) == by_hand.momenta().instance(i));
    }
  };
  batch.step(100);
  by_hand.step(100);
  same();
  for (Batch* each : {&batch, &by_hand}) each->reset(2, scene.initial.positions, scene.initial.velocities);
  batch.step(50);
  by_hand.step(50);
  same();
}

TEST_CASE("a batch refuses scenes that a simulation refuses, and those that only a simulation can step", "[scene][batch]") {
  const Scene outside = bent_chain("  limits: {joint1: {lower: -0.1, upper: 0.1}}\n");
  CHECK_THROWS_WITH(Simulation(outside), Catch::Contains("it starts where it cannot stay"));
  CHECK_THROWS_WITH(Batch(outside, 3), Catch::Contains("it starts where it cannot stay"));
  Scene given = outside;
  given.start_as_given = true;
  CHECK(Batch(given, 3).positions()(2, 0) == 0.3);
  Scene finer = bent_chain();
  finer.options.order = 4;
  CHECK_THROWS_WITH(Batch(finer, 3), Catch::Contains("a step of order 4 goes back in time"));
  Scene short_of_one = bent_chain();
  short_of_one.start_as_given = true;
  short_of_one.initial.positions.pop_back();
  CHECK_THROWS_WITH(Batch(short_of_one, 3), Catch::Contains("positions: 3 numbers given for model \"chain:4\", expected 4"));
  CHECK_THROWS_WITH(Batch(bent_chain(), 0), Catch::Contains("0 instances"));
}

}  // namespace linden::scene_batch_test
