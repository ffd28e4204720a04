// The solve of a step: iterations, methods, first guesses, and what happens when it fails.
#include <cmath>

#include "models/build/builder.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/kernels/allocation_counter.hpp"

namespace linden::solver_test {
namespace {

double mean_iterations(Index links, int steps) {
  Simulation simulation(chain(links), {.step = 1e-3});
  random_start(simulation, 1, 0.1);
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const StepReport report = simulation.step();
    REQUIRE(report.ok());
    CHECK(report.substeps == 1);
    sum += report.iterations;
  }
  return sum / steps;
}

TEST_CASE("Newton's iterations do not grow with the length of a chain") {
  CHECK(mean_iterations(100, 200) < 4);
  CHECK(mean_iterations(1000, 100) < 4);
  CHECK(mean_iterations(10000, 20) < 4);
}

TEST_CASE("a chain of 100,000 links loads and steps") {
  Simulation simulation(chain(100'000), {.step = 1e-3});
  run(simulation, 3);
  CHECK(simulation.energy().kinetic > 0);
}

TEST_CASE("every solver and every first guess finds the same trajectory") {
  const Model model = random_tree({.bodies = 15, .seed = 5});
  std::vector<double> expected;
  for (const Solver solver : {Solver::newton, Solver::riqn}) {
    for (const FirstGuess guess : {FirstGuess::extrapolation, FirstGuess::ig1, FirstGuess::ig2, FirstGuess::ig3}) {
      for (const StopTest stop : {StopTest::energy, StopTest::absolute}) {
        CAPTURE(name(solver), name(guess), name(stop));
        Simulation simulation(model, {.step = 1e-3, .solver = solver, .guess = guess, .stop = stop, .tolerance = 1e-11});
        random_start(simulation, 6, 0.3);
        run(simulation, 100);
        if (expected.empty()) expected.assign(simulation.positions().begin(), simulation.positions().end());
        CHECK(distance(simulation.positions(), expected) < 1e-9);
      }
    }
  }
}

TEST_CASE("a better first guess saves evaluations, and so does Newton over the quasi-Newton method of the paper") {
  const auto evaluations = [](Solver solver, FirstGuess guess) {
    Simulation simulation(chain(100), {.step = 1e-3, .solver = solver, .guess = guess});
    random_start(simulation, 1, 0.1);
    int sum = 0;
    for (int k = 0; k < 200; ++k) sum += simulation.step().evaluations;
    return sum;
  };
  const int extrapolation = evaluations(Solver::newton, FirstGuess::extrapolation);
  const int ig2 = evaluations(Solver::newton, FirstGuess::ig2);
  CHECK(extrapolation < ig2);
  CHECK(ig2 < evaluations(Solver::newton, FirstGuess::ig1));
  CHECK(extrapolation < evaluations(Solver::riqn, FirstGuess::extrapolation));
}

TEST_CASE("an absolute tolerance below rounding stops at the floor and says so") {
  for (const Solver solver : {Solver::newton, Solver::riqn}) {
    Simulation simulation(chain(100), {.step = 1e-3, .solver = solver, .stop = StopTest::absolute, .tolerance = 1e-30});
    random_start(simulation, 1, 0.1);
    for (int k = 0; k < 20; ++k) {
      const StepReport report = simulation.step();
      REQUIRE(report.ok());
      CHECK(report.at_rounding_floor);
      CHECK(report.residual < 1e-9);
      CHECK(report.iterations < 40);
    }
  }
}

TEST_CASE("a step allocates nothing, whatever happens in it") {
  for (const Solver solver : {Solver::newton, Solver::riqn}) {
    Simulation hand(load_urdf(model_file("hand.urdf")), {.step = 1e-3, .solver = solver});
    random_start(hand, 1, 0.3);
    Simulation fast(ball_chain(5), {.step = 0.05, .solver = solver});
    random_start(fast, 1, 3);
    int splits = 0;
    const AllocationCounter counter;
    for (int k = 0; k < 50; ++k) {
      (void)hand.step();
      splits += fast.step().substeps > 1;
    }
    CHECK(counter.count() == 0);
    CHECK(splits > 0);  // the ladder of rescues was climbed
  }
}

TEST_CASE("a body that spins past half a turn a step is carried by smaller steps, and the report says so") {
  TreeBuilder builder("top");
  LinkSpec top;
  top.name = "top";
  top.joint = "spin";
  top.type = JointType::ball;
  top.inertia = box_inertia(1, {0.1, 0.2, 0.3}, {0, 0, 0});
  builder.add(top);
  const Model model = builder.build();
  for (const double turn : {0.5, 0.9, 0.99, 1.01, 1.5, 7.3}) {  // half turns a step
    CAPTURE(turn);
    Simulation simulation(model, {.step = 1e-2, .gravity = {0, 0, 0}});
    const std::vector<double> rate{0, 0, turn * std::numbers::pi / 1e-2};
    simulation.set_velocities(rate);
    const StepReport report = simulation.step();
    REQUIRE(report.ok());
    CHECK((report.substeps > 1) == (turn > 1));
    // about a principal axis the top turns by rate times time
    const double half = turn * std::numbers::pi / 2;
    CHECK(std::abs(simulation.positions()[2] * std::cos(half) - simulation.positions()[3] * std::sin(half)) < 1e-9);
  }
}

TEST_CASE("a step that cannot be saved leaves the last good state and names the body") {
  Simulation simulation(chain(10), {.step = 1, .max_splits = 0});
  random_start(simulation, 1, 30);
  const std::vector<double> q(simulation.positions().begin(), simulation.positions().end());
  const std::vector<double> p(simulation.momenta().begin(), simulation.momenta().end());
  const StepReport report = simulation.step();
  REQUIRE_FALSE(report.ok());
  CHECK(report.slot > 0);
  const std::string message = simulation.describe(report);
  CHECK_THAT(message, Catch::Contains(simulation.model().names.body[static_cast<std::size_t>(report.slot)]));
  CHECK_THAT(message, Catch::Contains("try a step below 0.25 s"));
  CHECK(std::equal(q.begin(), q.end(), simulation.positions().begin()));
  CHECK(std::equal(p.begin(), p.end(), simulation.momenta().begin()));
  CHECK(simulation.time() == 0);
}

TEST_CASE("speeds beyond all numbers are reported, not handed on") {
  Simulation simulation(chain(3), {.step = 1e-3});
  simulation.set_velocities(std::vector<double>{1e200, 1e200, 1e200});
  const StepReport report = simulation.step();
  REQUIRE_FALSE(report.ok());
  for (const double x : simulation.positions()) CHECK(std::isfinite(x));
}

TEST_CASE("a tree at rest in balance stays at rest") {
  Simulation floating(load_urdf(model_file("humanoid.urdf"), Base::floating), {.step = 1e-3, .gravity = {0, 0, 0}});
  run(floating, 100);
  CHECK(floating.energy().total() == 0);
  const Model pendulum = paper_chain(20);
  Simulation balanced(pendulum, {.step = 1e-3});
  std::vector<double> down(20, 0.0);
  down[0] = std::numbers::pi / 2;
  balanced.set_positions(down);
  run(balanced, 1000);
  CHECK(balanced.energy().kinetic < 1e-20);
}

TEST_CASE("options that make no sense are refused") {
  const auto refused = [](const Options& options) { CHECK_THROWS_AS(Simulation(chain(2), options), InputError); };
  refused({.step = 0});
  refused({.step = -1e-3});
  refused({.step = std::nan("")});
  refused({.tolerance = 0});
  refused({.gravity = {0, std::nan(""), 0}});
  refused({.max_splits = 99});
  CHECK_THROWS_WITH(solver_from("newtn"), Catch::Contains("newton, riqn"));
}

}  // namespace
}  // namespace linden::solver_test
