// The factor of a step outlasts it where the next can be solved with it.
#include "engine/solve/held_factor.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::held_factor_test {
namespace {

Model humanoid() { return load_urdf(model_file("humanoid.urdf"), Base::floating); }

TEST_CASE("a factor serves while a correction with it is expected to reach the tolerance, by what the last ones left") {
  HeldFactor<double> held;
  const auto serves = [&](double tolerance) { return held.serves(tolerance, held.age()); };
  CHECK_FALSE(serves(1));
  held.begin(1e-6, true);
  held.end(1e-13, false, true);
  CHECK(serves(1.1e-9));  // of a motion unknown: 1e-3, and 5 % less for each step with a factor of its own
  CHECK_FALSE(serves(0.9e-9));

  held.begin(1e-6, false);
  held.corrected(2e-4, false);
  held.end(2e-10, false, false);
  CHECK(serves(4.1e-10));  // two steps old
  CHECK_FALSE(serves(3.9e-10));
  held.begin(1e-7, false);
  held.corrected(1e-2, true);  // rounding: no larger than before
  held.end(1e-9, true, false);
  CHECK(serves(6.1e-11));
  CHECK(serves(0));  // below that floor
  held.begin(1e-4, false);
  held.corrected(6e-5, true);
  held.end(1e-10, true, false);
  CHECK_FALSE(serves(0));
  CHECK(serves(8.1e-9));  // 2e-5 a step, four steps old
  CHECK_FALSE(serves(7.9e-9));
  held.begin(1e-4, true);
  held.end(1e-10, false, true);
  CHECK(serves(1.91e-9));
  CHECK_FALSE(serves(1.89e-9));

  held.begin(0, false);
  for (int step = 1; step < 32; ++step) held.end(0, false, false);
  CHECK(serves(0));
  held.end(0, false, false);
  CHECK_FALSE(serves(1));  // too old
  held.end(0, false, true);
  CHECK(serves(0));
  held.drop();
  CHECK_FALSE(serves(1));
}

TEST_CASE("a calm motion needs few factors, a wild one as many as steps, and neither more evaluations") {
  const auto taken = [](const Model& model, const Options& options, double spread, int steps) {
    Simulation simulation(model, options);
    random_start(simulation, 1, spread);
    run(simulation, 10);
    return simulation.run(steps);
  };
  const StepsReport calm = taken(humanoid(), {}, 0.1, 500);
  CHECK(calm.ok());
  CHECK(calm.factorisations < 50);
  CHECK(calm.factorisations >= 500 / 33);
  CHECK(calm.evaluations <= 2 * 500 + 10);

  // a first guess that is far off keeps Newton's square; without the extrapolation every step has a factor of its own
  const StepsReport rough = taken(humanoid(), {.guess = FirstGuess::ig2}, 0.1, 500);
  CHECK(rough.factorisations >= 500);

  Simulation whip(chain(100));
  random_start(whip, 1, 0.1);
  run(whip, 600);
  const StepsReport wild = whip.run(400);
  CHECK(wild.steps == 400);
  CHECK(wild.factorisations > 350);
}

TEST_CASE("smooth effects have held factors too; where something may stick, stop or saturate each step has its own") {
  const auto factorisations = [](const auto& add) {
    Effects effects;
    const Model model = humanoid();
    add(effects, model);
    Simulation simulation(model, {}, effects);
    random_start(simulation, 1, 0.1);
    run(simulation, 10);
    const StepsReport report = simulation.run(300);
    CHECK(report.ok());
    CHECK(report.largest_residual <= 1e-10);
    return report.factorisations;
  };
  CHECK(factorisations([](Effects& effects, const Model& model) { effects.damping = urdf_damping(model); }) < 30);
  CHECK(factorisations([](Effects& effects, const Model&) { effects.drag.push_back({.slot = 3, .linear = 5}); }) < 30);
  CHECK(factorisations([](Effects& effects, const Model& model) { effects.friction = urdf_friction(model); }) >= 300);
  CHECK(factorisations([](Effects& effects, const Model& model) { effects.limits = urdf_limits(model); }) >= 300);
}

TEST_CASE("steps with a held factor meet the tolerance, and keep energy and momentum like any other") {
  for (const double tolerance : {1e-8, 1e-10, 1e-12}) {
    Simulation simulation(humanoid(), {.gravity = {0, 0, 0}, .tolerance = tolerance});
    random_start(simulation, 1, 0.3);
    const double before = simulation.energy().total();
    const Momentum momentum = simulation.momentum();
    const StepsReport report = simulation.run(20'000);
    REQUIRE(report.ok());
    CHECK(report.factorisations < 10'000);
    CHECK(report.largest_residual <= (report.floor_steps > 0 ? 1e-10 : tolerance));
    CHECK(std::abs(simulation.energy().total() - before) < 1e-6 * before);
    for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(simulation.momentum().angular[k] - momentum.angular[k]) < 1e-10);
  }
}

TEST_CASE("a factor that no longer serves is made anew: a blow to a calm motion costs one step more, not all that follow") {
  Simulation simulation(humanoid(), {.gravity = {0, 0, 0}});
  random_start(simulation, 1, 0.1);
  run(simulation, 100);
  std::vector<double> blow(simulation.momenta().size(), 0.0);
  for (std::size_t row = 6; row < blow.size(); ++row) blow[row] = row % 2 == 0 ? 20 : -20;
  simulation.set_forces(blow);
  const StepReport struck = simulation.step();
  REQUIRE(struck.ok());
  CHECK(struck.residual <= 1e-10);
  simulation.set_forces({});
  StepsReport after;
  for (int k = 0; k < 300; ++k) {
    after.add(simulation.step());
    REQUIRE(after.ok());
  }
  CHECK(after.evaluations < 3 * 300);
  CHECK(after.largest_residual <= 1e-10);
}

TEST_CASE("a crack costs a step no more corrections for a factor that was held until then") {
  Simulation simulation(chain(10));  // let go from horizontal, it cracks a few times a second
  const StepsReport report = simulation.run(10'000);
  REQUIRE(report.ok());
  CHECK(report.factorisations < 10'000);
  CHECK(report.most_iterations <= 4);  // 3; 6 where a factor that missed by far was kept
}

TEST_CASE("what is asked of a simulation between steps does not change its motion") {
  Simulation asked(humanoid()), left_alone(humanoid());
  for (Simulation* simulation : {&asked, &left_alone}) random_start(*simulation, 2, 0.2);
  for (int k = 0; k < 100; ++k) {
    asked.step();
    asked.energy();
    asked.velocities();
    asked.momentum();
    asked.set_forces({});
  }
  run(left_alone, 100);
  CHECK(std::ranges::equal(asked.positions(), left_alone.positions()));
  CHECK(std::ranges::equal(asked.momenta(), left_alone.momenta()));
}

TEST_CASE("a checkpoint holds the factor: continued to the bit wherever it was saved") {
  const Folder folder;
  for (const Model& model : {humanoid(), chain(20)}) {  // of the chain every other step or so has a factor of its own
    Simulation straight(model);
    random_start(straight, 2, 0.2);
    for (int part = 0; part < 5; ++part) {
      run(straight, 7);
      straight.save(folder.file("state"));
      Simulation continued(model);
      continued.load(folder.file("state"));
      run(straight, 40);
      run(continued, 40);
      CHECK(std::ranges::equal(straight.positions(), continued.positions()));
      CHECK(std::ranges::equal(straight.momenta(), continued.momenta()));
    }
  }
  Simulation simulation(humanoid());
  simulation.save(folder.file("state"));
  Simulation paper(humanoid(), {.solver = Solver::riqn});
  CHECK_THROWS_WITH(paper.load(folder.file("state")), Catch::Contains("another way to solve"));
}

TEST_CASE("a state that is set anew begins with a factor of its own") {
  const InitialState start = random_state(humanoid(), 3, 0.2);
  Simulation used(humanoid()), fresh(humanoid());
  random_start(used, 2, 0.2);
  run(used, 50);
  for (Simulation* simulation : {&used, &fresh}) {
    simulation->set_velocities(std::vector<double>(start.velocities.size(), 0.0));
    simulation->set_positions(start.positions);
    simulation->set_velocities(start.velocities);
    run(*simulation, 50);
  }
  CHECK(std::ranges::equal(used.positions(), fresh.positions()));
}

}  // namespace
}  // namespace linden::held_factor_test
