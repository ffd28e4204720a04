// The same scene must be the same to the bit however it is run.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "engine/batch.hpp"
#include "engine/queries/observations.hpp"
#include "engine/scene/scene_bytes.hpp"
#include "families.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/random.hpp"
#include "tests/scratch_folder.hpp"

namespace linden {
namespace {

constexpr std::int64_t kSteps = 40;
constexpr std::uint64_t kHere = 0;  // company of this number is the scene itself

/// A start like the scene's.
InitialState company(const EverydayScene& scene, std::uint64_t number) {
  if (number == kHere) return scene.start;
  try {
    return random_around(*scene.model, scene.start, scene.number * 64 + number, 0.2, scene.effects);
  } catch (const InputError&) {
    return scene.start;  // a mechanism that cannot be closed near there
  }
}

/// All that is to be told of an instance.
struct Told {
  std::vector<double> q, p, v, energy;
  InstanceRecord record;

  /// What differs first; empty: nothing.
  std::string differs(const Told& other) const {
    const auto same = [](const std::vector<double>& a, const std::vector<double>& b) {
      return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
    };
    if (!same(q, other.q)) return "positions";
    if (!same(p, other.p)) return "momenta";
    if (!same(v, other.v)) return "velocities";
    if (!same(energy, other.energy)) return "energies";
    return record == other.record ? "" : "records";
  }
};

std::vector<double> numbers(const auto& rows) { return {rows.begin(), rows.end()}; }

std::vector<Told> told(const Batch& batch) {
  const Batch::Observation observed = batch.observe();
  std::vector<Told> result;
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    result.push_back({numbers(batch.positions().instance(i)), numbers(batch.momenta().instance(i)),
                      numbers(observed.velocities().instance(i)), numbers(observed.energies().instance(i)), batch.record(i)});
  }
  return result;
}

Batch batch_of(const EverydayScene& scene, const std::vector<std::uint64_t>& who, int threads, bool own_gravity = false) {
  Options options = scene.options;
  if (own_gravity) options.gravity = {3, -2, 1};
  Batch batch(scene.model, static_cast<std::int64_t>(who.size()), options, scene.effects, {.threads = threads});
  for (std::int64_t i = 0; own_gravity && i < batch.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) batch.gravity()(i, static_cast<Index>(k)) = scene.options.gravity[k];
  }
  for (std::size_t i = 0; i < who.size(); ++i) {
    const InitialState start = company(scene, who[i]);
    batch.reset(static_cast<std::int64_t>(i), start.positions, start.velocities);
  }
  return batch;
}

void compare(const std::vector<Told>& a, const std::vector<Told>& b, const char* what, Differences& found) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::string differs = a[i].differs(b[i]);
    if (differs.empty()) continue;
    found.add(Check::bits, what, fmt::format("{}: {} of instance {} differ; expected the same bytes", what, differs, i));
    return;
  }
}

void check_batches(const EverydayScene& scene, Differences& found) {
  const std::vector<std::uint64_t> all{1, 2, 3, kHere, 4, 5, 6, 7, 8};
  Batch one = batch_of(scene, all, 1);
  one.step(kSteps);
  const std::vector<Told> expected = told(one);

  Batch two = batch_of(scene, all, 2);
  two.step(kSteps);
  compare(expected, told(two), "two threads", found);

  Batch split = batch_of(scene, all, 1);
  for (std::int64_t k = 0; k < kSteps; ++k) split.step(1);
  compare(expected, told(split), "steps one by one", found);

  Batch both = batch_of(scene, all, 2);
  const Observations looks(*scene.model, scene.effects, {"q", "v", "p", "energy", "com_velocity"});
  std::vector<double> given(all.size() * static_cast<std::size_t>(looks.width())), asked(given.size());
  for (std::int64_t k = 0; k < kSteps; k += 5) both.step(5, {.observations = &looks, .observed = std::span(given)});
  compare(expected, told(both), "two threads, five steps at a time", found);
  both.observe(looks, asked);
  if (std::memcmp(given.data(), asked.data(), given.size() * sizeof(double)) != 0) {
    found.add(Check::bits, "observations of a step", "observations given out by a step and those asked for after it differ; expected the same bytes");
  }

  Batch half = batch_of(scene, all, 2);
  half.step(kSteps / 2);
  Batch resumed(scene.model, half.size(), scene.options, scene.effects, {.threads = 1});
  resumed.restore(half.checkpoint());
  resumed.step(kSteps - kSteps / 2);
  compare(expected, told(resumed), "a batch from a checkpoint", found);

  Batch weighed = batch_of(scene, all, 1, true);
  weighed.step(kSteps);
  // where gravity is zero its potential may be -0
  const auto with_plain_zeros = [](std::vector<Told> instances) {
    for (Told& instance : instances) {
      for (double& number : instance.energy) number += 0.0;
    }
    return instances;
  };
  compare(with_plain_zeros(expected), with_plain_zeros(told(weighed)), "the same gravity given to each instance", found);

  Batch other = batch_of(scene, {9, 10, kHere, 11, 12, 13, kHere}, 1);
  other.step(kSteps / 2);
  other.step(kSteps - kSteps / 2);
  const std::vector<Told> others = told(other);
  compare({expected[3], expected[3]}, {others[2], others[6]}, "other company and place", found);

  for (std::size_t i = 0; i < all.size(); ++i) {
    const InitialState start = company(scene, all[i]);
    one.reset(static_cast<std::int64_t>(i), start.positions, start.velocities);
  }
  one.step(kSteps);
  compare(expected, told(one), "after a reset", found);
}

Told told(Simulation& simulation) {
  const Energy energy = simulation.energy();
  const EffectWork& work = simulation.effect_work();
  return {numbers(simulation.positions()), numbers(simulation.momenta()), simulation.velocities(),
          {energy.kinetic, energy.potential, work.taken(), work.given()}, {}};
}

void check_simulations(const EverydayScene& scene, Differences& found) {
  const std::int64_t half = kSteps / 2;
  Simulation whole = simulation_of(scene, scene.options.step), single = simulation_of(scene, scene.options.step);
  const Scene same{.model = *scene.model, .options = scene.options, .initial = {}, .effects = scene.effects, .start_as_given = true};
  Simulation resumed(scene_from_bytes(to_bytes(same)));
  whole.run(kSteps);
  const ScratchFolder folder;
  for (std::int64_t k = 0; k < kSteps; ++k) {
    if (k == half) {
      single.save(folder.file("half.ckpt"));
      resumed.load(folder.file("half.ckpt"));
    }
    if (!single.step().ok()) return;  // the rest is refused anyhow
    if (k >= half && !resumed.step().ok()) break;
  }
  const Told expected = told(single);
  compare({expected}, {told(whole)}, "run(n) and n times step()", found);
  compare({expected}, {told(resumed)}, "from a checkpoint, with the scene from bytes", found);
}

}  // namespace

void check_bits(const EverydayScene& scene, Differences& found) {
  if (!scene.effects.contact) check_batches(scene, found);
  check_simulations(scene, found);
}

}  // namespace linden
