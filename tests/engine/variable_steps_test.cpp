// Steps that vary with the motion: what they keep, that they belong to the motion alone, and what is refused.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/drift.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/step_pilot.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/reference/closed_forms.hpp"

namespace linden::variable_steps_test {
namespace {

struct Kept {
  EnergyDrift energy{100'000};
  std::int64_t steps = 0, evaluations = 0;
  double band() const { return energy.band() / energy.scale(); }
  double slope() const { return energy.slope() / energy.scale(); }
};

/// Steps to t, energy looked at in every node.
Kept kept_until(Simulation& simulation, double t) {
  Kept kept;
  const auto look = [&] { kept.energy.add(simulation.time(), simulation.energy(), simulation.effect_work().taken(), simulation.effect_work().given()); };
  look();
  while (simulation.time() < t) {
    const StepReport report = simulation.step();
    if (!report.ok()) FAIL(simulation.describe(report));
    kept.evaluations += report.evaluations;
    ++kept.steps;
    look();
  }
  return kept;
}

bool same_state(Simulation& a, Simulation& b) {
  return a.time() == b.time() && a.last_step() == b.last_step() && std::ranges::equal(a.positions(), b.positions()) && std::ranges::equal(a.momenta(), b.momenta());
}

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

using Catch::Contains;

TEST_CASE("a ten-link chain keeps its energy to the accuracy asked for, at every order, for fewer evaluations than fixed steps") {
  struct Case {
    double accuracy, time, most_a_second;
    int order;
  };
  for (const auto& [accuracy, time, most_a_second, order] : {Case{1e-3, 20, 6'000, 2}, {1e-5, 20, 7'000, 4}, {1e-8, 3, 20'000, 6}}) {
    CAPTURE(accuracy);
    Simulation simulation(chain(10), {.accuracy = accuracy});
    CHECK(simulation.options().order == order);
    CHECK(simulation.options().tolerance == default_tolerance(order));
    const Kept kept = kept_until(simulation, time);
    CHECK(kept.band() < accuracy);
    CHECK(std::abs(kept.slope()) * time < 0.2 * accuracy);
    CHECK(static_cast<double>(kept.evaluations) < most_a_second * time);
    CHECK(simulation.step_lengths()->kept());
    CHECK(simulation.step_lengths()->lowered == 0);
    CHECK(simulation.step_lengths()->steps == kept.steps);
  }
  // fixed steps of as many evaluations
  Simulation variable(chain(10), {.accuracy = 1e-5});
  const Kept ours = kept_until(variable, 20);
  Simulation fixed(chain(10), {.step = 20.0 / static_cast<double>(ours.steps), .order = 4, .tolerance = 1e-12, .reduction = 1e-5});
  const Kept theirs = kept_until(fixed, 20);
  CHECK(static_cast<double>(theirs.evaluations) > 0.95 * static_cast<double>(ours.evaluations));
  CHECK(theirs.band() > 4 * ours.band());
}

TEST_CASE("a pendulum from 2.8 rad follows the elliptic functions, the error falling as the accuracy asked for") {
  const Pendulum pendulum(2.8);
  Effects nothing;  // but the order stays 2, as with what cannot be taken back in time
  nothing.torques.push_back({.row = 0, .force = {}});
  for (const auto& [order, accuracy] : {std::pair(2, 1e-3), std::pair(4, 3e-5)}) {
    std::array<double, 3> errors{};
    for (std::size_t k = 0; k < errors.size(); ++k) {
      Simulation simulation(Pendulum::model(), {.tolerance = 1e-14, .accuracy = accuracy * std::pow(0.25, static_cast<double>(k))},
                            order == 2 ? nothing : Effects());
      REQUIRE(simulation.options().order == order);
      simulation.set_positions(std::vector<double>{pendulum.start()});
      while (simulation.time() < 2.5) {
        REQUIRE(simulation.step().ok());
        errors[k] = std::max(errors[k], pendulum.error(simulation.time(), simulation.positions()));
      }
    }
    CAPTURE(order, errors[0], errors[1], errors[2]);
    // theta by the root of 2 at order 4: 2.8 would be third order
    CHECK(errors[0] / errors[1] == Approx(4).epsilon(0.25));
    CHECK(errors[1] / errors[2] == Approx(4).epsilon(0.2));
  }
}

TEST_CASE("a body that turns steadily is stepped steadily") {
  // about its largest axis, so that it stays there
  Simulation simulation(FreeBody::model(), {.gravity = {0, 0, 0}, .accuracy = 1e-3});
  simulation.set_velocities(std::vector<double>{0, 0, 3});
  for (int k = 0; k < 20; ++k) REQUIRE(simulation.step().ok());  // from the first length to its own
  const double h = simulation.last_step();
  for (int k = 0; k < 300; ++k) {
    REQUIRE(simulation.step().ok());
    CHECK(simulation.last_step() == Approx(h).epsilon(1e-9));
  }
  // theta / D, of which half is w^2 and a quarter w^2 again
  CHECK(h == Approx(std::sqrt(1e-3 / 4) / (3 * std::sqrt(1.25))).epsilon(1e-6));
}

TEST_CASE("what rests or falls freely is stepped too, by no more than a hundred times the step") {
  SECTION("a pendulum that hangs") {
    Simulation simulation(Pendulum::model(), {.accuracy = 1e-6});
    for (int k = 0; k < 50; ++k) REQUIRE(simulation.step().ok());
    CHECK(simulation.last_step() == Approx(0.1));
    CHECK(simulation.positions()[0] == 0);
    CHECK(simulation.step_lengths()->kept());
  }
  SECTION("a humanoid that falls") {
    Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating), {.accuracy = 1e-3});
    const double height = simulation.positions()[2];
    for (int k = 0; k < 50; ++k) REQUIRE(simulation.step().ok());
    CHECK(simulation.last_step() > 0.015);
    CHECK(simulation.positions()[2] - height == Approx(-0.5 * 9.81 * simulation.time() * simulation.time()));
  }
}

TEST_CASE("a weightless humanoid keeps its momentum to rounding however its steps vary") {
  Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating), {.gravity = {0, 0, 0}, .accuracy = 1e-4});
  random_start(simulation, 2, 5);
  const Momentum start = simulation.momentum();
  CHECK(simulation.advance_to(30).ok());
  const Momentum now = simulation.momentum();
  CHECK(simulation.step_lengths()->longest > 1.5 * simulation.step_lengths()->shortest);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(now.linear[k] == Approx(start.linear[k]).epsilon(1e-10).margin(1e-10));
    CHECK(now.angular[k] == Approx(start.angular[k]).epsilon(1e-10).margin(1e-10));
  }
}

TEST_CASE("a motion has the same bits however it is cut up, looked at, recorded or restarted") {
  for (const double accuracy : {1e-3, 1e-5}) {
    CAPTURE(accuracy);
    const Options options{.accuracy = accuracy};
    Simulation straight(chain(6), options), pieces(chain(6), options), looked(chain(6), options);
    CHECK(straight.advance_to(2).ok());
    for (int k = 1; k <= 7; ++k) CHECK(pieces.advance_to(2.0 * k / 7).ok());
    for (int k = 1; k <= 400; ++k) {
      CHECK(looked.advance_to(0.005 * k).ok());
      (void)looked.positions_at(0.005 * k);
      (void)looked.energy();
      if (k % 50 != 0) continue;
      Simulation again(chain(6), options);
      again.restore(looked.checkpoint());
      CHECK(again.checkpoint() == looked.checkpoint());
      CHECK(again.positions_at(0.005 * k) == looked.positions_at(0.005 * k));
      CHECK(again.advance_to(2).ok());
      CHECK(same_state(again, straight));
    }
    CHECK(same_state(pieces, straight));
    CHECK(same_state(looked, straight));
  }
}

TEST_CASE("fixed steps go to a time as well, with the bits that they have") {
  Simulation counted(chain(4), {.step = 1e-3}), timed(chain(4), {.step = 1e-3});
  run(counted, 300);
  CHECK(timed.advance_to(0.1234).steps == 124);
  CHECK(timed.time() == Approx(0.124));
  CHECK(timed.advance_to(0.1).steps == 0);
  CHECK(timed.advance_to(0.3).ok());
  CHECK(timed.steps() == 300);
  CHECK(same_state(counted, timed));
  CHECK_FALSE(timed.step_lengths());

  // an accuracy beside a step chooses the order alone
  Simulation chosen(chain(4), {.step = 1e-3, .accuracy = 1e-5, .vary = false}), named(chain(4), {.step = 1e-3, .order = 4, .tolerance = 1e-12, .reduction = 1e-5});
  run(chosen, 20);
  run(named, 20);
  CHECK(chosen.options().order == 4);
  CHECK(same_state(chosen, named));
}

TEST_CASE("positions between nodes are those of the motion, to the fourth order of the step") {
  const Pendulum pendulum(2.8);
  const auto error = [&](double h) {
    Simulation simulation(Pendulum::model(), {.step = h, .order = 8, .tolerance = 1e-14});
    simulation.set_positions(std::vector<double>{pendulum.start()});
    double most = 0;
    for (int k = 1; k <= 170; ++k) {
      CHECK(simulation.advance_to(0.013 * k).ok());
      most = std::max(most, pendulum.error(0.013 * k, simulation.positions_at(0.013 * k)));
    }
    return most;
  };
  const double coarse = error(0.04), fine = error(0.02);
  CHECK(std::log2(coarse / fine) == Approx(4).margin(0.5));
  CHECK(fine < 2e-5);

  SECTION("of bodies that tumble too, however they are turned") {
    const FreeBody body;
    Simulation simulation(FreeBody::model(), {.step = 0.01, .order = 8, .gravity = {0, 0, 0}, .tolerance = 1e-14});
    std::vector<double> q, v;
    for (const long double component : body.orientation(0)) q.push_back(static_cast<double>(component));
    for (const long double component : body.velocity(0)) v.push_back(static_cast<double>(component));
    simulation.set_positions(q);
    simulation.set_velocities(v);
    for (int k = 1; k <= 20; ++k) {
      CHECK(simulation.advance_to(0.0137 * k).ok());
      CHECK(body.error(0.0137 * k, simulation.positions_at(0.0137 * k)) < 1e-6);
    }
  }
  SECTION("and of bases that float") {
    const auto humanoid = [](double h) {
      Simulation simulation(load_urdf(model_file("humanoid.urdf"), Base::floating), {.step = h, .order = 4, .tolerance = 1e-13});
      random_start(simulation, 3, 1);
      return simulation;
    };
    Simulation coarse_steps = humanoid(0.01), fine_steps = humanoid(0.0025);
    for (const double t : {0.0125, 0.0225, 0.0425}) {
      CHECK(coarse_steps.advance_to(t).ok());
      CHECK(fine_steps.advance_to(t).ok());
      CHECK(distance(coarse_steps.positions_at(t), fine_steps.positions()) < 1e-6);
    }
  }
}

TEST_CASE("positions are told within the last step, and of other times it is said which there are") {
  Simulation simulation(chain(3), {.accuracy = 1e-3});
  CHECK(simulation.advance_to(0.5).ok());
  const double end = simulation.time();
  CHECK(end >= 0.5);
  CHECK(end - simulation.last_step() < 0.5);
  CHECK(std::ranges::equal(simulation.positions_at(end), simulation.positions()));
  CHECK_NOTHROW(simulation.positions_at(0.5));
  CHECK(simulation.advance_to(0.2).steps == 0);
  CHECK_THAT(refusal([&] { (void)simulation.positions_at(0.2); }), Contains("positions at 0.2 s were asked for; expected a time from"));
  CHECK_THAT(refusal([&] { (void)simulation.positions_at(9); }), Contains("within the last step"));
  CHECK_THAT(refusal([&] { (void)simulation.positions_at(std::nan("")); }), Contains("within the last step"));
  CHECK_THAT(refusal([&] { (void)simulation.advance_to(HUGE_VAL); }), Contains("expected a finite time"));
}

TEST_CASE("a step ends where an input jumps, and no step before it is tiny") {
  Effects effects;
  effects.torques.push_back({.row = 0, .force = {{0, 0.3, 0.3, 0.7, 0.7}, {0, 0, 0.4, 0.4, 0}}});
  Simulation simulation(chain(2), {.accuracy = 1e-3}, effects);
  std::vector<double> nodes;
  double shortest_change = 1;
  for (double before = 0; simulation.time() < 1; before = simulation.last_step()) {
    REQUIRE(simulation.step().ok());
    nodes.push_back(simulation.time());
    if (before > 0) shortest_change = std::min(shortest_change, simulation.last_step() / before);
  }
  for (const double jump : {0.3, 0.7}) CHECK(std::ranges::count(nodes, jump) == 1);
  CHECK(shortest_change > 0.6);
  // what was given is booked: energy less that stays
  CHECK(simulation.effect_work().given() > 0.01);
  CHECK(simulation.step_lengths()->strayed < 1e-3);
}

TEST_CASE("a damped pendulum is followed to its rest in longer and longer steps") {
  Simulation simulation(load_scene(std::string(LINDEN_MODELS_DIR) + "/scenes/pendulum_damped.yaml"));
  Scene scene = load_scene(std::string(LINDEN_MODELS_DIR) + "/scenes/pendulum_damped.yaml");
  scene.options.accuracy = 1e-3;
  Simulation variable(scene);
  CHECK(variable.options().order == 2);
  const Kept kept = kept_until(variable, 20);
  CHECK(kept.band() < 1e-3);
  CHECK(simulation.advance_to(25).ok());
  CHECK(variable.advance_to(25).ok());
  CHECK(variable.last_step() > 1e-2);
  CHECK(variable.positions_at(25)[0] == Approx(simulation.positions()[0]).margin(1e-3));
}

TEST_CASE("a damped chain is nearer to its motion than with fixed steps of as many evaluations") {
  Effects effects;
  for (Index row = 0; row < 10; ++row) effects.damping.push_back({.row = row, .coefficient = 1e-3});
  const auto model = std::make_shared<const Model>(chain(10));
  const auto moved = [&](const Options& options) {
    Simulation simulation(model, options, effects);
    const StepsReport report = simulation.advance_to(3);
    return std::pair(simulation.positions_at(3), report.evaluations);
  };
  const auto [exact, many] = moved({.step = 4e-5});
  const auto [variable, ours] = moved({.accuracy = 1e-3});
  const auto [fixed, theirs] = moved({.step = 1e-3});
  CHECK(theirs > ours);
  CHECK(distance(variable, exact) < 0.06);
  CHECK(distance(fixed, exact) > 1.7 * distance(variable, exact));
}

TEST_CASE("a pilot says fixed of a spring, whose length keeps the accuracy, and variable of a chain, and leaves the simulation as it was") {
  Simulation whipping(chain(10), {.accuracy = 1e-5});
  const std::string before = whipping.checkpoint();
  CHECK(pilot(whipping, 100).vary);
  CHECK(whipping.checkpoint() == before);

  Effects effects;
  effects.springs.push_back({.row = 0, .stiffness = 50});
  const auto model = std::make_shared<const Model>(chain(1));
  const Options options{.gravity = {0, 0, 0}, .accuracy = 1e-4};
  Simulation spring(model, options, effects);
  spring.set_positions(std::vector<double>{0.4});
  const StepPilot found = pilot(spring, 100);
  CHECK_FALSE(found.vary);
  Options fixed = options;
  fixed.vary = false;
  fixed.step = found.step;
  Simulation chosen(model, fixed, effects);
  chosen.set_positions(std::vector<double>{0.4});
  CHECK(kept_until(chosen, 10).band() < 1e-4);
}

TEST_CASE("an accuracy that makes no sense is refused in one sentence, and so is what it does not go with") {
  for (const double accuracy : {0.0, -1e-6, 1e-30, 1.0, std::nan(""), HUGE_VAL}) {
    CAPTURE(accuracy);
    CHECK_THAT(refusal([&] { Simulation(chain(1), {.accuracy = accuracy}); }), Contains("the accuracy is") && Contains("such as 1e-6"));
  }
  CHECK_THAT(refusal([] { Batch(chain(2), 4, {.accuracy = 1e-3}); }), Contains("a batch takes steps of one length"));
  Scene scene = load_scene(std::string(LINDEN_MODELS_DIR) + "/scenes/humanoid_drop.yaml");
  scene.options.accuracy = 1e-3;
  CHECK_THAT(refusal([&] { Simulation drop(scene); }), Contains("do not see impacts coming; the scene has limits and ground"));
  scene.options.vary = false;
  CHECK_NOTHROW(Simulation(scene));
}

TEST_CASE("a checkpoint of variable steps is refused by others, and the other way round") {
  Simulation fixed(chain(2), {}), varying(chain(2), {.accuracy = 1e-3}), other(chain(2), {.accuracy = 2e-3});
  for (Simulation* each : {&fixed, &varying, &other}) run(*each, 3);
  CHECK_THAT(refusal([&] { fixed.restore(varying.checkpoint()); }), Contains("made with variable steps of accuracy 0.001; the simulation has fixed steps"));
  CHECK_THAT(refusal([&] { varying.restore(fixed.checkpoint()); }), Contains("made with fixed steps; the simulation has variable steps"));
  CHECK_THAT(refusal([&] { varying.restore(other.checkpoint()); }), Contains("accuracy 0.002"));
}

TEST_CASE("a scene names its accuracy, and a step beside it is the length of all") {
  const Folder folder;
  const auto read = [&](const std::string& text) {
    folder.write("scene.yaml", "model: chain:3\neffects: {gravity: [0, 0, -9.81]}\n" + text);
    return load_scene(folder.file("scene.yaml"));
  };
  const Scene automatic = read("accuracy: 1e-5\nstep: auto\n"), plain = read("accuracy: 1e-5\n"), fixed = read("accuracy: 1e-5\nstep: 2e-3\n");
  for (const Scene* scene : {&automatic, &plain, &fixed}) CHECK(scene->options.accuracy == 1e-5);
  CHECK(automatic.options.varies());
  CHECK(plain.options.varies());
  CHECK_FALSE(fixed.options.varies());
  CHECK(fixed.options.step == 2e-3);
  CHECK(Simulation(fixed).options().order == 4);
  CHECK_FALSE(read("step: 1e-3\n").options.accuracy);
  CHECK_THAT(refusal([&] { read("step: auto\n"); }), Contains("the step is auto, and no accuracy is named"));
  CHECK_THAT(refusal([&] { read("accuracy: -1\n"); }), Contains("scene.yaml:3") && Contains("accuracy"));
  CHECK_THAT(refusal([&] { read("accuracy: 1e-30\n"); }), Contains("scene.yaml:3") && Contains("the accuracy is 1e-30"));
}

}  // namespace
}  // namespace linden::variable_steps_test
