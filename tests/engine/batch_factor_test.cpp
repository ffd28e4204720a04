// The factor of a batch's step serves those that follow: fewer are made, the motion is the same, and no instance sees what its neighbours need.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "engine/batch.hpp"
#include "engine/initial_state.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::batch_factor_test {
namespace {

Model humanoid() { return load_urdf(model_file("humanoid.urdf"), Base::floating); }

template <class AnyBatch>
void start(AnyBatch& batch, std::int64_t i, std::int64_t number, double spread) {
  const InitialState state = random_state(batch.model(), static_cast<std::uint64_t>(number) + 1, spread);
  batch.reset(i, state.positions, state.velocities);
}

template <class AnyBatch>
std::string bytes_of(const AnyBatch& batch, std::int64_t i) {
  std::string bytes;
  const auto add = [&](const auto& rows) {
    for (const auto number : rows) bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
  };
  add(batch.positions().instance(i));
  add(batch.momenta().instance(i));
  return bytes;
}

/// Damping and springs, with which nothing sticks, stops or saturates.
Effects smooth_effects(const Model& model) {
  Effects effects;
  for (const Run& run : model.tree.runs) {
    for (Index slot = run.begin; run.kind == JointKind::screw && slot < run.end; ++slot) {
      effects.damping.push_back({.row = model.tree.first_v(slot), .coefficient = 0.3});
      effects.springs.push_back({.row = model.tree.first_v(slot), .stiffness = 40, .rest = 0.05});
    }
  }
  return effects;
}

TEST_CASE("a calm motion of a batch needs few factors, a wild one some, and both move as with a factor in every step") {
  struct Case {
    Model model;
    Effects effects;
    double spread, factors_a_step;
  };
  for (const Case& one : {Case{humanoid(), {}, 0.3, 0.25}, Case{humanoid(), smooth_effects(humanoid()), 0.1, 1.1}, Case{chain(10), {}, 2.0, 1.1}}) {
    const auto run = [&](bool holds) {
      Batch batch(one.model, 9, {}, one.effects, {.hold_factors = holds});
      for (std::int64_t i = 0; i < batch.size(); ++i) start(batch, i, i, one.spread);
      batch.step(100);  // what a motion is like is learned first
      const std::int64_t before = batch.summary().factors;
      batch.step(200);
      CHECK(batch.summary().rescued == 0);
      const double made = static_cast<double>(batch.summary().factors - before) / (9 * 200);
      return std::pair(std::move(batch), made);
    };
    const auto [held, few] = run(true);
    const auto [fresh, all] = run(false);
    INFO(one.model.names.model << " with " << one.effects.springs.size() << " springs: " << few << " and " << all << " factors a step");
    CHECK(few < one.factors_a_step);
    CHECK(all >= 1);
    CHECK(few < 1.2 * all);
    CHECK(static_cast<double>(held.summary().evaluations) < 1.1 * static_cast<double>(fresh.summary().evaluations));
    const auto seen = held.observe(), seen_fresh = fresh.observe();
    for (std::int64_t i = 0; i < held.size(); ++i) {
      const double total = seen.energies()(i, 0) + seen.energies()(i, 1), expected = seen_fresh.energies()(i, 0) + seen_fresh.energies()(i, 1);
      CHECK(std::abs(total - expected) < 1e-7 * seen_fresh.energies()(i, 0));
    }
  }
}

template <class AnyBatch>
void check_bits(const Model& model, const Effects& effects) {
  const auto run = [&](std::int64_t size, int threads, std::int64_t first, const std::vector<std::int64_t>& parts, bool looks) {
    AnyBatch batch(model, size, {}, effects, {.threads = threads});
    for (std::int64_t i = 0; i < size; ++i) start(batch, i, first + i, (first + i) % 3 == 0 ? 1.5 : 0.2);
    std::vector<std::string> bytes;
    for (const std::int64_t steps : parts) {
      batch.step(steps);
      if (looks) batch.observe();
    }
    CHECK(batch.summary().rescued == 0);
    for (std::int64_t i = 0; i < size; ++i) bytes.push_back(bytes_of(batch, i));
    return bytes;
  };
  const std::vector<std::string> reference = run(21, 1, 0, {250}, false);
  CHECK(run(21, 2, 0, {250}, false) == reference);
  CHECK(run(21, 1, 0, {1, 31, 1, 1, 97, 119}, true) == reference);
  const std::vector<std::string> part = run(16, 2, 5, {130, 120}, false);
  for (std::size_t i = 0; i < part.size(); ++i) CHECK(part[i] == reference[i + 5]);

  // neighbours at another count of steps, and a checkpoint on the way
  AnyBatch shifted(model, 21, {}, effects);
  for (std::int64_t i = 0; i < 21; ++i) start(shifted, i, i, i % 3 == 0 ? 1.5 : 0.2);
  shifted.step(37);
  for (const std::int64_t i : {1, 6, 7}) start(shifted, i, i, i % 3 == 0 ? 1.5 : 0.2);
  shifted.step(100);
  AnyBatch loaded(model, 21, {}, effects);
  loaded.restore(shifted.checkpoint());
  loaded.step(113);
  for (std::int64_t i = 0; i < 21; ++i) {
    if (i != 1 && i != 6 && i != 7) CHECK(bytes_of(loaded, i) == reference[static_cast<std::size_t>(i)]);
  }
  loaded.step(37);
  for (const std::int64_t i : {1, 6, 7}) CHECK(bytes_of(loaded, i) == reference[static_cast<std::size_t>(i)]);
}

TEST_CASE("held factors give equal bits for any threads, company, count of steps of the neighbours, splitting, and from a checkpoint") {
  check_bits<Batch>(humanoid(), {});
  check_bits<FloatBatch>(humanoid(), {});
  check_bits<Batch>(random_tree({.bodies = 8, .seed = 4}), {});
  check_bits<Batch>(humanoid(), smooth_effects(humanoid()));
}

TEST_CASE("a body whose mass is changed on the way moves as with a factor of that mass") {
  const auto run = [&](bool holds) {
    Batch batch(humanoid(), 5, {}, {}, {.hold_factors = holds});
    for (std::int64_t i = 0; i < batch.size(); ++i) start(batch, i, i, 0.3);
    batch.step(150);
    for (const Index slot : {3, 9}) batch.set_mass(2, slot, 20);
    batch.step(50);
    CHECK(batch.summary().rescued == 0);
    return batch;
  };
  const Batch held = run(true), fresh = run(false);
  for (Index row = 0; row < held.positions().rows(); ++row) CHECK(held.positions()(2, row) == Approx(fresh.positions()(2, row)).margin(1e-7));
}

TEST_CASE("a batch that holds no factors keeps less of its instances") {
  const Batch held(humanoid(), 64), fresh(humanoid(), 64, {}, {}, {.hold_factors = false});
  const Shape& shape = held.model().tree.shape;
  CHECK(held.bytes() - fresh.bytes() == 64 * 4 * static_cast<std::size_t>(12 * (shape.velocities - 6) + shape.blocks) + 64 * 4 * sizeof(double));
}

}  // namespace
}  // namespace linden::batch_factor_test
