// tests/engine/schedule_stepper.hpp
// Steps of one tree by its schedule and by nothing else: every array that it changes is changed by a sweep of the list. What happens after
// an evaluation is decided as everywhere, by solve.hpp; a step that is not plain (schedule.hpp) fails the test.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>

#include "engine/solve/held_factor.hpp"
#include "engine/solve/solve.hpp"
#include "engine/sweeps/down_and_up.hpp"
#include "engine/sweeps/schedule.hpp"
#include "engine/sweeps/step_memory.hpp"
#include "kernels/tree/rounding_floor_map.hpp"

namespace linden {

class ScheduleStepper {
 public:
  using Number = double;
  static constexpr bool kAlone = true;

  ScheduleStepper(const Model& model, const Options& options, const EffectPlan& plan)
      : memory(model, options, plan), list_(schedule_of(model, options, plan)), tree_(model.tree) {
    policy_ = {.most_corrections = options.solver == Solver::newton ? 50 : 1000, .most_cuts = 10};
    policy_.refactors = options.solver == Solver::newton;
  }

  void start(std::span<const double> positions, std::span<const double> momenta) {
    std::ranges::copy(positions, memory.state.q.flat().begin());
    std::ranges::copy(momenta, memory.state.p.flat().begin());
    run({When::arrival});
  }

  void step(double time) {
    const bool known = memory.history > 0;
    const Options& options = memory.options;
    memory.begin(time);
    if (begins) begins(time);
    if (known) {
      run({When::first});
    } else {
      run({When::first, When::start});
    }
    fresh_ = !(known && memory.strategy.reuses_factor && held_.serves(options.tolerance, held_.age()));
    evaluations = corrections = factorisations = 0;
    evaluate(fresh_ ? Factor::fresh : Factor::kept);
    held_.begin(std::sqrt(0.5 * memory.now.norm / memory.now.scale), fresh_);
    Solve solve(*this, policy_);
    const Solved<double> solved = solve.run(1, memory.now, fresh_ ? 1 : 0);
    REQUIRE(solved.done == 1);
    held_.end(std::sqrt(0.5 * solve.now().norm / solve.now().scale), solve.seen().at_floor, factorisations > 0);
    run({When::last, When::arrival});
    memory.end();
  }

  // what solve.hpp asks
  Evaluated<double> evaluate(Lanes, Lanes corrected, int) {
    if (corrected == 0) return evaluate(Factor::fresh);
    corrections += 1;
    last_branch_first_ = false;  // a correction begins where the pass before it ended
    run({When::correction});
    const Evaluated<double> now = evaluate(Factor::kept);
    last_branch_first_ = true;
    return now;
  }
  Lanes converged(const Evaluated<double>& now) const {
    const Options& options = memory.options;
    if (options.stop == StopTest::absolute) return std::sqrt(now.plain) <= options.tolerance * options.step ? 1 : 0;
    const bool closed = memory.couplings.empty() || memory.couplings.widest_pushed_gap() <= options.tolerance;
    return closed && within(now.norm, options.tolerance * options.tolerance, now.scale) ? 1 : 0;
  }
  Lanes close(const Evaluated<double>& now) const {
    const double tolerance = kNearTolerance * memory.options.tolerance;
    return now.norm <= tolerance * tolerance * now.scale ? 1 : 0;
  }
  Lanes at_floor(const Evaluated<double>& now, double epsilons) {
    REQUIRE_FALSE(memory.strategy.shares_rows);  // there all bodies would be evaluated once more for this
    const double of_gaps = memory.couplings.rounding();
    if (!memory.couplings.empty() && is_rounding(now.norm, of_gaps, epsilons)) return 1;
    if (!below_ceiling(now.norm, now.energy, fall())) return 0;
    const Field<double>& inverse = memory.work.joint_inverse;
    const Field<double>& yields = memory.ties.empty() ? inverse : memory.ties.yields(inverse);
    const double sum = rounding_floor_map(memory.model.tree, memory.constants, memory.work.momentum_target, memory.work.impulse, yields);
    return is_rounding(now.norm, sum + of_gaps, epsilons) ? 1 : 0;
  }
  bool has_states() const { return memory.plan.has_states; }
  Lanes update_states(const StateUpdate<bool>& update) {
    REQUIRE_FALSE(update.late);
    memory.update = update;
    memory.changed = false;
    run({When::states});
    if (!memory.changed) return 0;
    run({When::changed});
    corrections += 1;  // as it is reported
    return 1;
  }
  void first_correction(double norm, double before, bool at_floor) {
    if (!fresh_) held_.corrected(std::sqrt(norm / before), at_floor);
  }
  bool stale(const Evaluated<double>& now, double before) const {
    return !fresh_ && 0.5 * now.norm * (now.norm / before) > memory.options.tolerance * memory.options.tolerance * now.scale;
  }
  Lanes refused(Lanes, const Evaluated<double>&) const { return 0; }
  void put_aside(Lanes, Lanes, Lanes) {}
  Evaluated<double> cut(double share) {
    memory.share = -share;
    cuts_ = true;
    run({When::correction});
    cuts_ = false;
    memory.share = 1;
    return evaluate(Factor::kept);
  }
  Evaluated<double> take_back(double share) { return cut(share); }
  void refactor(Evaluated<double>& now) {
    REQUIRE_FALSE(memory.strategy.shares_rows);  // what rows hold is not what is factored there
    refactors_ = true;
    const Evaluated<double> again = evaluate(Factor::fresh);
    refactors_ = false;
    evaluations -= 1;  // of the residual there is
    now.norm = again.norm;
  }
  void continuation(Evaluated<double>& now, bool) { now = not_plain(); }
  void give_up(const Seen&) { not_plain(); }

  StepMemory memory;
  std::function<void(double time)> begins;             // told when a step begins
  std::function<void(const Sweep&, Slots)> call;       // calls a sweep; empty: simply
  int evaluations = 0, corrections = 0, factorisations = 0;  // of the step taken last

 private:
  /// The sweeps of these phases, in order.
  void run(std::initializer_list<When> phases) {
    const Slots all = all_slots(memory.model.tree);
    for (const Sweep& sweep : list_) {
      if (std::ranges::find(phases, sweep.when) == phases.end()) continue;
      if (refactors_ && (sweep.name == "displacement_down" || sweep.name == "couplings: take multipliers")) continue;  // they are there
      if (cuts_ && sweep.name != "correct_motion_map") continue;              // the correction is there
      if (call) {
        call(sweep, all);
      } else if (memory.strategy.order == Order::whole) {
        sweep.run(memory, all);
      } else {
        run_in_parts(sweep);
      }
    }
  }
  /// As a large tree is gone through, with one thread.
  void run_in_parts(const Sweep& sweep) {
    const Slots all = all_slots(memory.model.tree);
    const auto part_of = [&](Slots part, Evaluated<double>& sum) {
      std::swap(memory.now, sum);
      sweep.run(memory, part);
      std::swap(memory.now, sum);
    };
    const auto nothing = [](Slots, Evaluated<double>&) {};
    const bool moves = sweep.when == When::arrival || sweep.when == When::last;
    const bool along = refactors_ || (memory.strategy.order == Order::long_chain && !moves);
    if (sweep.way == Way::whole || (refactors_ && sweep.way != Way::up)) return sweep.run(memory, all);
    Evaluated<double> sum;
    switch (sweep.way) {
      case Way::whole: break;
      case Way::parents_up:
        in_parts_up(all, [&](Slots part) {
          part_of({std::max(all.begin, part.begin - 1), part.end == all.end ? part.end : part.end - 1}, sum);
        });
        break;
      case Way::down:
        if (along) {
          in_parts_down(all, [&](Slots part) { part_of(part, sum); });
        } else {
          sum = one_thread_.execute([&] { return tree_.run(last_branch_first_, false, part_of, nothing); });
        }
        break;
      case Way::up:
        if (along) {
          in_parts_up(all, [&](Slots part) { part_of(part, sum); });
        } else {
          sum = one_thread_.execute([&] { return tree_.run(last_branch_first_, false, nothing, part_of); });
        }
        break;
    }
    memory.now.add(sum);
  }
  Evaluated<double> evaluate(Factor factor) {
    memory.begin_evaluation(factor);
    if (factor == Factor::fresh) {
      run({When::evaluation, When::factor});
    } else {
      run({When::evaluation});
    }
    evaluations += 1;
    factorisations += factor == Factor::fresh ? 1 : 0;
    memory.is_first = false;
    memory.now.scale = memory.now.energy + (memory.plan.any() ? fall() : 0);
    return memory.now;
  }
  double fall() const { return fall_per_mass(memory.options.gravity, memory.options.step) * memory.constants.subtree_mass(0); }
  Evaluated<double> not_plain() {
    FAIL("the step is not plain: it has to be split, or states do not settle");
    return {};
  }

  std::vector<Sweep> list_;
  DownAndUp<Evaluated<double>> tree_;
  oneapi::tbb::task_arena one_thread_{1};  // sweeps of a schedule share what they find
  bool last_branch_first_ = true;
  bool refactors_ = false;  // the evaluation there is gets another factor
  bool cuts_ = false;       // of the last correction a part is taken back
  Policy policy_{};
  HeldFactor<double> held_;
  bool fresh_ = true;
};

}  // namespace linden
