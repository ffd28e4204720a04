// Bodies that touch each other in a batch: each instance moves as alone, whatever its neighbours do.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"

namespace linden::contact_batch_test {
namespace {

Scene crates() { return load_scene(LINDEN_MODELS_DIR "/scenes/crates.yaml"); }

/// The one above begins higher in each instance: some strike in the run, some do not.
std::vector<double> start_of(const Scene& scene, std::int64_t i) {
  std::vector<double> q = scene.initial.positions;
  q[9] += 0.004 * static_cast<double>(i * i);
  return q;
}

Batch started(const Scene& scene, std::int64_t size, const BatchOptions& computed) {
  Batch batch(scene, size, computed);
  for (std::int64_t i = 0; i < size; ++i) batch.reset(i, start_of(scene, i), scene.initial.velocities);
  return batch;
}

bool same(const Batch& a, std::int64_t i, const Batch& b, std::int64_t j) {
  return a.positions().instance(i) == b.positions().instance(j) && a.momenta().instance(i) == b.momenta().instance(j) && a.record(i) == b.record(j);
}

}  // namespace

TEST_CASE("crates in a batch fall on each other as alone and stay there", "[batch][contact]") {
  const Scene scene = crates();
  constexpr std::int64_t kSize = 11;
  Batch batch = started(scene, kSize, {.threads = 2});
  std::vector<Simulation> alone;
  for (std::int64_t i = 0; i < kSize; ++i) {
    Simulation& one = alone.emplace_back(scene);
    one.set_positions(start_of(scene, i));
    one.set_velocities(scene.initial.velocities);
  }
  const auto stray = [&](std::int64_t i) {
    double worst = 0;
    for (Index row = 0; row < batch.positions().rows(); ++row) {
      worst = std::max(worst, std::abs(batch.positions()(i, row) - alone[static_cast<std::size_t>(i)].positions()[static_cast<std::size_t>(row)]));
    }
    return worst;
  };
  batch.step(200);
  for (Simulation& one : alone) one.run(200);
  // that is a fall of 0.2 m: the first few have met, the last are far apart and went on together
  CHECK(batch.record(0).rescued > 100);
  CHECK(batch.record(kSize - 1).rescued == 0);
  for (std::int64_t i = 0; i < kSize; ++i) CHECK(stray(i) < 1e-8);
  batch.step(800);
  for (Simulation& one : alone) one.run(800);
  const Batch::Observation seen = batch.observe();
  for (std::int64_t i = 0; i < kSize; ++i) {
    INFO("instance " << i << ": " << batch.describe(i));
    CHECK(batch.record(i).steps == 1000);
    CHECK(stray(i) < 1e-6);
    const Energy energy = alone[static_cast<std::size_t>(i)].energy();
    CHECK(seen.energies()(i, 1) == Approx(energy.potential).epsilon(0).margin(1e-3));
  }
}

TEST_CASE("crates in a batch move the same to the bit in any company, on any threads, in any calls, and after a reset", "[batch][contact]") {
  const Scene scene = crates();
  constexpr std::int64_t kSize = 11;
  Batch batch = started(scene, kSize, {.threads = 2}), one_thread = started(scene, kSize, {.threads = 1});
  batch.step(300);
  for (int k = 0; k < 30; ++k) one_thread.step(10);
  for (std::int64_t i = 0; i < kSize; ++i) {
    CHECK(same(batch, i, one_thread, i));
    Batch alone(scene, 1, {.threads = 1});
    alone.reset(0, start_of(scene, i), scene.initial.velocities);
    alone.step(300);
    CHECK(same(batch, i, alone, 0));
  }
  // nothing is left of what lay on the other; neighbours feel none of it
  one_thread.reset(0, start_of(scene, 3), scene.initial.velocities);
  one_thread.step(300);
  CHECK(same(one_thread, 0, batch, 3));
  batch.step(300);
  for (std::int64_t i = 1; i < kSize; ++i) CHECK(same(batch, i, one_thread, i));
}

TEST_CASE("crates that lie on each other in a batch go on to the same bits from a checkpoint", "[batch][contact][checkpoint]") {
  const Scene scene = crates();
  Batch batch = started(scene, 5, {.threads = 2});
  batch.step(250);
  CHECK(batch.record(0).rescued > 100);
  const std::string saved = batch.checkpoint();
  Batch other(scene, 5, {.threads = 1});
  other.restore(saved);
  CHECK(other.checkpoint() == saved);
  batch.step(250);
  other.step(250);
  for (std::int64_t i = 0; i < 5; ++i) CHECK(same(batch, i, other, i));
  CHECK(other.checkpoint() == batch.checkpoint());
}

TEST_CASE("humanoids whose links can touch and do not take their steps together, as they do without contact", "[batch][contact]") {
  const std::string model = "model: " LINDEN_MODELS_DIR "/humanoid.urdf\nbase: floating\n", gravity = "effects: {gravity: [0, 0, -9.81]";
  const Scene with = parse_scene(model + gravity + ", contact: {}}\n", "with.yaml"), without = parse_scene(model + gravity + "}\n", "without.yaml");
  REQUIRE(with.effects.contact);
  REQUIRE(!with.effects.contact->pairs.empty());
  Batch batch(with, 9), free(without, 9);
  std::vector<double> v(with.initial.velocities.size(), 0.0);
  v[0] = 0.5;
  v.back() = 1;
  for (std::int64_t i = 0; i < 9; ++i) {
    batch.reset(i, with.initial.positions, v);
    free.reset(i, with.initial.positions, v);
  }
  batch.step(100);
  free.step(100);
  for (std::int64_t i = 0; i < 9; ++i) {
    CHECK(batch.record(i).rescued == 0);
    CHECK((batch.positions().instance(i) - free.positions().instance(i)).cwiseAbs().maxCoeff() < 1e-8);
  }
}

}  // namespace linden::contact_batch_test
