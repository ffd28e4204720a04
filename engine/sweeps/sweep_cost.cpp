#include "engine/sweeps/sweep_cost.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "engine/effects/effect_plan.hpp"
#include "engine/guess/first_guess.hpp"
#include "engine/solve/stepper.hpp"
#include "engine/sweeps/tree_sweeps.hpp"
#include "kernels/tree/advance_map.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/residual_up.hpp"

namespace linden {
namespace {

constexpr int kSteps = 20;  // taken before anything is measured
constexpr int kRounds = 5;
constexpr double kSeconds = 1e-3;  // of calls of one sweep, a round

using Clock = std::chrono::steady_clock;
using Call = std::function<void()>;

/// Least seconds per call, over rounds.
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

/// The memory of a step, and each of its sweeps by name.
template <bool kEffects>
class Bench {
 public:
  Bench(const Model& model, const Options& options, const EffectPlan& plan, const InitialState& start)
      : model_(model), options_(options), stepper_(make_stepper(model, options, plan)), sweeps_(model, options, plan), work_(sweeps_.work()) {
    state_.allocate(model.tree.shape);
    const std::vector<double> neutral = model.neutral();
    std::ranges::copy(start.positions.empty() ? neutral : start.positions, state_.q.flat().begin());
    stepper_->refresh(state_);
    if (!start.velocities.empty()) {
      Field<double> v;
      v.allocate(model.tree.shape.velocities);
      std::ranges::copy(start.velocities, v.flat().begin());
      stepper_->momentum_of(v, state_.p);
    }
    for (int k = 0; k < kSteps && stepper_->step(state_, history_, k * options.step, options.step, Then::stop).ok(); ++k) {
    }
    impulse_.allocate(model.tree.shape.slots);
    rate_.allocate(model.tree.shape.velocities);
    q_ = state_.q;
    p_ = state_.p;
    begin_step();
    list();
  }

  /// NaN where there is no such sweep.
  double seconds(const std::string& name) {
    const auto found = calls_.find(name);
    if (found == calls_.end()) return std::numeric_limits<double>::quiet_NaN();
    return std::max(0.0, seconds_per_call(found->second.call) -
                             (found->second.restores ? seconds_per_call([this] { work_.impulse = impulse_; }) : 0));
  }

 private:
  struct Measured {
    Call call;
    bool restores;  // the impulses, which the sweep changes where they are
  };

  void begin_step() {
    StepReport report;
    sweeps_.refresh(state_.q);
    momentum_target_map(model_.tree, options_.step, state_.p, work_.force, work_.momentum_target);
    first_guess(options_.guess, model_, state_, history_, options_.step, sweeps_);
    if constexpr (kEffects) {
      auto& effects = sweeps_.effects();
      if (effects.plan().joints) std::ranges::copy(work_.momentum_target.flat(), effects.plain_target().flat().begin());
      for (Index row = 0; row < rate_.rows(); ++row) rate_(row) = state_.history(row, 0);
      effects.begin({0.0}, options_.step, state_.q, rate_, history_ > 0, false, work_.delta);
      sweeps_.begin(0);
    }
    sweeps_.evaluate(Factor::fresh, report);
    momentum_map(model_.tree, model_.constants, work_.displacement, impulse_);  // as it was before it was summed over the subtrees
  }

  void list() {
    const Tree& tree = model_.tree;
    const auto& constants = model_.constants;
    const double h = options_.step;
    const Vec3<double> g{options_.gravity[0], options_.gravity[1], options_.gravity[2]};
    const Gains<double> gains{work_.gain_up, work_.gain_down, work_.joint_inverse};
    Workspace<double>& w = work_;
    const auto add = [&](std::string name, Call call, bool restores = false) {
      calls_.emplace(std::move(name), Measured{std::move(call), restores});
    };
    add("momentum_target_map", [&, h] { momentum_target_map(tree, h, p_, w.force, w.momentum_target); });
    for (const char* name : {"first guess: extrapolation", "first guess: ig1", "first guess: ig2"}) {
      add(name, [&, h] { first_guess(options_.guess, model_, state_, history_, h, sweeps_); });
    }
    add("motion_map", [&] { motion_map(tree, constants, w.delta, w.motion); });
    add("displacement_down", [&] { displacement_down(tree, w.placement, w.motion, w.displacement); });
    add("momentum_map", [&] { momentum_map(tree, constants, w.displacement, w.impulse); });
    add("residual_up", [&] {
      w.impulse = impulse_;
      residual_up(tree, constants, w.placement, w.momentum_target, w.impulse, w.residual);
    }, true);
    add("newton_factor_up", [&, gains] { newton_factor_up(tree, constants, w.placement, w.motion, w.displacement, w.articulated, gains); });
    add("articulated_inertia_up", [&, gains] { articulated_inertia_up(tree, constants, w.placement, w.articulated, gains); });
    add("impulse_pass_up", [&, gains] { impulse_pass_up(tree, constants, w.placement, gains, w.residual, w.bias, w.innovation); });
    add("innovation_up", [&] {
      w.impulse = impulse_;
      innovation_up(tree, constants, w);
    }, true);
    add("increment_down", [&, gains] {
      increment_down(tree, constants, w.placement, w.motion, gains, w.innovation, w.variation, w.increment);
    });
    add("rate_down", [&, gains] { rate_down(tree, constants, w.placement, gains, w.innovation, w.variation, w.increment); });
    // a correction by nothing, so that motion and displacement stay those of the step
    add("correct_motion_map", [&] { correct_motion_map(tree, constants, w.increment, 0.0, w.delta, w.motion); });
    add("displacement_map", [&] { displacement_map(tree, w.motion, w.delta); });
    add("advance_map", [&] {
      advance_map(tree, w.motion, w.delta, q_);
    });
    add("placement_map", [&] { placement_map(tree, constants, state_.q, w.placement); });
    add("gravity_field_down", [&, g] { gravity_field_down(tree, w.placement, g, w.field); });
    add("gravity_force_up", [&] { gravity_force_up(tree, constants, w.placement, w.field, w.first_moment, w.force); });
    add("momentum_update_map", [&, h] {
      momentum_update_map(tree, constants, h, w.displacement, impulse_, sweeps_.joint_residual(), w.force, p_);
    });
    add("fold_mimics", [&] { fold_mimics(sweeps_.mimics(), p_); });
    if constexpr (kEffects) {
      sweeps_.effects().each_kernel(constants, w, rate_, [&](std::string_view name, Call call) { add(std::string(name), std::move(call)); });
    }
  }

  const Model& model_;
  Options options_;
  std::unique_ptr<Stepper> stepper_;
  TreeSweeps<kEffects> sweeps_;
  Workspace<double>& work_;
  State<double> state_;
  int history_ = 0;
  Field<double, 6> impulse_;      // h mu of the step's evaluation
  Field<double> q_, p_, rate_;    // for results that nobody reads
  std::map<std::string, Measured> calls_;
};

template <bool kEffects>
std::vector<double> costs_of(const Model& model, const Options& options, const EffectPlan& plan, const InitialState& start,
                             const std::vector<Sweep>& sweeps) {
  Bench<kEffects> bench(model, options, plan, start);
  std::vector<double> costs;
  for (const Sweep& sweep : sweeps) costs.push_back(1e9 * bench.seconds(std::string(sweep.name)) / model.tree.bodies());
  return costs;
}

}  // namespace

std::vector<double> sweep_costs(const Model& model, const Options& options, const EffectPlan& plan, const InitialState& start,
                                const std::vector<Sweep>& sweeps) {
  return with_or_without(plan, [&](auto effects) { return costs_of<effects>(model, options, plan, start, sweeps); });
}

}  // namespace linden
