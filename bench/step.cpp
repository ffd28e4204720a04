// bench/step.cpp
// Time of a whole step, converged to the default tolerance: chains and trees of any size, robots, both solvers; mechanisms with loops, and the
// same cut open.
//
//   build/release/bench/bench_step [--benchmark_filter=chain]
//
// Before timing, each scene is run for a while and its energy checked; a scene that loses it is not timed.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "bench/machine.hpp"
#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/linkage_humanoid.hpp"

namespace linden {
namespace {

constexpr std::int64_t kTogether = 10;
constexpr std::int64_t kEpisode = 1000;  // steps from the random start, then from there again

void step(benchmark::State& state, const Model& model, Solver solver, double length = 1e-3) {
  Simulation simulation(model, {.step = length, .solver = solver});
  const InitialState start = random_state(model, 1, 0.1);
  simulation.set_positions(start.positions);
  simulation.set_velocities(start.velocities);
  const Energy before = simulation.energy();
  const auto go_on = [&] {
    const StepsReport report = simulation.run(kTogether);
    if (!report.ok()) state.SkipWithError(simulation.describe(report.last).c_str());
    return report;
  };
  if (!go_on().ok()) return;
  const Energy after = simulation.energy();
  if (!(std::abs(after.total() - before.total()) < 1e-3 * (before.kinetic + after.kinetic))) {
    return state.SkipWithError("energy is not kept");
  }
  StepsReport taken;
  std::int64_t since_start = kTogether;
  while (state.KeepRunningBatch(kTogether)) {
    if (since_start == kEpisode) {
      // every table shows the same motion, however long its rows are timed
      state.PauseTiming();
      simulation.set_positions(start.positions);
      simulation.set_velocities(start.velocities);
      since_start = 0;
      state.ResumeTiming();
    }
    taken.add(go_on());
    if (!taken.ok()) return;
    since_start += kTogether;
  }
  state.counters["iterations"] = static_cast<double>(taken.iterations) / static_cast<double>(taken.steps);
  state.counters["evaluations"] = static_cast<double>(taken.evaluations) / static_cast<double>(taken.steps);
  per_body(state, model.tree.bodies());
}

void add(const std::string& name, const std::function<Model()>& make) {
  for (const Solver solver : {Solver::newton, Solver::riqn}) {
    benchmark::RegisterBenchmark(fmt::format("{}/{}", name, linden::name(solver)).c_str(),
                                 [=](benchmark::State& state) { step(state, make(), solver); });
  }
}

/// A mechanism as it is, and without its couplings, in steps of this length [s].
void add_closed_and_open(const std::string& name, const std::function<Model()>& make, double length = 1e-3) {
  const auto open = [make] {
    Model model = make();
    model.couplings.clear();
    return model;
  };
  benchmark::RegisterBenchmark((name + "/closed").c_str(), [=](benchmark::State& state) { step(state, make(), Solver::newton, length); });
  benchmark::RegisterBenchmark((name + "/open").c_str(), [=](benchmark::State& state) { step(state, open(), Solver::newton, length); });
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  using namespace linden;
  for (const Index size : {10, 100, 1000, 10000, 100000}) add(fmt::format("chain:{}", size), [=] { return chain(size); });
  for (const Index size : {1023, 65535}) add(fmt::format("tree:{}", size), [=] { return balanced_tree(size); });
  add("ball-chain:100", [] { return ball_chain(100); });
  for (const char* robot : {LINDEN_MODELS_DIR "/humanoid.urdf", LINDEN_ROBOTS_DIR "/g1_29dof.urdf", LINDEN_ROBOTS_DIR "/talos.urdf"}) {
    if (!std::filesystem::exists(robot)) continue;
    add(std::filesystem::path(robot).stem().string(), [=] { return load_urdf(robot, Base::floating); });
  }
  for (const char* mechanism : {"ladder:10", "ladder:100", "ladder:1000", "ladder:3000", "fourbars:50", "ring:100"}) {
    add_closed_and_open(mechanism, [=] { return generate(mechanism); });
  }
  for (const Index links : {100, 1000}) {
    // of 12.7 mm, too short for a millisecond
    add_closed_and_open(fmt::format("roller-chain:{}", links), [=] { return roller_chain(links); }, 1e-4);
  }
  add_closed_and_open("humanoid_with_six_four-bars", [] { return linkage_humanoid(Base::floating); });
  for (const char* mechanism : {"gripper", "leg", "stewart"}) {
    add_closed_and_open(mechanism, [=] { return load_urdf(fmt::format(LINDEN_MODELS_DIR "/{}.urdf", mechanism), Base::fixed); });
  }
  describe_machine();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
