// bench/kernels.cpp
// Time of every sweep of a step, by its own name in the schedule (engine/sweeps/schedule.hpp), over chains of hinges and of ball joints and
// over binary trees.
//
//   build/release/bench/bench_kernels [--benchmark_filter=newton]
//
// First the sweeps run once in the order of a step, and the result is checked against a plain twin; only then are they timed, on the
// state of a moving system. Sweeps that sum in place (residual_up, innovation_up, ...) are timed with momentum_map, which fills their input.
#include <fmt/format.h>

#include <cstdio>
#include <set>
#include <string>

#include "bench/machine.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/initial_state.hpp"
#include "engine/solve/stepper.hpp"
#include "engine/sweeps/schedule.hpp"
#include "engine/sweeps/step_memory.hpp"
#include "models/build/generators.hpp"
#include "tests/reference/del_literal.hpp"
#include "tests/reference/dense_jacobian.hpp"

namespace linden {
namespace {

/// With these together every sweep is in some schedule.
const Options kOptions[] = {{.step = 1e-3},
                            {.step = 1e-3, .stop = StopTest::absolute},
                            {.step = 1e-3, .solver = Solver::riqn, .guess = FirstGuess::ig3}};

/// A moving system and the memory of its next step, evaluated sweep by sweep.
struct Rig {
  Model model;
  EffectPlan plan;
  StepMemory memory;
  std::vector<Sweep> sweeps;

  Rig(Model made, const Options& options)
      : model(std::move(made)), plan(model, options, {}), memory(model, options, plan), sweeps(schedule_of(model, options, plan)) {
    const InitialState start = random_state(model, 1, 0.1);
    State<double>& state = memory.state;
    std::ranges::copy(start.positions, state.q.flat().begin());
    Field<double> rate;
    rate.allocate(model.tree.shape.velocities);
    std::ranges::copy(start.velocities, rate.flat().begin());
    const std::unique_ptr<Stepper> stepper = make_stepper(model, options, plan);
    stepper->refresh(state);
    stepper->momentum_of(rate, state.p);
    memory.history = kHistory;
    state.last_step(0) = options.step;
    for (Index row = 0; row < rate.rows(); ++row) {
      for (int k = 0; k < kHistory; ++k) state.history(row, k) = options.step * rate(row);
    }
    run(sweeps, {When::arrival}, memory);
    memory.begin(0);
    run(sweeps, {When::first}, memory);
    memory.begin_evaluation(Factor::fresh);
    run(sweeps, {When::evaluation, When::factor}, memory);
    memory.share = 0;  // corrections by nothing: the state stays where it is
    run(sweeps, {When::correction}, memory);
  }

  const Sweep& named(const std::string& name) const { return *std::ranges::find(sweeps, name, &Sweep::name); }
};

/// The sweeps in the order of a step against the plain twin: residual by matrices, correction by a dense solve.
bool agrees_with_plain_twin(Model model) {
  Rig rig(std::move(model), kOptions[1]);
  const Workspace<double>& work = rig.memory.work;
  const auto flat = [](const Field<double>& field) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(field.flat().data(), field.rows()));
  };
  const Eigen::MatrixXd J = reference::dense_jacobian(rig.model, work.placement, work.motion);
  const Eigen::VectorXd expected = J.fullPivLu().solve(flat(work.residual));
  const double error = (flat(work.applied) - expected).norm() / expected.norm();
  if (error < 1e-9) return true;
  fmt::print(stderr, "{}: the correction differs from the dense solve by {:.2e}\n", rig.model.names.model, error);
  return false;
}

void register_one(const std::string& name, const std::string& shape, Model (*make)(Index), const Options& options, Index size) {
  benchmark::RegisterBenchmark(fmt::format("{}/{}:{}", name, shape, size).c_str(), [=](benchmark::State& state) {
    Rig rig(make(size), options);
    const Slots all = all_slots(rig.model.tree);
    const Sweep &momenta = rig.named("momentum_map"), &sweep = rig.named(name.substr(name.find('+') + 1));
    for (auto _ : state) {
      if (sweep.sums) momenta.run(rig.memory, all);
      sweep.run(rig.memory, all);
      benchmark::ClobberMemory();
    }
    per_body(state, size);
  });
}

void register_all(const char* shape, Model (*make)(Index), const std::vector<Index>& sizes) {
  std::set<std::string> known;
  for (const Options& options : kOptions) {
    const Rig rig(make(sizes.front()), options);
    for (const Sweep& sweep : rig.sweeps) {
      if (sweep.when == When::start || !known.insert(sweep.name).second) continue;
      for (const Index size : sizes) register_one((sweep.sums ? "momentum_map+" : "") + sweep.name, shape, make, options, size);
    }
  }
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  using namespace linden;
  const auto tree = [](Index bodies) { return balanced_tree(bodies); };
  if (!agrees_with_plain_twin(chain(12)) || !agrees_with_plain_twin(ball_chain(5)) || !agrees_with_plain_twin(tree(15))) return 1;
  register_all("chain", chain, {10, 100, 1000, 10000, 100000});
  register_all("ball-chain", ball_chain, {1000});
  register_all("tree", tree, {1023});
  describe_machine();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
