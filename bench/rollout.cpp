// bench/rollout.cpp
// Throughput of batches: over batch size, threads, lanes and precision; and where the time of a step goes.
//
//   build/release/bench/bench_rollout [--benchmark_filter=g1]
//
// items_per_second are env-steps per second; per_body is time a body, step and instance on one thread. Every scene is run for a while
// before it is timed: one that loses an instance or energy is not timed.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "bench/machine.hpp"
#include "engine/batch.hpp"
#include "engine/initial_state.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

namespace linden {
namespace {

constexpr std::int64_t kStepsAtOnce = 20, kEpisode = 2000;

template <class Real>
void rollout(benchmark::State& state, const std::shared_ptr<const Model>& model, std::int64_t size, const BatchOptions& options) {
  BatchOf<Real> batch(model, size, {}, {}, options);
  const auto start_all = [&] {
    batch.reset_all([&](std::int64_t i, std::span<double> positions, std::span<double> velocities) {
      const InitialState start = random_state(*model, static_cast<std::uint64_t>(i) + 1, 0.3);
      std::ranges::copy(start.positions, positions.begin());
      std::ranges::copy(start.velocities, velocities.begin());
    });
  };
  start_all();
  const auto before = batch.observe();
  batch.step(kStepsAtOnce);
  const auto after = batch.observe();
  double change = 0;
  for (std::int64_t i = 0; i < size; ++i) {
    const auto total = [&](const auto& seen) { return static_cast<double>(seen.energies()(i, 0)) + static_cast<double>(seen.energies()(i, 1)); };
    change = std::max(change, std::abs(total(after) - total(before)) / static_cast<double>(after.energies()(i, 0)));
  }
  if (batch.summary().frozen > 0 || !(change < (sizeof(Real) == sizeof(float) ? 1e-2 : 1e-3))) return state.SkipWithError("an instance failed or energy is not kept");
  double steps = 0;
  std::int64_t episode = kStepsAtOnce;
  for (auto _ : state) {
    if (episode >= kEpisode) {
      // robots that have fallen for a minute are no robots any more
      state.PauseTiming();
      start_all();
      episode = 0;
      state.ResumeTiming();
    }
    batch.step(kStepsAtOnce);
    episode += kStepsAtOnce;
    steps += static_cast<double>(size * kStepsAtOnce);
  }
  const BatchSummary end = batch.summary();
  if (end.frozen > 0) return state.SkipWithError("an instance failed");
  const double evaluations = static_cast<double>(end.evaluations) / static_cast<double>(end.steps);
  state.SetItemsProcessed(static_cast<std::int64_t>(steps));
  state.counters["evaluations"] = evaluations;  // of the last episode
  state.counters["lanes"] = batch.lanes();
  state.counters["per_body"] =
      benchmark::Counter(steps * model->tree.bodies() / batch.threads(), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void add(const std::string& scene, const std::shared_ptr<const Model>& model, std::int64_t size, int threads,
         std::optional<Instructions> instructions, bool single) {
  if (instructions && !available(*instructions)) return;
  const BatchOptions options{.threads = threads, .instructions = instructions};
  const std::string name = fmt::format("{}/{}/threads:{}/{}/{}", scene, size, threads,
                                       linden::name(instructions.value_or(best_instructions())), single ? "float" : "double");
  const auto run = [=](benchmark::State& state) {
    single ? rollout<float>(state, model, size, options) : rollout<double>(state, model, size, options);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->UseRealTime()->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  using namespace linden;
  const auto shared = [](Model model) { return std::make_shared<const Model>(std::move(model)); };
  std::vector<std::pair<std::string, std::shared_ptr<const Model>>> robots{
      {"humanoid", shared(load_urdf(LINDEN_MODELS_DIR "/humanoid.urdf", Base::floating))}};
  if (const char* g1 = LINDEN_ROBOTS_DIR "/g1_29dof.urdf"; std::filesystem::exists(g1)) {
    robots.emplace_back("g1", shared(load_urdf(g1, Base::floating)));
  }
  for (const auto& [name, model] : robots) {
    for (const bool single : {false, true}) {
      // threads at the size that peers are measured at, lanes at a larger one, then sizes
      for (const int threads : {1, 2}) add(name, model, 1024, threads, {}, single);
      for (const Instructions instructions : {Instructions::scalar, Instructions::baseline, Instructions::avx2, Instructions::avx512}) {
        add(name, model, 4096, 1, instructions, single);
      }
      add(name, model, 4096, 2, {}, single);
      for (const std::int64_t size : {16, 128, 16384}) add(name, model, size, 2, {}, single);
    }
  }
  for (const bool single : {false, true}) {
    add("chain:10", shared(chain(10)), 1024, 2, {}, single);
    add("chain:100", shared(chain(100)), 128, 2, {}, single);
  }
  describe_machine();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
