// Orders 4, 6 and 8 in lanes: the motion of a simulation of that order, to the bit the same in any company.
#include <catch2/catch.hpp>
#include <cmath>

#include "engine/batch.hpp"
#include "engine/initial_state.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::batch_orders_test {
namespace {

Options options_of(int order, double step) {
  Options options{.step = step, .order = order};
  use_default_tolerance(options);
  return options;
}

template <class AnyBatch>
void start_all(AnyBatch& batch, double spread, std::int64_t first = 0) {
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    const InitialState state = random_state(batch.model(), static_cast<std::uint64_t>(first + i) + 1, (first + i) % 3 == 0 ? 4 * spread : spread);
    batch.reset(i, state.positions, state.velocities);
  }
}

Index first_screw(const Model& model) {
  Index slot = 1;
  while (model.tree.kind(slot) != JointKind::screw) ++slot;
  return model.tree.first_v(slot);
}

std::vector<std::vector<double>> numbers_of(const Batch& batch) {
  std::vector<std::vector<double>> all;
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    const auto q = batch.positions().instance(i), p = batch.momenta().instance(i);
    all.emplace_back(q.begin(), q.end());
    all.back().insert(all.back().end(), p.begin(), p.end());
  }
  return all;
}

TEST_CASE("of any order an instance moves as a simulation does, with any set of instructions") {
  for (const bool sprung : {false, true}) {
    const Model model = random_tree({.bodies = 9, .seed = 5});
    Effects effects;
    if (sprung) effects.springs = {{.row = first_screw(model), .stiffness = 30, .rest = 0.1}};
    for (const int order : {4, 6, 8}) {
      const Options options = options_of(order, 2e-3);
      for (const Instructions instructions : all_instructions()) {
        Batch batch(model, 7, options, effects, {.instructions = instructions});
        start_all(batch, 0.4);
        batch.step(40);
        CHECK(batch.summary().rescued == 0);
        CHECK(batch.summary().steps == 7 * 40);
        for (std::int64_t i = 0; i < batch.size(); ++i) {
          Simulation simulation(model, options, effects);
          const InitialState state = random_state(model, static_cast<std::uint64_t>(i) + 1, i % 3 == 0 ? 1.6 : 0.4);
          simulation.set_positions(state.positions);
          simulation.set_velocities(state.velocities);
          REQUIRE(simulation.run(40).ok());
          for (Index row = 0; row < model.tree.shape.positions; ++row) {
            INFO("order " << order << ", " << name(instructions) << ", instance " << i << ", row " << row);
            CHECK(batch.positions()(i, row) == Approx(simulation.positions()[static_cast<std::size_t>(row)]).margin(1e-8));
          }
        }
      }
    }
  }
}

TEST_CASE("halving the step of order 4 leaves a sixteenth of the error, in lanes too") {
  const Model model = chain(4);
  const auto end = [&](int order, double step) {
    Options options = options_of(order, step);
    options.tolerance = 1e-13;
    options.reduction = 0;
    Batch batch(model, 5, options);
    start_all(batch, 1.0);
    batch.step(std::llround(0.2 / step));
    return numbers_of(batch);
  };
  const auto exact = end(8, 1e-3);
  const auto error = [&](double step) {
    const auto found = end(4, step);
    double worst = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (std::size_t k = 0; k < found[i].size(); ++k) worst = std::max(worst, std::abs(found[i][k] - exact[i][k]));
    }
    return worst;
  };
  const double coarse = error(8e-3), fine = error(4e-3);
  CHECK(coarse / fine > 12);
  CHECK(coarse / fine < 20);
}

TEST_CASE("orders above 2 give equal bits for any threads, company, splitting of the steps, and from a checkpoint") {
  const Model model = random_tree({.bodies = 10, .seed = 8});
  const auto run = [&](std::int64_t size, int threads, std::int64_t first, const std::vector<std::int64_t>& parts) {
    Batch batch(model, size, options_of(4, 2e-3), {}, {.threads = threads});
    start_all(batch, 0.5, first);
    for (const std::int64_t steps : parts) batch.step(steps);
    return numbers_of(batch);
  };
  const auto reference = run(21, 1, 0, {30});
  CHECK(run(21, 2, 0, {30}) == reference);
  CHECK(run(21, 1, 0, {1, 4, 25}) == reference);
  const auto part = run(16, 2, 5, {30});
  for (std::size_t i = 0; i < part.size(); ++i) CHECK(part[i] == reference[i + 5]);

  Batch once(model, 21, options_of(4, 2e-3)), again(model, 21, options_of(4, 2e-3));
  start_all(once, 0.5);
  once.step(10);
  again.restore(once.checkpoint());
  again.step(20);
  CHECK(numbers_of(again) == reference);
}

TEST_CASE("a sub-step that is too large for the lanes takes its instance back to where the step began, and alone") {
  const Model model = chain(6);
  Options options = options_of(4, 2e-2);
  const auto run = [&](double spread) {
    Batch batch(model, 12, options);
    for (std::int64_t i = 0; i < batch.size(); ++i) {
      const InitialState state = random_state(model, static_cast<std::uint64_t>(i) + 1, i == 5 ? spread : 0.3);
      batch.reset(i, state.positions, state.velocities);
    }
    batch.step(4);
    return std::pair(numbers_of(batch), batch.summary());
  };
  const auto [calm, without] = run(0.3);
  const auto [wild, with] = run(60);
  CHECK(without.rescued == 0);
  CHECK(with.rescued > 0);
  for (std::size_t i = 0; i < calm.size(); ++i) {
    if (i != 5) CHECK(wild[i] == calm[i]);
  }
  Simulation simulation(model, options);
  const InitialState state = random_state(model, 6, 60);
  simulation.set_positions(state.positions);
  simulation.set_velocities(state.velocities);
  REQUIRE(simulation.run(4).ok());
  for (std::size_t k = 0; k < 6; ++k) CHECK(wild[5][k] == Approx(simulation.positions()[k]).epsilon(1e-5));
}

TEST_CASE("what cannot be taken back in time is refused above order 2") {
  Effects damped;
  damped.damping = {{.row = 0, .coefficient = 1}};
  CHECK_THROWS_AS(Batch(chain(3), 2, options_of(4, 1e-3), damped), InputError);
  CHECK_THROWS_AS(Batch(chain(3), 2, Options{.order = 3}), InputError);
}

}  // namespace
}  // namespace linden::batch_orders_test
