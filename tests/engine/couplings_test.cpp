// Loops closed by couplings, in steps of a tree that is stepped alone.
#include <catch2/catch.hpp>

#include "engine/batch.hpp"
#include "engine/initial_state.hpp"
#include "tests/engine/mechanisms.hpp"

namespace linden::couplings_test {
namespace {

double largest_kinetic(Simulation& simulation, int steps, double& band) {
  const double start = simulation.energy().total();
  double kinetic = 0;
  for (int k = 0; k < steps; ++k) {
    const StepReport report = simulation.step();
    INFO(simulation.describe(report));
    REQUIRE(report.ok());
    const Energy now = simulation.energy();
    kinetic = std::max(kinetic, now.kinetic);
    band = std::max(band, std::abs(now.total() - start));
  }
  return kinetic;
}

Simulation moving_four_bar(CouplingKind kind, const Options& options) {
  Simulation simulation(four_bar(kind), options);
  simulation.set_velocities(std::vector{1.0, 0.0, 0.0});
  return simulation;
}

}  // namespace

TEST_CASE("A four-bar moves the same, closed by five rows, three or two") {
  std::vector<std::vector<double>> ends;
  for (const CouplingKind kind : {CouplingKind::hinge, CouplingKind::ball, CouplingKind::point_on_line}) {
    Simulation simulation = moving_four_bar(kind, {.step = 1e-3, .tolerance = 1e-13});  // at which gaps end in rounding
    double band = 0;
    const double kinetic = largest_kinetic(simulation, 2000, band);
    CHECK(band < 2e-5 * kinetic);
    CHECK(worst_gap(simulation.couplings()) < 4e-14);
    ends.emplace_back(simulation.positions().begin(), simulation.positions().end());
  }
  for (std::size_t row = 0; row < 3; ++row) {
    CHECK(ends[1][row] == Approx(ends[0][row]).margin(1e-11));
    CHECK(ends[2][row] == Approx(ends[0][row]).margin(1e-11));
  }
}

TEST_CASE("A mechanism holds its factors, and its gaps stay where the tolerance puts them") {
  const auto largest = [](double tolerance, std::int64_t& factorisations) {
    Simulation simulation = moving_four_bar(CouplingKind::hinge, {.step = 1e-3, .tolerance = tolerance});
    double gap = 0;
    for (int k = 0; k < 20; ++k) {
      const StepsReport report = simulation.run(200);
      REQUIRE(report.ok());
      factorisations += report.factorisations;
      gap = std::max(gap, worst_gap(simulation.couplings()));
    }
    return gap;
  };
  std::int64_t coarse = 0, fine = 0;
  CHECK(largest(1e-10, coarse) < 3e-12);
  CHECK(largest(1e-13, fine) < 4e-14);
  CHECK(coarse < 400);   // of 4,000 steps: 204
  CHECK(fine < 2 * 4000);
}

TEST_CASE("Steps with a loop are of second order, and of the order that is asked for") {
  const auto end = [](double h, int order) {
    Options options{.step = h};
    options.order = order;
    use_default_tolerance(options);
    Simulation simulation = moving_four_bar(CouplingKind::hinge, options);
    const StepsReport report = simulation.run(std::llround(0.5 / h));
    REQUIRE(report.ok());
    return simulation.positions()[0];
  };
  const double exact = end(1e-3, 8);
  const auto ratio = [&](double h, int order) { return (end(h, order) - exact) / (end(h / 2, order) - exact); };
  CHECK(ratio(2e-3, 2) == Approx(4).epsilon(0.02));
  CHECK(ratio(2e-2, 4) == Approx(16).epsilon(0.1));
}

TEST_CASE("A step with a loop taken back leads to where it began") {
  Simulation there = moving_four_bar(CouplingKind::hinge, {.step = 1e-3, .tolerance = 1e-13});
  const std::vector<double> begin(there.positions().begin(), there.positions().end());
  REQUIRE(there.run(2000).ok());
  std::vector<double> back = there.velocities();
  for (double& rate : back) rate = -rate;
  Simulation home(there.model(), there.options());
  home.set_positions(there.positions());
  home.set_velocities(back);
  REQUIRE(home.run(2000).ok());
  for (std::size_t row = 0; row < 3; ++row) CHECK(home.positions()[row] == Approx(begin[row]).margin(1e-11));
}

TEST_CASE("A free ring keeps its momentum and stays closed") {
  for (const int n : {3, 10, 60}) {
    Simulation simulation(ring(n), {.step = 1e-3, .gravity = {0, 0, 0}});
    std::vector<double> rates(static_cast<std::size_t>(simulation.model().tree.shape.velocities), 0.0);
    rates[1] = 2;
    for (std::size_t row = 6; row < rates.size(); ++row) rates[row] = 0.3 * std::sin(static_cast<double>(3 * row));
    simulation.set_velocities(rates);
    const Momentum before = simulation.momentum();
    double band = 0;
    const double kinetic = largest_kinetic(simulation, 1000, band);
    INFO(n);
    CHECK(band < 1e-4 * kinetic);
    CHECK(worst_gap(simulation.couplings()) < 1e-12 * n);
    const Momentum after = simulation.momentum();
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(after.angular[k] == Approx(before.angular[k]).margin(1e-11 * n * n * n));
      CHECK(after.linear[k] == Approx(before.linear[k]).margin(1e-11 * n * n));
    }
  }
}

TEST_CASE("Bricard's loop moves, though one of its rows follows from the others") {
  Simulation simulation(bricard(), {.step = 1e-3});
  double band = 0;
  const double kinetic = largest_kinetic(simulation, 10'000, band);
  CHECK(kinetic > 1);
  CHECK(band < 1e-5 * kinetic);
  const CouplingState state = simulation.couplings()[0];
  CHECK(worst_gap({state}) < 1e-13);
  CHECK(std::ranges::count(state.redundant, true) == 1);
}

TEST_CASE("A parallelogram passes its change points without a loss and on its branch") {
  // with the default tolerance one step in five is near enough as it is guessed, and open by 3e-13
  Simulation simulation(parallelogram(), {.step = 1e-3, .gravity = {0, 0, 0}, .tolerance = 1e-13});
  simulation.set_velocities(std::vector{2.0, 2.0, -2.0});
  double band = 0;
  const double kinetic = largest_kinetic(simulation, 20'000, band);
  CHECK(band < 1e-9 * kinetic);
  CHECK(worst_gap(simulation.couplings()) < 1e-13);
  CHECK(simulation.positions()[0] == Approx(simulation.positions()[1]).margin(1e-6));
  CHECK(std::abs(simulation.positions()[0]) > 6 * std::numbers::pi);
}

namespace {

/// Instances of a mechanism, each with its own speed, and the same one by one.
template <class BatchType, class Speeds>
void compare_with_simulations(const Model& model, const Options& options, const Effects& effects, const Speeds& speeds, int steps, double margin) {
  const std::int64_t size = 11;
  const auto nv = static_cast<std::size_t>(model.tree.shape.velocities);
  BatchType batch(model, size, options, effects);
  std::vector<Simulation> alone;
  const Simulation neutral(model, options, effects);
  for (std::int64_t i = 0; i < size; ++i) {
    std::vector<double> v(nv);
    for (std::size_t row = 0; row < nv; ++row) v[row] = speeds(i, row);
    batch.reset(i, neutral.positions(), v);
    alone.emplace_back(model, options, effects).set_velocities(v);
  }
  batch.step(steps);
  for (std::int64_t i = 0; i < size; ++i) {
    INFO(i << ": " << batch.describe(i));
    REQUIRE(batch.record(i).status == StepStatus::converged);
    REQUIRE(alone[static_cast<std::size_t>(i)].run(steps).ok());
    const auto expected = alone[static_cast<std::size_t>(i)].positions();
    for (std::size_t row = 0; row < expected.size(); ++row) {
      CHECK(static_cast<double>(batch.positions()(i, static_cast<Index>(row))) == Approx(expected[row]).margin(margin));
    }
  }
  const auto seen = batch.observe();
  for (std::int64_t i = 0; i < size; ++i) {
    const std::vector<double> expected = alone[static_cast<std::size_t>(i)].velocities();
    for (std::size_t row = 0; row < nv; ++row) {
      CHECK(static_cast<double>(seen.velocities()(i, static_cast<Index>(row))) == Approx(expected[row]).margin(1e3 * margin));
    }
  }
  CHECK(batch.summary().rescued == 0);
}

}  // namespace

TEST_CASE("Mechanisms step in lanes as they do alone") {
  const auto speeds = [](std::int64_t i, std::size_t row) { return 0.2 * static_cast<double>(i + 1) * std::sin(static_cast<double>(3 * row + 1)); };
  for (const CouplingKind kind : {CouplingKind::hinge, CouplingKind::ball, CouplingKind::point_on_line}) {
    compare_with_simulations<Batch>(four_bar(kind), {.step = 1e-3}, {}, speeds, 500, 1e-9);
    compare_with_simulations<FloatBatch>(four_bar(kind), {.step = 1e-3}, {}, speeds, 100, 2e-4);
  }
  compare_with_simulations<Batch>(bricard(), {.step = 1e-3}, {}, speeds, 500, 1e-9);
  compare_with_simulations<Batch>(ring(10), {.step = 1e-3}, {}, speeds, 500, 1e-8);
  Options fourth{.step = 5e-3};
  fourth.order = 4;
  use_default_tolerance(fourth);
  compare_with_simulations<Batch>(four_bar(CouplingKind::hinge), fourth, {}, speeds, 100, 1e-9);
  Effects damped;
  damped.damping.push_back({0, 0.3});
  damped.friction.push_back({1, 0.2});
  compare_with_simulations<Batch>(four_bar(CouplingKind::hinge), {.step = 1e-3}, damped, speeds, 1000, 1e-8);
}

TEST_CASE("A mechanism in lanes is the same to the bit in any company") {
  const Model model = four_bar(CouplingKind::hinge);
  Effects rubbed;
  rubbed.friction.push_back({1, 0.2});
  for (const Effects& effects : {Effects{}, rubbed}) {
    const auto ends = [&](std::int64_t size, std::int64_t first) {
      Batch batch(model, size, {.step = 2e-3}, effects);
      for (std::int64_t i = 0; i < size; ++i) {
        const double speed = 0.5 * static_cast<double>(i + first);
        batch.reset(i, std::vector<double>(3, 0.0), std::vector<double>{speed, 0, 0});
      }
      batch.step(300);
      std::vector<double> all;
      for (std::int64_t i = 0; i < size; ++i) all.push_back(batch.positions()(i, 1));
      return all;
    };
    const std::vector<double> together = ends(13, 0);
    for (std::int64_t i = 0; i < 13; ++i) CHECK(ends(1, i)[0] == together[static_cast<std::size_t>(i)]);
  }
}

TEST_CASE("A batch closes starts that are nearly closed and refuses those that are open") {
  Batch batch(four_bar(CouplingKind::hinge), 3, {.step = 1e-3});
  const std::vector<double> rest(3, 0.0);
  batch.reset(1, std::vector{1e-5, 0.0, 0.0}, rest);
  batch.step(10);
  CHECK(batch.summary().frozen == 0);
  CHECK_THROWS_WITH(batch.reset(2, std::vector{0.3, 0.0, 0.0}, rest), Catch::Contains("coupling \"pin\" is open by"));
}

namespace {

/// 2 rad/s from zero on, for three seconds.
JointMotion turned(Index row) {
  JointMotion motion{row, {{0}, {0}}};
  for (int k = 1; k <= 60; ++k) {
    motion.position.times.push_back(0.05 * k);
    motion.position.values.push_back(0.1 * k);
  }
  return motion;
}

}  // namespace

TEST_CASE("A mechanism that is driven begins at the speed of its drive") {
  const Model model = four_bar(CouplingKind::hinge);
  Effects effects;
  effects.motions.push_back(turned(0));
  for (const bool given : {false, true}) {
    Simulation simulation(model, {.step = 1e-3}, effects);
    if (given) simulation.set_velocities(std::vector{5.0, -3.0, 1.0});
    const std::vector<double> start = simulation.velocities();
    CHECK(start[0] == Approx(2));
    const double kinetic = simulation.energy().kinetic;
    Simulation led(model, {.step = 1e-3});  // of a single degree of freedom
    led.set_velocities(start);
    CHECK(led.energy().kinetic == Approx(kinetic).epsilon(1e-12));
    for (std::size_t row = 0; row < 3; ++row) CHECK(led.velocities()[row] == Approx(start[row]).epsilon(1e-12));
    Batch batch(model, 2, {.step = 1e-3}, effects);
    batch.reset(1, simulation.positions(), std::vector{5.0, -3.0, 1.0});
    for (Index row = 0; row < 3; ++row) CHECK(batch.observe().velocities()(1, row) == Approx(start[static_cast<std::size_t>(row)]).epsilon(1e-12));
    REQUIRE(simulation.run(1).ok());
    for (std::size_t row = 0; row < 3; ++row) CHECK(simulation.velocities()[row] == Approx(start[row]).epsilon(0.02));
  }
}

TEST_CASE("A mechanism bounces off its limits, and rests on them, as its one coordinate does") {
  // without gravity: the kinetic energy is all that there is
  const Model model = four_bar(CouplingKind::hinge);
  const auto limited = [&](Index row, double e) {
    Effects effects;
    JointLimit limit;
    limit.row = row;
    limit.lower = -0.3;
    limit.upper = 0.2;
    limit.restitution = e;
    effects.limits.push_back(limit);
    Options options{.step = 1e-3, .tolerance = 1e-13};
    options.gravity = {0, 0, 0};
    Simulation simulation(model, options, effects);
    simulation.set_velocities(std::vector{1.0, 0.0, 0.0});
    return simulation;
  };
  for (const Index row : {0, 1, 2}) {
    for (const double e : {1.0, 0.5, 0.0}) {
      CAPTURE(row, e);
      Simulation simulation = limited(row, e);
      const double kinetic = simulation.energy().kinetic;
      int blows = 0;
      double left = kinetic;
      for (int k = 0; k < 5000; ++k) {
        const StepReport report = simulation.step();
        INFO(simulation.describe(report));
        REQUIRE(report.ok());
        if (report.blows > 0) left *= e * e;
        blows += report.blows;
        REQUIRE(simulation.energy().kinetic == Approx(left).epsilon(1e-5).margin(1e-12));
      }
      CHECK(blows >= 1);
      // a limit that stops takes along the mean of two displacements: off by second order
      CHECK(simulation.effect_work().of<JointLimit>() == Approx(kinetic - left).epsilon(e == 0 ? 2e-4 : 1e-5).margin(1e-12));
      if (e == 0) {
        for (const double v : simulation.velocities()) CHECK(std::abs(v) < 1e-10);
      }
      CHECK(worst_gap(simulation.couplings()) < 1e-13);
    }
  }
}

TEST_CASE("Random starts of a driven mechanism are closed around its drive") {
  const Model model = four_bar(CouplingKind::hinge);
  Effects effects;
  effects.motions.push_back({0, {{0, 1}, {0.2, 1.2}}});
  std::vector<double> start{0.2, 0, 0};
  CHECK(assemble(model, start, Assembled::from_anywhere, effects.motions).closed);
  CHECK(start[0] == 0.2);
  Batch batch(model, 5, {.step = 1e-3}, effects);
  for (std::int64_t i = 0; i < 5; ++i) {
    const InitialState around = random_around(model, {start, {}}, static_cast<std::uint64_t>(i), 0.2, effects);
    CHECK(around.positions[0] == 0.2);
    batch.reset(i, around.positions, around.velocities);
  }
  batch.step(100);
  CHECK(batch.summary().frozen == 0);
}

TEST_CASE("A free body is held to the world at its own origin") {
  for (const CouplingKind kind : {CouplingKind::ball, CouplingKind::hinge, CouplingKind::weld, CouplingKind::cylindrical, CouplingKind::slider}) {
    CAPTURE(name_of(kind));
    TreeBuilder builder("held");
    LinkSpec body = bar("body", "", {0, 0, 0}, {1, 0, 0});
    body.type = JointType::free;
    builder.add(body);
    CouplingSpec spec;
    spec.kind = kind;
    spec.link_b = "body";
    spec.at = PointAndAxis{{0, 0, 0}, {0, 1, 0}};
    Simulation simulation(coupled(builder.build(), {spec}), {.step = 1e-3});
    const double before = simulation.energy().total();
    for (int k = 0; k < 1000; ++k) {
      const StepReport report = simulation.step();
      INFO(simulation.describe(report));
      REQUIRE(report.ok());
    }
    CHECK(worst_gap(simulation.couplings()) < 1e-13);
    CHECK(simulation.energy().total() == Approx(before).margin(1e-4));
  }
}

TEST_CASE("A step that would open a coupling is refused by name") {
  // the rocker is led past where the crank can follow
  const Model model = four_bar(CouplingKind::hinge);
  Effects effects;
  effects.motions.push_back(turned(1));
  Simulation simulation(model, {.step = 1e-3}, effects);
  StepReport report;
  std::vector<double> before;
  for (int k = 0; k < 3000 && report.ok(); ++k) {
    before.assign(simulation.positions().begin(), simulation.positions().end());
    report = simulation.step();
  }
  CHECK(report.status == StepStatus::opens);
  CHECK_THAT(simulation.describe(report), Catch::Contains("coupling \"pin\" opens by") && Catch::Contains("cannot follow"));
  CHECK(before == std::vector<double>(simulation.positions().begin(), simulation.positions().end()));
  CHECK(worst_gap(simulation.couplings()) < 3e-3);

  Batch batch(model, 3, {.step = 1e-3}, effects);
  batch.step(3000);
  CHECK(batch.summary().frozen == 3);
  CHECK(batch.record(1).status == StepStatus::opens);
  CHECK(batch.record(1).steps == simulation.steps());
  CHECK_THAT(batch.describe(1), Catch::Contains("coupling \"pin\" opens by"));
}

TEST_CASE("Axes that are off by rounding are taken for parallel, those that are off by more hold the mechanism still") {
  const auto end = [](double off) {
    TreeBuilder builder("four-bar");
    builder.add(bar("crank", "", {0, 0, 0}, {0, 0, 1}));
    builder.add(bar("coupler", "crank", {0, 0, 1}, {2, 0, 1}, Eigen::Vector3d(off, 1, 0).normalized()));
    builder.add(bar("rocker", "", {3, 0, 0}, {-1, 0, 2}));
    Simulation simulation(coupled(builder.build(), {{.name = "pin",
                                                     .kind = CouplingKind::hinge,
                                                     .link_a = "coupler",
                                                     .link_b = "rocker",
                                                     .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}}}),
                          {.step = 1e-3});
    simulation.set_velocities(std::vector{1.0, 0.0, 0.0});
    const StepsReport report = simulation.run(2000);
    INFO(off << ": " << simulation.describe(report.last));
    REQUIRE(report.ok());
    // a start from there is closed as well
    Simulation again(simulation.model(), {.step = 1e-3});
    again.set_positions(simulation.positions());
    CHECK(again.openness().closed);
    CHECK(again.run(10).ok());
    return std::pair(simulation.positions()[0], simulation.openness().relative);
  };
  const double exact = end(0).first;
  for (const double off : {1e-12, 1e-9, 1e-7, 1e-6, 1e-5}) {
    const auto [q, open] = end(off);
    CHECK(q == Approx(exact).margin(10 * off * off + 1e-9));
    CHECK(open < 10 * off + 1e-12);
  }
  CHECK(std::abs(end(1e-3).first) < 1e-3);
}

}  // namespace linden::couplings_test
