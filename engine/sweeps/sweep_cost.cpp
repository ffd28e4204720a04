#include "engine/sweeps/sweep_cost.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>

#include "engine/effects/effect_plan.hpp"
#include "engine/solve/stepper.hpp"
#include "engine/sweeps/step_memory.hpp"
#include "engine/sweeps/tree_kernels.hpp"

namespace linden {
namespace {

constexpr int kSteps = 20;  // taken before anything is measured
constexpr int kRounds = 5;
constexpr double kSeconds = 1e-3;  // of calls of one sweep, a round

using Clock = std::chrono::steady_clock;

/// Least seconds per call, over rounds.
template <class Call>
double seconds_per_call(const Call& call) {
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    const Clock::time_point begin = Clock::now();
    std::int64_t calls = 0;
    double taken = 0;
    for (std::int64_t more = 1; taken < kSeconds; more *= 2) {
      for (std::int64_t k = 0; k < more; ++k) call();
      calls += more;
      taken = std::chrono::duration<double>(Clock::now() - begin).count();
    }
    least = std::min(least, taken / static_cast<double>(calls));
  }
  return least;
}

/// The memory of a step that has been evaluated.
class Bench {
 public:
  Bench(const Model& model, const Options& options, const EffectPlan& plan, const InitialState& start, const std::vector<Sweep>& sweeps)
      : memory_(model, options, plan), all_(all_slots(model.tree)) {
    move(start);
    run(sweeps, {When::arrival}, memory_);
    memory_.begin(0);
    if (memory_.history > 0) {
      run(sweeps, {When::first}, memory_);
    } else {
      run(sweeps, {When::first, When::start}, memory_);
    }
    memory_.begin_evaluation(Factor::fresh);
    run(sweeps, {When::evaluation, When::factor}, memory_);
    memory_.finds_end_momenta = memory_.strategy.finds_end_momenta();
    memory_.update = {.near = true, .solved = true, .late = false, .last = false};
    memory_.share = 0;  // corrections by nothing, so that motion and displacement stay those of the step
    state_ = memory_.state;
    work_ = memory_.work;
    momentum_map(model.tree, memory_.constants, work_.displacement, all_, memory_.work.impulse);
    impulse_ = memory_.work.impulse;
  }

  double seconds(const Sweep& sweep) {
    memory_.state = state_;
    memory_.work = work_;
    const double restoring = sweep.sums ? seconds_per_call([this] { memory_.work.impulse = impulse_; }) : 0;
    const double both = seconds_per_call([&] {
      if (sweep.sums) memory_.work.impulse = impulse_;
      sweep.run(memory_, all_);
    });
    return std::max(0.0, both - restoring);
  }

 private:
  /// Some steps from where the motion begins.
  void move(const InitialState& start) {
    const Model& model = memory_.model;
    State<double>& state = memory_.state;
    const std::unique_ptr<Stepper> stepper = make_stepper(model, memory_.options, memory_.plan);
    std::ranges::copy(start.positions.empty() ? model.neutral() : start.positions, state.q.flat().begin());
    stepper->refresh(state);
    if (!start.velocities.empty()) {
      Field<double> v;
      v.allocate(model.tree.shape.velocities);
      std::ranges::copy(start.velocities, v.flat().begin());
      stepper->momentum_of(v, state.p);
    }
    const double h = memory_.options.step;
    for (int k = 0; k < kSteps && stepper->step(state, memory_.history, k * h, h, Then::stop).ok(); ++k) {
    }
  }

  StepMemory memory_;
  Slots all_;
  State<double> state_;       // of the step's evaluation
  Workspace<double> work_;    // likewise
  Field<double, 6> impulse_;  // h mu of its bodies, which sweeps sum up
};

}  // namespace

std::vector<double> sweep_costs(const Model& model, const Options& options, const EffectPlan& plan, const InitialState& start,
                                const std::vector<Sweep>& sweeps) {
  Bench bench(model, options, plan, start, sweeps);
  std::vector<double> costs;
  for (const Sweep& sweep : sweeps) costs.push_back(1e9 * bench.seconds(sweep) / model.tree.bodies());
  return costs;
}

}  // namespace linden
