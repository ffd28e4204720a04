// engine/solve/lane_stepper.hpp
// Steps of a block of W instances: lane = instance. The sweeps are those of lane_sweeps.hpp, what is decided of a lane is in decide.hpp.
//
//   momentum_target, first guess
//   solve               each lane by its own numbers and by how often it was corrected, never by its neighbours
//   end                 new positions and momenta, in the lanes that are done
//
// A step of an order above 2 is a row of such steps (engine/compose/composition.hpp), each with first guesses from its own displacements in the
// steps before. Where one fails, the lane goes back to where the step began.
//
// Every instruction that a lane's result depends on is the same in any company, so results are equal to the bit in any block, any place and
// with any number of threads.
//
// A lane that is given up, that may have landed on another root (judge.hpp), strikes a limit that it bounces off or has bodies that are near each
// other and may touch (lane_contacts.hpp) is stepped alone, with all that a Simulation can do (InstanceStepper); if that fails too it is frozen at its last good state.
#pragma once

#include <array>
#include <bit>
#include <cmath>

#include "engine/compose/composition.hpp"
#include "engine/solve/block_stepper.hpp"
#include "engine/solve/instance_stepper.hpp"
#include "engine/solve/solve.hpp"
#include "engine/sweeps/lane_sweeps.hpp"
#include "layout/packed_history.hpp"

namespace linden {

/// Sweeps make factors anew themselves. With effects a residual may grow whenever states change, and states may take some corrections to settle.
inline constexpr Policy kSmoothBlock{.most_corrections = 8, .judges_guess = false, .floor_test = FloorTest::after_slow_correction, .may_grow = 1};
inline constexpr Policy kBlockWithEffects{.most_corrections = 24,
                                          .floor_test = FloorTest::always,
                                          .may_grow = kAnyNumber,
                                          .one_state_at_a_time = 8,
                                          .one_limit_at_a_time = 18,
                                          .most_updates = 24};

template <class Pack, bool kEffects>
class LaneStepper final : public BlockStepper<typename ElementOf<Pack>::type> {
 public:
  using Real = typename ElementOf<Pack>::type;
  using L = LanesOf<Pack>;
  static constexpr int W = L::count;

  explicit LaneStepper(const BlockSetup<Real>& setup)
      : model_(setup.model), tree_(setup.model.tree), options_(setup.options), sweeps_(setup), work_(sweeps_.work()),
        alone_(model_, options_, setup.plan), stages_(composition(options_.order)) {
    if (stages_.size() == 1) return;
    start_q_.allocate(tree_.shape.positions);
    start_p_.allocate(tree_.shape.velocities);
  }

  int lanes() const override { return W; }

  void step(const Block<Real>& block, std::int64_t steps) override {
    sweeps_.load(block);
    sweeps_.refresh();
    Lanes alive = 0;
    for (int l = 0; l < block.count; ++l) alive |= block.instances[l].status == StepStatus::converged ? 1u << l : 0u;
    for (std::int64_t k = 0; k < steps && alive != 0; ++k) alive = step_once(block, alive);
    sweeps_.store(block);
  }

  void observe(const Block<Real>& block, Real* velocities, Real* energy, bool stepped) override {
    if (!stepped) sweeps_.load(block);
    if constexpr (kEffects) {
      if (!sweeps_.effects().plan().curves.empty()) return observe_alone(block, velocities, energy);
    }
    Lanes alone = 0;
    std::array<Energy, W> seen;
    if constexpr (kEffects) {
      if (energy != nullptr) alone = sweeps_.contacts().lasting(block);
      for (Lanes left = alone; left != 0; left &= left - 1) {
        const int l = std::countr_zero(left);
        take_out(block, l);
        seen[static_cast<std::size_t>(l)] = alone_.observe();
      }
    }
    if (!stepped && energy != nullptr) sweeps_.refresh();
    if (!stepped && energy == nullptr) sweeps_.place();
    if (energy != nullptr) {
      Pack potential = sweeps_.potential();
      if constexpr (kEffects) potential = potential + sweeps_.contacts().stored(block);
      L::store(potential, energy + W);
    }
    sweeps_.read_velocity();
    if (energy != nullptr) L::store(kinetic_energy(), energy);
    if constexpr (kEffects) sweeps_.effects().follow_motion(block, number(1 / options_.step), work_.increment);
    for (Index row = 0; row < tree_.shape.velocities; ++row) L::store(work_.increment(row), velocities + row * W);
    for (Lanes left = alone; left != 0; left &= left - 1) {
      const auto l = static_cast<std::size_t>(std::countr_zero(left));
      energy[l] = static_cast<Real>(seen[l].kinetic);
      energy[W + l] = static_cast<Real>(seen[l].potential);
    }
  }

 private:
  static constexpr int kWords = kHistoryWords<Real> * W;

  static Pack number(double value) { return Pack(static_cast<Real>(value)); }

  /// Of the velocities that were read.
  Pack kinetic_energy() {
    Pack kinetic = number(0);
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      kinetic = kinetic + number(0.5) * sweeps_.p()(row) * work_.increment(row);
    }
    return kinetic;
  }

  /// Row of the displacement that the last ones lead to.
  static Pack extrapolated(const std::uint32_t* past, Index row) {
    alignas(kAlignment) Real next[W];
    extrapolate<W>(past + row * kWords, next);
    return L::load(next);
  }
  /// Lanes of which an earlier displacement is known.
  static Lanes known(const Block<Real>& block) {
    Lanes lanes = 0;
    for (int l = 0; l < block.count; ++l) lanes |= block.instances[l].displacements > 0 ? 1u << l : 0u;
    return lanes;
  }

  void first_guess(const std::uint32_t* past, Lanes alive, Lanes extrapolates) {
    for (Index row = 0; row < tree_.shape.velocities; ++row) work_.delta(row) = extrapolated(past, row);
    if ((alive & ~extrapolates) == 0) return;
    // no displacement is known yet: h M^-1 (p + h/2 Q)
    sweeps_.solve_mass(work_.momentum_target, work_.increment);
    const auto mask = L::mask(extrapolates);
    for (Index row = 0; row < tree_.shape.velocities; ++row) work_.delta(row) = select(mask, work_.delta(row), work_.increment(row));
  }

  /// Returns the lanes still alive.
  Lanes step_once(const Block<Real>& block, Lanes alive) {
    const bool staged = stages_.size() > 1;
    if (staged) keep_start();
    Lanes together = alive, frozen = 0, near = 0;
    if constexpr (kEffects) near = sweeps_.near(block, alive);
    for (std::size_t stage = 0; stage < stages_.size() && together != 0; ++stage) {
      if (staged) sweeps_.use_step(stages_[stage] * options_.step);
      std::uint32_t* const past = block.past + stage * static_cast<std::size_t>(tree_.shape.velocities * kWords);
      const Lanes free = together & ~near;
      const Lanes done = free != 0 ? solve(block, free, past) : 0;
      frozen |= step_lost(block, together & ~done, near);
      sweeps_.end(block, done);
      if (done != 0) remember_displacement(block, done, past);
      together = done;
    }
    for (Lanes left = together; left != 0; left &= left - 1) {
      InstanceRecord& instance = block.instances[std::countr_zero(left)];
      instance.displacements = static_cast<std::int8_t>(std::min(instance.displacements + 1, 2));
      instance.steps += 1;
    }
    return alive & ~frozen;
  }

  /// Returns the lanes in which a step, or sub-step, is solved.
  Lanes solve(const Block<Real>& block, Lanes alive, const std::uint32_t* past) {
    sweeps_.find_target();
    const Lanes extrapolates = known(block);
    first_guess(past, alive, extrapolates);
    spread_mimics<Pack>(model_.mimics, work_.delta);  // corrections keep ties, so the guess must
    Solve solve(sweeps_, kEffects ? kBlockWithEffects : kSmoothBlock);
    const Solved<Pack> solved = solve.run(alive, sweeps_.start(block, alive), 0);
    solved.evaluations.each(alive, [&](int l, int evaluations) { block.instances[l].evaluations += evaluations; });
    sweeps_.factor().made().each(alive, [&](int l, int factors) { block.instances[l].factors += static_cast<std::uint32_t>(factors); });
    displacement_map(tree_, work_.motion, work_.delta);
    return solved.done & ~may_be_another_root(no_other_root(model_), tree_, sweeps_.constants(), solved.done & extrapolates, solved.least_w,
                                              work_.delta, [&](Index row) { return extrapolated(past, row); });
  }

  /// Where a step of sub-steps begins.
  void keep_start() {
    std::ranges::copy(sweeps_.q().flat(), start_q_.flat().begin());
    std::ranges::copy(sweeps_.p().flat(), start_p_.flat().begin());
  }

  /// Takes the step in these lanes, each alone; near: those that were not tried together, so nothing speaks against their first guess. Returns
  /// those that are frozen.
  Lanes step_lost(const Block<Real>& block, Lanes lost, Lanes near) {
    Lanes frozen = 0;
    if (lost != 0 && stages_.size() > 1) {
      const auto back = [&](const Field<Pack>& from, Field<Pack>& to) {
        for (Index row = 0; row < to.rows(); ++row) to(row) = select(L::mask(lost), from(row), to(row));
      };
      back(start_q_, sweeps_.q());
      back(start_p_, sweeps_.p());
    }
    for (Lanes left = lost; left != 0; left &= left - 1) {
      const int l = std::countr_zero(left);
      const bool guessed = ((near & known(block)) >> l & 1u) != 0;
      if (!step_alone(block, l, guessed ? 1 : 0)) frozen |= 1u << l;
    }
    return frozen;
  }

  void remember_displacement(const Block<Real>& block, Lanes done, std::uint32_t* past) {
    std::array<std::int32_t, W> known;
    for (int l = 0; l < W; ++l) known[static_cast<std::size_t>(l)] = (done >> l & 1u) != 0 ? block.instances[l].displacements : -1;
    alignas(kAlignment) Real delta[W];
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      L::store(work_.delta(row), delta);
      remember<W>(delta, known.data(), past + row * kWords);
    }
  }

  /// Lane l as it stands, for alone_.
  void take_out(const Block<Real>& block, int l) {
    alone_.forget();
    State<double>& state = alone_.state();
    const auto take = [&](const Field<Pack>& from, std::span<double> to) {
      for (std::size_t row = 0; row < to.size(); ++row) to[row] = static_cast<double>(L::lane(from(static_cast<Index>(row)), l));
    };
    take(sweeps_.q(), state.q.flat());
    take(sweeps_.p(), state.p.flat());
    if (sweeps_.applied() != nullptr) take(*sweeps_.applied(), alone_.applied());
    if (block.gravity != nullptr) alone_.use_gravity(sweeps_.own_gravity(block)[static_cast<std::size_t>(l)]);
    if constexpr (kEffects) {
      sweeps_.effects().take_out(block, l, alone_.controls());
      sweeps_.contacts().take_out(block, l, alone_.contact_memory());
    }
    if (block.mass != nullptr) {
      Field<double, 10>& inertia = alone_.own_constants().inertia;
      for (Index i = 0; i < inertia.rows(); ++i) {
        for (int k = 0; k < 10; ++k) inertia(i, k) = static_cast<double>(block.mass[(i * kMassRows + k) * W + l]);
      }
    }
    if (block.instances[l].displacements == 0 || stages_.size() > 1) return;
    for (Index row = 0; row < state.history.rows(); ++row) {
      state.history(row, 0) = static_cast<double>(remembered<Real>(block.past + row * kWords + l));
    }
    state.last_step(0) = options_.step;
  }

  void observe_alone(const Block<Real>& block, Real* velocities, Real* energy) {
    for (int l = 0; l < block.count; ++l) {
      take_out(block, l);
      const Energy seen = alone_.observe();
      for (Index row = 0; row < tree_.shape.velocities; ++row) velocities[row * W + l] = static_cast<Real>(alone_.rate()(row));
      if (energy == nullptr) continue;
      energy[l] = static_cast<Real>(seen.kinetic);
      energy[W + l] = static_cast<Real>(seen.potential);
    }
  }

  /// What the next step of lane l wants to know of one taken alone: its displacement; of one that was split, that of its last part, as if it
  /// had been as long as a step. Of sub-steps nothing is kept.
  void keep_alone(const Block<Real>& block, int l) {
    sweeps_.factor().drop(l);
    if constexpr (kEffects) {
      sweeps_.effects().keep_alone(block, l, alone_.controls());
      sweeps_.contacts().keep_alone(block, l, alone_.contact_memory());
    }
    block.instances[l].displacements = 0;
    if (stages_.size() > 1) return;
    std::array<std::int32_t, W> known;
    known.fill(-1);
    known[static_cast<std::size_t>(l)] = 0;
    std::array<Real, W> delta{};
    const State<double>& state = alone_.state();
    const double longer = options_.step / state.last_step(0);
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      delta[static_cast<std::size_t>(l)] = static_cast<Real>(longer * state.history(row, 0));
      remember<W>(delta.data(), known.data(), block.past + row * kWords);
    }
    block.instances[l].displacements = 1;
  }

  /// One instance with everything a Simulation can do. False where that fails too: it is frozen then.
  [[gnu::noinline]] bool step_alone(const Block<Real>& block, int l, int guessed) {
    State<double>& state = alone_.state();
    take_out(block, l);
    const StepReport report = alone_.step(static_cast<double>(block.instances[l].steps) * options_.step, guessed);
    InstanceRecord& instance = block.instances[l];
    instance.evaluations += report.evaluations;
    if (!report.ok()) {
      instance.status = report.status;
      instance.slot = report.slot;
      instance.coupling = report.coupling;
      instance.residual = report.residual;
      return false;
    }
    instance.rescued += 1;
    instance.steps += 1;
    keep_alone(block, l);
    for (Index row = 0; row < state.q.rows(); ++row) L::set_lane(sweeps_.q()(row), l, state.q(row));
    for (Index row = 0; row < state.p.rows(); ++row) L::set_lane(sweeps_.p()(row), l, state.p(row));
    return true;
  }

  const Model& model_;
  const Tree& tree_;
  Options options_;
  LaneSweeps<Pack, kEffects> sweeps_;
  Workspace<Pack>& work_;
  InstanceStepper alone_;
  std::span<const double> stages_;  // lengths of sub-steps, in steps
  Field<Pack> start_q_, start_p_;   // no rows where there is but one
};

}  // namespace linden
