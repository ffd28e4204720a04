// Orders 4, 6 and 8: their coefficients, what they keep of the one-step map, and what they refuse.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include "engine/batch.hpp"
#include "engine/compose/composition.hpp"
#include "engine/scene/scene_file.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/kernels/allocation_counter.hpp"

namespace linden::composition_test {
namespace {

constexpr int kHigher[] = {4, 6, 8};

// Coefficients.

using Wide = long double;

/// Angle of a pendulum after a second of steps of h, each composed of leapfrog steps.
Wide pendulum_after_a_second(std::span<const double> stages, int steps) {
  Wide q = 1, p = 0.3L;
  for (int step = 0; step < steps; ++step) {
    for (const double stage : stages) {
      const Wide h = static_cast<Wide>(stage) / steps;
      p -= h / 2 * std::sin(q);
      q += h * p;
      p -= h / 2 * std::sin(q);
    }
  }
  return q;
}

TEST_CASE("the stages of every order are symmetric and sum to one step") {
  for (const int order : {2, 4, 6, 8}) {
    CAPTURE(order);
    const std::span<const double> stages = composition(order);
    CHECK(stages.size() == (order == 2 ? 1u : order == 4 ? 5u : order == 6 ? 11u : 17u));
    CHECK(std::accumulate(stages.begin(), stages.end(), 0.0) == Approx(1).margin(5e-16));
    for (std::size_t i = 0; i < stages.size(); ++i) CHECK(stages[i] == stages[stages.size() - 1 - i]);
    // the error terms that are powers of single stages cancel
    for (int power = 3; power < order; power += 2) {
      double sum = 0;
      for (const double stage : stages) sum += std::pow(stage, power);
      CHECK(std::abs(sum) < 1e-15);
    }
  }
}

/// What is done by Y1, Y3, ... one after the other: a factor for each word of their numbers.
using Words = std::map<std::vector<int>, Wide>;

/// Words whose numbers sum to `grade` at most.
std::vector<std::vector<int>> words_to(int grade) {
  std::vector<std::vector<int>> words{{}};
  for (std::size_t k = 0; k < words.size(); ++k) {
    for (int number = 1; number <= grade - std::reduce(words[k].begin(), words[k].end()); number += 2) {
      words.push_back(words[k]);
      words.back().push_back(number);
    }
  }
  return words;
}

TEST_CASE("composed of any symmetric map, all terms of the exact flow up to the order are there and no others") {
  // a symmetric map is exp(h Y1 + h^3 Y3 + h^5 Y5 + ...): the coefficient of a word of r numbers with sum g in it is h^g / r!
  for (const int order : {2, 4, 6, 8}) {
    CAPTURE(order);
    const std::vector<std::vector<int>> words = words_to(order + 1);
    Words product{{{}, 1}};
    for (const double stage : composition(order)) {
      Words next;
      for (const auto& [done, factor] : product) {
        for (const std::vector<int>& more : words) {
          const int grade = std::reduce(more.begin(), more.end());
          if (std::reduce(done.begin(), done.end()) + grade > order + 1) continue;
          const Wide share = factor * std::pow(static_cast<Wide>(stage), grade) / std::tgamma(static_cast<Wide>(more.size() + 1));
          std::vector<int> both = done;
          both.insert(both.end(), more.begin(), more.end());
          next[both] += share;
        }
      }
      product = std::move(next);
    }
    Wide left = 0;
    for (const auto& [word, factor] : product) {
      const bool exact = std::ranges::all_of(word, [](int number) { return number == 1; });
      const Wide expected = exact ? 1 / std::tgamma(static_cast<Wide>(word.size() + 1)) : 0;
      const Wide off = std::abs(factor - expected);
      if (std::reduce(word.begin(), word.end()) <= order) {
        CHECK(off < 1e-15L);
      } else {
        left = std::max(left, off);
      }
    }
    CHECK(left > 1e-7L);  // and the order is no higher
  }
}

TEST_CASE("composed of leapfrog steps, a pendulum shows each order, and no more") {
  for (const int order : {2, 4, 6, 8}) {
    CAPTURE(order);
    // the reference is of order 8 at a step that leaves 1e-18
    const Wide exact = pendulum_after_a_second(composition(8), 64);
    const auto error = [&](int steps) { return std::abs(pendulum_after_a_second(composition(order), steps) - exact); };
    CHECK(static_cast<double>(std::log2(error(8) / error(16))) == Approx(order).margin(0.05));
  }
}

TEST_CASE("there is no other order") {
  for (const int order : {-2, 0, 1, 3, 10}) CHECK_THROWS_WITH(composition(order), Catch::Contains("choose 2, 4, 6 or 8"));
  CHECK_THROWS_WITH(Simulation(chain(2), {.order = 5}), Catch::Contains("no method of order 5"));
}

// Trees of bodies.

std::vector<double> end_of(const Model& model, int order, double h, double duration, double spread, const Effects& effects = {}) {
  Simulation simulation(model, {.step = h, .order = order, .tolerance = 1e-14}, effects);
  random_start(simulation, 3, spread);
  run(simulation, static_cast<int>(std::lround(duration / h)));
  return {simulation.positions().begin(), simulation.positions().end()};
}

/// From the errors at two steps of the ratio 2, the larger first.
double measured_order(const std::function<std::vector<double>(int order, double h)>& end, int order, double h) {
  const std::vector<double> fine = end(8, h / 8);
  return std::log2(distance(end(order, h), fine) / distance(end(order, h / 2), fine));
}

TEST_CASE("errors fall with the order's power of the step on every kind of joint") {
  // small enough a step that the next power does not count, large enough that rounding does not either; order 8 leaves so little
  // room between the two that its margin is wider (closed_form_test.cpp holds it to the same as the others)
  struct Case {
    Model model;
    double h, h8, spread;  // h8: for order 8
  };
  for (const Case& given : {Case{chain(5), 4e-3, 8e-3, 0.2}, Case{ball_chain(2), 4e-3, 6e-3, 0.5},
                            Case{random_tree({.bodies = 8, .seed = 4}), 16e-3, 32e-3, 0.2},
                            Case{load_urdf(model_file("humanoid.urdf"), Base::floating), 8e-3, 16e-3, 0.5},
                            Case{load_urdf(model_file("hand.urdf")), 4e-3, 6e-3, 0.3}}) {
    const auto end = [&](int p, double h) { return end_of(given.model, p, h, 0.384, given.spread); };
    for (const int order : {4, 6}) {
      CAPTURE(given.model.names.model, order);
      CHECK(measured_order(end, order, given.h) == Approx(order).margin(0.15));
    }
    CHECK(measured_order(end, 8, given.h8) == Approx(8).margin(0.3));
  }
}

TEST_CASE("rotors and springs, which can be taken back in time, keep the order") {
  const Model arm = load_urdf(model_file("arm.urdf"));
  Effects effects;
  effects.armature = armature_everywhere(arm, 0.05);
  for (const Armature& one : effects.armature) effects.springs.push_back({one.row, 40, 0.1});
  const Model balls = ball_chain(3);
  Effects pulled;
  for (Index slot = 1; slot < balls.tree.shape.slots; ++slot) pulled.ball_springs.push_back({slot, 0.05});
  for (const int order : kHigher) {
    CAPTURE(order);
    const auto turned = [&](int p, double h) { return end_of(arm, p, h, 0.384, 0.3, effects); };
    CHECK(measured_order(turned, order, order == 8 ? 16e-3 : 8e-3) == Approx(order).margin(order == 8 ? 0.3 : 0.15));
    const auto swung = [&](int p, double h) { return end_of(balls, p, h, 0.192, 0.2, pulled); };
    CHECK(measured_order(swung, order, 4e-3) == Approx(order).margin(order == 8 ? 0.3 : 0.15));
  }
}

TEST_CASE("a composed step is its own inverse when momenta are flipped") {
  for (const int order : kHigher) {
    CAPTURE(order);
    Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating),
                          {.step = 8e-3, .order = order, .tolerance = 1e-14});
    random_start(simulation, 5, 0.3);
    const std::vector<double> start(simulation.positions().begin(), simulation.positions().end());
    run(simulation, 50);
    CHECK(distance(simulation.positions(), start) > 1e-3);
    std::vector<double> back = simulation.velocities();
    for (double& rate : back) rate = -rate;
    simulation.set_velocities(back);
    run(simulation, 50);
    CHECK(distance(simulation.positions(), start) < 1e-10);
  }
}

TEST_CASE("higher orders keep the energy of the ten-link chain by as many digits more") {
  const auto largest_error = [](int order, double h) {
    Simulation simulation(chain(10), {.step = h, .order = order, .tolerance = 1e-13});
    const double start = simulation.energy().total();
    double largest = 0;
    for (int k = 0; k < std::lround(10 / h); ++k) {
      run(simulation, 1);
      largest = std::max(largest, std::abs(simulation.energy().total() - start));
    }
    return largest / kTenLinkFall;
  };
  // measured on one chaotic path each: 8e-7, 2e-9, 3e-12 at 1 ms, 1e-4, 2e-5, 2e-7 at 4 ms
  CHECK(largest_error(4, 1e-3) < 5e-6);
  CHECK(largest_error(6, 1e-3) < 1e-7);
  CHECK(largest_error(8, 1e-3) < 1e-10);
  CHECK(largest_error(4, 4e-3) < 2e-2);
  CHECK(largest_error(6, 4e-3) < 2e-3);
  CHECK(largest_error(8, 4e-3) < 6e-5);
}

TEST_CASE("momentum of a floating humanoid stays, whatever the order") {
  for (const int order : kHigher) {
    Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating),
                          {.step = 8e-3, .order = order, .gravity = {0, 0, 0}});
    random_start(simulation, 2, 0.5);
    const Momentum start = simulation.momentum();
    run(simulation, 500);
    const Momentum now = simulation.momentum();
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(now.linear[k] == Approx(start.linear[k]).epsilon(1e-11).margin(1e-11));
      CHECK(now.angular[k] == Approx(start.angular[k]).epsilon(1e-11).margin(1e-11));
    }
  }
}

TEST_CASE("every sub-step has a past of its own to start from: two evaluations of the residual, not more") {
  for (const int order : {2, 4, 6, 8}) {
    CAPTURE(order);
    Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating), {.step = 4e-3, .order = order});
    random_start(simulation, 3, 0.3);
    run(simulation, kHistory);
    std::int64_t evaluations = 0;
    constexpr int steps = 100;
    for (int k = 0; k < steps; ++k) evaluations += simulation.step().evaluations;
    CHECK(static_cast<double>(evaluations) < 2.2 * steps * static_cast<double>(composition(order).size()));
  }
}

TEST_CASE("with a reduction, solves that begin far off end before the tolerance and energy is kept as well") {
  const auto run_of = [](double reduction, double& band) {
    Simulation simulation(chain(10), {.step = 4e-3, .order = 4, .tolerance = 1e-12, .reduction = reduction});
    const double start = simulation.energy().total();
    std::int64_t evaluations = 0;
    for (int k = 0; k < 1000; ++k) {
      evaluations += simulation.step().evaluations;
      band = std::max(band, std::abs(simulation.energy().total() - start) / kTenLinkFall);
    }
    return evaluations;
  };
  double exact = 0, reduced = 0;
  CHECK(static_cast<double>(run_of(1e-5, reduced)) < 0.85 * static_cast<double>(run_of(0, exact)));
  CHECK(exact < 1e-3);
  CHECK(reduced < 1e-3);
  for (const double share : {-1e-5, 1.0, std::nan("")}) {
    CHECK_THROWS_WITH(Simulation(chain(2), {.reduction = share}), Catch::Contains("the solver's reduction"));
  }
}

TEST_CASE("what starts from rest, or is pushed by forces alone, is not taken for a false root") {
  for (const int order : kHigher) {
    CAPTURE(order);
    Simulation falling(chain(10), {.step = 4e-3, .order = order});
    run(falling, 20);
    Simulation pushed(ball_chain(5), {.step = 4e-3, .order = order, .gravity = {0, 0, 0}});
    pushed.set_forces(std::vector<double>(15, 1e-3));
    for (int k = 0; k < 20; ++k) CHECK(pushed.step().substeps == 1);
  }
}

TEST_CASE("every solver and stop test takes sub-steps back in time as well") {
  const auto end = [](const Options& options) {
    Simulation simulation(load_urdf(model_file("hand.urdf")), options);
    random_start(simulation, 3, 0.3);
    run(simulation, 50);
    return std::vector<double>(simulation.positions().begin(), simulation.positions().end());
  };
  const std::vector<double> usual = end({.step = 2e-3, .order = 6, .tolerance = 1e-13});
  CHECK(distance(end({.step = 2e-3, .order = 6, .solver = Solver::riqn, .tolerance = 1e-13}), usual) < 1e-9);
  CHECK(distance(end({.step = 2e-3, .order = 6, .stop = StopTest::absolute, .tolerance = 1e-12}), usual) < 1e-6);
  // a loose absolute tolerance is met without reaching for the floor that rounding sets
  Simulation loose(chain(5), {.step = 2e-3, .order = 6, .stop = StopTest::absolute, .tolerance = 1e-6});
  random_start(loose, 3, 0.3);
  for (int k = 0; k < 20; ++k) CHECK(!loose.step().at_rounding_floor);
  for (const FirstGuess guess : {FirstGuess::ig1, FirstGuess::ig2, FirstGuess::ig3}) {
    CHECK(distance(end({.step = 2e-3, .order = 6, .guess = guess, .tolerance = 1e-13}), usual) < 1e-9);
  }
}

// Steps that are too large.

TEST_CASE("a sub-step that fails is split, forward and back in time, and allocates nothing") {
  for (const int order : kHigher) {
    CAPTURE(order);
    Simulation fast(ball_chain(5), {.step = 0.05, .order = order});
    random_start(fast, 1, 3);
    int splits = 0;
    const AllocationCounter counter;
    for (int k = 0; k < 20; ++k) splits += fast.step().substeps > 1;
    CHECK(counter.count() == 0);
    CHECK(splits > 0);
  }
}

TEST_CASE("a composed step that fails leaves the state as it was, and the next one begins from there") {
  Simulation simulation(chain(10), {.step = 1, .order = 4, .max_splits = 0});
  random_start(simulation, 1, 30);
  const std::vector<double> q(simulation.positions().begin(), simulation.positions().end());
  const std::vector<double> p(simulation.momenta().begin(), simulation.momenta().end());
  const double energy = simulation.energy().total();
  const StepReport report = simulation.step();
  REQUIRE(!report.ok());
  CHECK(std::ranges::equal(simulation.positions(), q));
  CHECK(std::ranges::equal(simulation.momenta(), p));
  CHECK(simulation.energy().total() == energy);
  CHECK(simulation.steps() == 0);
  CHECK_THAT(simulation.describe(report), Catch::Contains("step"));
}

// Checkpoints.

TEST_CASE("a run of higher order continued from a checkpoint is bit-identical") {
  const Folder folder;
  for (const int order : kHigher) {
    CAPTURE(order);
    const Options options{.step = 4e-3, .order = order};
    const Model model = load_urdf(model_file("humanoid.urdf"), Base::floating);
    Simulation whole(model, options), rest(model, options);
    random_start(whole, 4, 0.4);
    run(whole, 3);  // with a past that is not yet full
    whole.save(folder.file("early"));
    run(whole, 20);
    rest.load(folder.file("early"));
    run(rest, 20);
    whole.save(folder.file("a"));
    rest.save(folder.file("b"));
    CHECK(text_of(folder / "a") == text_of(folder / "b"));
    Simulation other(model, {.step = 4e-3, .order = order == 4 ? 2 : 4});
    CHECK_THROWS_WITH(other.load(folder.file("a")), Catch::Contains("made with order " + std::to_string(order)));
  }
}

// What is refused.

TEST_CASE("effects that cannot be taken back in time are refused above order 2, by name and with the reason") {
  const Model arm = load_urdf(model_file("arm.urdf"));
  const auto check_refused = [&](const std::string& name, const Effects& effects) {
    CAPTURE(name);
    CHECK_THROWS_AS(Simulation(arm, {.order = 4}, effects), InputError);
    CHECK_THROWS_WITH(Simulation(arm, {.order = 4}, effects),
                      Catch::Contains("the scene has " + name + ": use order 2") && Catch::Contains("goes back in time"));
    CHECK_NOTHROW(Simulation(arm, {.order = 2}, effects));
  };
  const auto with = [](const auto& put) {
    Effects effects;
    put(effects);
    return effects;
  };
  check_refused("damping", with([&](Effects& e) { e.damping = damping_everywhere(arm, 1); }));
  check_refused("friction", with([&](Effects& e) { e.friction = friction_everywhere(arm, 1); }));
  check_refused("limits", with([&](Effects& e) { e.limits = {{0, -1, 1}}; }));
  check_refused("servo", with([&](Effects& e) { e.servos = servo_everywhere(arm, 10, 1); }));
  check_refused("torque", with([&](Effects& e) { e.torques = {{0, {{0, 1}, {0, 5}}}}; }));
  check_refused("wrench", with([&](Effects& e) { e.wrenches = {{.slot = 1, .force = {1, 0, 0}}}; }));
  check_refused("drag", with([&](Effects& e) { e.drag = {{1, 0.1}}; }));
  check_refused("ground", with([&](Effects& e) { e.ground.emplace(); }));
  Effects both;
  both.damping = damping_everywhere(arm, 1);
  both.drag = {{1, 0.1}};
  CHECK_THROWS_WITH(Simulation(arm, {.order = 8}, both), Catch::Contains("damping, drag: use order 2, or leave them out"));
}

TEST_CASE("a scene may name its order, and a tolerance that it does not name goes with it") {
  const auto options = [](const std::string& more) { return parse_scene("model: chain:3\n" + more, "s.yaml").options; };
  CHECK(options("").order == 2);
  CHECK(options("order: 4\n").order == 4);
  CHECK(options("order: 2\n").tolerance == 1e-10);
  CHECK(options("order: 4\n").tolerance == 1e-12);
  CHECK(options("order: 8\n").tolerance == 1e-13);
  CHECK(options("tolerance: 1e-9\norder: 8\n").tolerance == 1e-9);
  CHECK(options("order: 4\n").reduction == 1e-5);
  CHECK(options("order: 4\ntolerance: 1e-12\n").reduction == 0);
  for (const int order : {2, 6, 8}) CHECK(options(fmt::format("order: {}\n", order)).reduction == 0);
}

}  // namespace
}  // namespace linden::composition_test
