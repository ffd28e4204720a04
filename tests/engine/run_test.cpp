// Steps taken in one run are those taken one by one, to the bit.
#include <numeric>

#include "tests/engine/scenes.hpp"

namespace linden::run_test {
namespace {

struct Case {
  const char* what;
  Model model;
  Options options{};
  double spread = 0.3;
  int steps = 23;
};

std::vector<Case> cases() {
  return {
      {"one part", random_tree({.bodies = 30, .seed = 2})},
      {"branches that share rows", balanced_tree(4000)},
      {"branches that do not", random_tree({.bodies = 3000, .seed = 1})},
      {"a long chain", chain(2500)},
      {"tied joints", load_urdf(model_file("hand.urdf"), Base::floating)},
      {"the paper's solver", balanced_tree(2000), {.solver = Solver::riqn}},
      {"another first guess", balanced_tree(2000), {.guess = FirstGuess::ig2}},
      {"sub-steps", chain(10), {.order = 4}},
      {"no gravity", balanced_tree(2500), {.gravity = {0, 0, 0}}},
      {"no corrections", balanced_tree(4000), {.step = 1e-4, .tolerance = 1e-4}, 0.1},
  };
}

void compare(const Simulation& together, const Simulation& one_by_one) {
  CHECK(std::ranges::equal(together.positions(), one_by_one.positions()));
  CHECK(std::ranges::equal(together.momenta(), one_by_one.momenta()));
  CHECK(together.steps() == one_by_one.steps());
}

TEST_CASE("a run is its steps one by one, whatever is asked in between") {
  for (const Case& c : cases()) {
    INFO(c.what);
    Simulation together(c.model, c.options), one_by_one(c.model, c.options), in_pieces(c.model, c.options);
    for (Simulation* simulation : {&together, &one_by_one, &in_pieces}) random_start(*simulation, 3, c.spread);
    const StepsReport report = together.run(c.steps);
    StepsReport counted;
    for (int k = 0; k < c.steps; ++k) {
      counted.add(one_by_one.step());
      if (k % 5 == 0) one_by_one.velocities();
      if (k % 7 == 0) one_by_one.momentum();
    }
    for (int taken = 0, next = 1; taken < c.steps; taken += next, next = std::min(next + 2, c.steps - taken)) {
      REQUIRE(in_pieces.run(next).ok());
      in_pieces.energy();
    }
    compare(together, one_by_one);
    compare(together, in_pieces);
    CHECK(together.energy().total() == one_by_one.energy().total());
    CHECK(together.velocities() == one_by_one.velocities());
    CHECK(report.steps == c.steps);
    CHECK(report.evaluations == counted.evaluations);
    CHECK(report.factorisations == counted.factorisations);
    CHECK(report.iterations == counted.iterations);
    CHECK(report.most_iterations == counted.most_iterations);
    CHECK(report.largest_residual == counted.largest_residual);
  }
}

TEST_CASE("forces that change between runs act from the next step on") {
  const Model model = balanced_tree(2500);
  Simulation together(model), one_by_one(model);
  std::vector<double> force(model.names.velocity.size());
  for (int k = 0; k < 4; ++k) {
    for (std::size_t row = 0; row < force.size(); ++row) force[row] = 1e-3 * std::sin(0.1 * static_cast<double>(row) + k);
    together.set_forces(force);
    one_by_one.set_forces(force);
    run(together, 6);
    for (int step = 0; step < 6; ++step) run(one_by_one, 1);
  }
  compare(together, one_by_one);
}

TEST_CASE("a run ends with the last step that can be taken, and leaves what that left") {
  // falls freely and faster, until it turns too far in a step that must not be split
  const Model model = balanced_tree(2500);
  const Options options{.step = 0.02, .max_splits = 0};
  Simulation together(model, options), one_by_one(model, options);
  for (Simulation* simulation : {&together, &one_by_one}) random_start(*simulation, 3, 0.1);
  const StepsReport report = together.run(1000);
  REQUIRE_FALSE(report.ok());
  REQUIRE(report.steps > 5);
  for (std::int64_t k = 0; k < report.steps; ++k) run(one_by_one, 1);
  const StepReport failed = one_by_one.step();
  CHECK(failed.status == report.last.status);
  CHECK(failed.slot == report.last.slot);
  compare(together, one_by_one);
  CHECK(together.energy().total() == one_by_one.energy().total());
}

TEST_CASE("a step of a run that has to be split is split as it would be alone") {
  const Model model = balanced_tree(2500);
  const Options options{.step = 0.02};
  Simulation together(model, options), one_by_one(model, options);
  for (Simulation* simulation : {&together, &one_by_one}) random_start(*simulation, 3, 0.1);
  const StepsReport report = together.run(40);
  REQUIRE(report.ok());
  REQUIRE(report.split_steps > 0);
  REQUIRE(report.split_steps < 40);
  for (int k = 0; k < 40; ++k) run(one_by_one, 1);
  compare(together, one_by_one);
}

TEST_CASE("a run with no steps to take changes nothing") {
  Simulation simulation(chain(3));
  const StepsReport report = simulation.run(0);
  CHECK(report.ok());
  CHECK(report.steps == 0);
  CHECK(simulation.time() == 0);
}

TEST_CASE("what several runs took adds up, and a step that failed is not counted") {
  StepReport small{.iterations = 1, .evaluations = 2, .factorisations = 0, .residual = 1e-12};
  StepReport large{.iterations = 4, .evaluations = 5, .factorisations = 2, .substeps = 4, .at_rounding_floor = true, .residual = 1e-11};
  StepReport failed{.status = StepStatus::past_pi, .iterations = 100, .residual = 1};
  StepsReport first, second;
  first.add(small);
  first.add(large);
  second.add(small);
  second.add(failed);
  first.add(second);
  CHECK_FALSE(first.ok());
  CHECK(first.last.status == StepStatus::past_pi);
  CHECK(first.steps == 3);
  CHECK(first.iterations == 6);
  CHECK(first.evaluations == 9);
  CHECK(first.factorisations == 2);
  CHECK(first.substeps == 6);
  CHECK(first.most_iterations == 4);
  CHECK(first.split_steps == 1);
  CHECK(first.floor_steps == 1);
  CHECK(first.largest_residual == 1e-11);
}

TEST_CASE("splits in a row are counted across runs, however they are cut") {
  // s: split, p: not
  const std::string steps = "sspsssppsp";
  for (std::size_t cut = 0; cut <= steps.size(); ++cut) {
    StepsReport first, second;
    for (std::size_t k = 0; k < steps.size(); ++k) (k < cut ? first : second).add(StepReport{.substeps = steps[k] == 's' ? 2 : 1});
    StepsReport both;
    both.add(first);
    both.add(second);
    INFO("cut at " << cut);
    CHECK(both.splits_in_a_row == 3);
    CHECK(both.first_splits == 2);
    CHECK(both.last_splits == 0);
    CHECK(describe(both) == "6 of 10 steps were split, 3 of them in a row, 16 sub-steps in all: a smaller step keeps energy better");
  }
  StepsReport one;
  CHECK(describe(one).empty());
  one.add(StepReport{.substeps = 4});
  CHECK(describe(one) == "1 of 1 steps was split, 4 sub-steps in all: a smaller step keeps energy better");
}

}  // namespace
}  // namespace linden::run_test
