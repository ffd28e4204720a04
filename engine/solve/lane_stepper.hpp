// engine/solve/lane_stepper.hpp
// Steps of a block of W instances: lane = instance. `Pack` is a register of W numbers (or one number), `kOwnMasses` says
// whether masses differ between instances, `kEffects` whether anything acts beside gravity.
//
//   momentum_target, first guess
//   start_down                        guess -> displacements, momenta
//   newton_up                         residual, Jacobian to first order and its factor, first half of a solve
//   +-> correct_down                  second half of the solve, corrected displacements, momenta
//   |   innovation_up (or newton_up)  residual and its norm: which lanes have converged?
//   +-- in lanes that have not
//   advance_down, momentum_up         new positions, placements, forces, momenta
//
// What is decided of a lane - whether it goes on, has converged, is lost - depends on its own numbers and on how often it was corrected,
// never on its neighbours; lanes that are done are kept aside while others go on. Every instruction that a lane's result depends on is
// the same in any company, so results are equal to the bit in any block, any place and with any number of threads.
//
// The Jacobian is factored to first order at the guess, exactly at every second correction from the second on. A lane that
// kMostCorrections do not bring home, that gets no nearer, turns a body by pi, may have landed on another root (convergence.hpp) or strikes
// a limit that it bounces off is stepped alone, with all that a Simulation can do (InstanceStepper); if that fails too it is frozen at
// its last good state.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "engine/effects/lane_effects.hpp"
#include "engine/solve/block_stepper.hpp"
#include "engine/solve/convergence.hpp"
#include "engine/solve/instance_stepper.hpp"
#include "engine/sweeps/lanes_of.hpp"
#include "kernels/block/advance_down.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/tree/largest_turn.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/rounding_floor_map.hpp"
#include "layout/packed_history.hpp"
#include "layout/workspace.hpp"

namespace linden {

inline constexpr int kMostCorrections = 8;

/// With effects, whose states may take some corrections to settle; from some on they are revised one by one.
inline constexpr int kMostEffectCorrections = 24, kBulkEffectCorrections = 8, kLastEffectCorrections = 18;

template <class Pack, bool kOwnMasses, bool kEffects>
class LaneStepper final : public BlockStepper<typename ElementOf<Pack>::type> {
 public:
  using Real = typename ElementOf<Pack>::type;
  using L = LanesOf<Pack>;
  using Mask = typename L::Mask;
  static constexpr int W = L::count;

  explicit LaneStepper(const BlockSetup<Real>& setup)
      : model_(setup.model), tree_(setup.model.tree), options_(setup.options), shared_constants_(setup.constants),
        effects_(setup), alone_(model_, options_, setup.plan) {
    const Shape& shape = tree_.shape;
    work_.allocate(shape);
    kept_.allocate(shape);
    q_.allocate(shape.positions);
    p_.allocate(shape.velocities);
    applied_.allocate(shape.velocities);
    if constexpr (kOwnMasses) {
      own_constants_.allocate(shape);
      const auto spread = [](const auto& from, auto& to) {
        for (std::size_t k = 0; k < to.flat().size(); ++k) to.flat()[k] = Pack(from.flat()[k]);
      };
      spread(setup.constants.screw, own_constants_.screw);
      spread(setup.constants.tree_placement, own_constants_.tree_placement);
      spread(setup.constants.inertia, own_constants_.inertia);
      spread(setup.constants.subtree_mass, own_constants_.subtree_mass);
    }
    has_gravity_ = options_.gravity != std::array<double, 3>{0, 0, 0};
    gravity_ = {number(options_.gravity[0]), number(options_.gravity[1]), number(options_.gravity[2])};
    const double tolerance = sizeof(Real) == sizeof(float) ? std::max(options_.tolerance, kSingleTolerance) : options_.tolerance;
    tolerance_squared_ = number(tolerance * tolerance);
    const double unit = kFloorEpsilons * static_cast<double>(std::numeric_limits<Real>::epsilon());
    floor_unit_squared_ = number(unit * unit);
    constexpr double ceiling = sizeof(Real) == sizeof(float) ? kSingleFloorCeiling : kFloorCeiling;
    const auto& g = options_.gravity;
    fall_per_mass_ = 0.5 * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * std::pow(options_.step, 4);
    ceiling_squared_ = number(ceiling * ceiling);
    for (auto& value : work_.delta.flat()) value = number(0);
    for (auto& value : work_.force.flat()) value = number(0);
    for (auto& value : work_.innovation.flat()) value = number(0);
    for (auto& value : work_.impulse.flat()) value = number(0);
    for (auto& value : work_.field.flat()) value = number(0);
    set_motion_identity();
  }

  int lanes() const override { return W; }

  void step(const Block<Real>& block, std::int64_t steps) override {
    load(block);
    if constexpr (kEffects) effects_.load(block);
    refresh();
    Lanes alive = 0;
    for (int l = 0; l < block.count; ++l) alive |= block.instances[l].status == StepStatus::converged ? 1u << l : 0u;
    for (std::int64_t k = 0; k < steps && alive != 0; ++k) alive = step_once(block, alive);
    store(block);
    if constexpr (kEffects) effects_.store(block);
  }

  void observe(const Block<Real>& block, Real* velocities, Real* energy) override {
    load(block);
    if constexpr (kEffects) effects_.load(block);
    bool alone = !model_.mimics.empty();
    if constexpr (kEffects) alone = alone || !effects_->plan().curves.empty();
    if (alone) return observe_alone(block, velocities, energy);
    const Pack potential = refresh();
    if constexpr (kEffects) {
      effects_->begin_reading(p_);
      effects_->with_reading([&](const auto& added) { factor_mass(added); });
      apply_mass_inverse(p_, work_.increment);
    } else {
      solve_mass(p_, work_.increment);
    }
    Pack kinetic = number(0);
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      kinetic = kinetic + number(0.5) * p_(row) * work_.increment(row);
    }
    if constexpr (kEffects) effects_.follow_motion(block, number(1 / options_.step), work_.increment);
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      L::store(work_.increment(row), velocities + row * W);
    }
    L::store(kinetic, energy);
    L::store(potential, energy + W);
  }

 private:
  static Pack number(double value) { return Pack(static_cast<Real>(value)); }

  const auto& constants() const {
    if constexpr (kOwnMasses) {
      return own_constants_;
    } else {
      return shared_constants_;
    }
  }
  Gains<Pack> gains() { return {work_.gain_up, work_.gain_down, work_.joint_inverse}; }
  const Field<Pack>* applied() const { return has_applied_ ? &applied_ : nullptr; }

  /// Of a screw's motion the sweeps of a block write three numbers of seven.
  void set_motion_identity() {
    for (Field<Pack, 7>* motion : {&work_.motion, &work_.displacement, &kept_.motion, &kept_.displacement}) {
      for (Index i = 0; i < motion->rows(); ++i) {
        for (int k = 0; k < 7; ++k) (*motion)(i, k) = number(k == 3 ? 1 : 0);
      }
    }
  }

  void load(const Block<Real>& block) {
    for (Index row = 0; row < q_.rows(); ++row) q_(row) = L::load(block.q + row * W);
    for (Index row = 0; row < p_.rows(); ++row) p_(row) = L::load(block.p + row * W);
    has_applied_ = block.applied != nullptr;
    if (has_applied_) {
      for (Index row = 0; row < p_.rows(); ++row) applied_(row) = L::load(block.applied + row * W);
    }
    if constexpr (kOwnMasses) {
      const Real* from = block.mass;
      for (Index i = 0; i < tree_.shape.slots; ++i) {
        for (int k = 0; k < 10; ++k, from += W) own_constants_.inertia(i, k) = L::load(from);
        own_constants_.subtree_mass(i) = L::load(from);
        from += W;
      }
    }
  }

  void store(const Block<Real>& block) const {
    for (Index row = 0; row < q_.rows(); ++row) L::store(q_(row), block.q + row * W);
    for (Index row = 0; row < p_.rows(); ++row) L::store(p_(row), block.p + row * W);
  }

  /// Placements and forces of the positions as they are; returns the potential energy. The same instructions as at the end of a step, so
  /// that it does not matter how many steps are taken in one go.
  Pack refresh() {
    advance(L::mask(0));
    const Pack potential = update_momentum(L::mask(0));
    if constexpr (kEffects) return potential + effects_.refresh(work_.placement, q_);
    return potential;
  }

  void advance(const Mask& moves) {
    if (has_gravity_) {
      advance_down<true>(tree_, constants(), gravity_, moves, work_, q_);
    } else {
      advance_down<false>(tree_, constants(), gravity_, moves, work_, q_);
    }
  }

  Pack update_momentum(const Mask& moves) {
    const Pack h = number(options_.step);
    if (has_gravity_) return momentum_up<true>(tree_, constants(), h, moves, applied(), work_, p_);
    return momentum_up<false>(tree_, constants(), h, moves, applied(), work_, p_);
  }

  [[gnu::noinline]] void solve_mass(const Field<Pack>& right_side, Field<Pack>& rate) {
    effects_->with_rotors([&](const auto& rotors) { factor_mass(rotors); });
    apply_mass_inverse(right_side, rate);
  }
  template <class Added>
  [[gnu::noinline]] void factor_mass(const Added& added) {
    articulated_inertia_up(tree_, constants(), work_.placement, work_.articulated, gains(), added);
  }
  [[gnu::noinline]] void apply_mass_inverse(const Field<Pack>& right_side, Field<Pack>& rate) {
    impulse_pass_up(tree_, constants(), work_.placement, gains(), right_side, work_.bias, work_.innovation);
    rate_down(tree_, constants(), work_.placement, gains(), work_.innovation, work_.variation, rate);
  }

  void first_guess(const Block<Real>& block, Lanes alive) {
    Lanes known = 0;
    for (int l = 0; l < block.count; ++l) known |= block.instances[l].displacements > 0 ? 1u << l : 0u;
    constexpr int words = kHistoryWords<Real> * W;
    alignas(kAlignment) Real next[W];
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      extrapolate<W>(block.past + row * words, next);
      work_.delta(row) = L::load(next);
    }
    if ((alive & ~known) != 0) {
      // no displacement is known yet: h M^-1 (p + h/2 Q)
      solve_mass(work_.momentum_target, work_.increment);
      const Mask extrapolated = L::mask(known);
      for (Index row = 0; row < tree_.shape.velocities; ++row) {
        work_.delta(row) = select(extrapolated, work_.delta(row), work_.increment(row));
      }
    }
  }

  /// Of these lanes those that may have landed on another root: least_w of their solutions, see displacement_down.
  Lanes in_doubt(const Block<Real>& block, Lanes lanes, const Pack& least_w) const {
    lanes &= L::bits(least_w <= number(kFreeCosine));
    for (int l = 0; l < block.count; ++l) {
      if (block.instances[l].displacements == 0) lanes &= ~(1u << l);  // nothing is known of a step before
    }
    if (lanes == 0) return 0;
    constexpr int words = kHistoryWords<Real> * W;
    const Pack corrected = largest_turn(tree_, constants(), work_.delta, [&](Index row) {
      alignas(kAlignment) Real guess[W];
      extrapolate<W>(block.past + row * words, guess);
      return L::load(guess);
    });
    return lanes & L::bits(corrected >= number(kFreeCorrection));
  }

  [[gnu::noinline]] void keep(Lanes lanes) { blend(kept_, work_, L::mask(lanes)); }
  [[gnu::noinline]] void bring_back(Lanes lanes) { blend(work_, kept_, L::mask(lanes)); }

  template <class To, class From>
  void blend(To& to, const From& from, const Mask& lanes) {
    const auto each = [&](auto& target, const auto& source) {
      for (std::size_t k = 0; k < target.flat().size(); ++k) {
        target.flat()[k] = select(lanes, source.flat()[k], target.flat()[k]);
      }
    };
    each(to.motion, from.motion);
    each(to.displacement, from.displacement);
    each(to.impulse, from.impulse);
    each(to.innovation, from.innovation);
    each(to.delta, from.delta);
  }

  Lanes at_rounding_floor(const Pack& norm, const Pack& energy) {
    const Pack sum = rounding_floor_map(tree_, constants(), work_.momentum_target, work_.impulse, work_.joint_inverse);
    const Pack fall = number(fall_per_mass_) * as<Pack>(constants().subtree_mass(0));
    return L::bits(number(0.5) * norm <= ceiling_squared_ * (energy + fall)) & L::bits(norm <= floor_unit_squared_ * sum);
  }

  /// Returns the lanes still alive.
  Lanes step_once(const Block<Real>& block, Lanes alive) {
    momentum_target_map(tree_, number(options_.step), p_, work_.force, work_.momentum_target);
    if (!model_.mimics.empty()) return finish(block, alive, {.lost = alive});  // joints that are tied are stepped alone
    first_guess(block, alive);
    if constexpr (kEffects) {
      return finish(block, alive, solve_with_effects(block, alive));
    } else {
      return finish(block, alive, solve(block, alive));
    }
  }

  struct Solved {
    Lanes done = 0, lost = 0;
    Pack least_w = number(1);  // of those done, see displacement_down
  };

  Solved solve(const Block<Real>& block, Lanes active) {
    Solved solved;
    start_down(tree_, constants(), work_);
    Pack norm = newton_up<true>(tree_, constants(), work_);
    for (int corrections = 1;; ++corrections) {
      const Pack before = norm;
      const Evaluation<Pack> now = correct_down(tree_, constants(), L::mask(active), work_);
      norm = corrections % 2 == 0 ? newton_up<false>(tree_, constants(), work_) : innovation_up(tree_, constants(), work_);
      const Pack limit = number(std::numeric_limits<Real>::max());
      const Lanes usable = L::bits(now.least_w > number(0)) & L::bits(norm <= limit) & L::bits(now.energy <= limit);
      Lanes ok = active & usable & L::bits(number(0.5) * norm <= tolerance_squared_ * now.energy);
      const Lanes left = active & ~ok;
      if (left != 0) {
        const Lanes slow = left & usable & ~L::bits(norm <= number(kSlowProgress * kSlowProgress) * before);
        if (slow != 0) ok |= slow & at_rounding_floor(norm, now.energy);
        Lanes given_up = left & ~usable;
        if (corrections > 1) given_up |= left & ~L::bits(norm < before);
        if (corrections == kMostCorrections) given_up |= left;
        solved.lost |= given_up & ~ok;
      }
      solved.least_w = select(L::mask(ok), now.least_w, solved.least_w);
      for (int l = 0; l < block.count; ++l) {
        if ((active >> l & 1u) != 0 && ((ok | solved.lost) >> l & 1u) != 0) block.instances[l].evaluations += corrections + 1;
      }
      active &= ~(ok | solved.lost);
      if (active == 0) {
        if (solved.done != 0) bring_back(solved.done);
        solved.done |= ok;
        return solved;
      }
      if (ok != 0) keep(ok);
      solved.done |= ok;
    }
  }

  /// The factor is exact and fresh at every evaluation, so that lanes that wait for others compute what they had, and what becomes of a lane
  /// whose effects change their state depends on itself alone.
  Solved solve_with_effects(const Block<Real>& block, Lanes active) {
    Solved solved;
    effects_.begin(block, options_.step, q_, work_);
    Evaluation<Pack> now = start_down(tree_, constants(), work_);
    if (!effects_->plan().ground.points.empty()) effects_->guess_points(work_.displacement);
    Pack norm = effects_.act(constants(), work_, now);
    const Pack limit = number(std::numeric_limits<Real>::max());
    const Pack fall = number(fall_per_mass_) * as<Pack>(constants().subtree_mass(0));
    for (int corrections = 0;; ++corrections) {
      const Lanes usable = L::bits(now.least_w > number(0)) & L::bits(norm <= limit) & L::bits(now.energy <= limit);
      const Pack scale = now.energy + fall;
      Lanes ok = usable & L::bits(number(0.5) * norm <= tolerance_squared_ * scale);
      ok |= usable & ~ok & at_rounding_floor(norm, now.energy);
      const Lanes near = ok | (usable & L::bits(number(0.5) * norm <= number(kSettledSquared) * scale));
      Lanes changed = 0;
      if (effects_->plan().revises) {
        const auto all = [](bool yes) { return L::mask(yes ? ~Lanes{0} : 0); };
        const Revision<Mask> revision{L::mask(near), L::mask(ok), all(corrections >= kBulkEffectCorrections), all(corrections >= kLastEffectCorrections)};
        changed = L::bits(effects_->revise(work_.innovation, revision, work_.delta));
      }
      ok &= active & ~changed;
      Lanes given_up = active & ~ok & (~usable | (corrections == kMostEffectCorrections ? ~Lanes{0} : 0));
      if (const Lanes blows = ok & effects_.blows(q_, work_.delta); blows != 0) {
        given_up |= blows;
        ok &= ~blows;
      }
      solved.least_w = select(L::mask(ok), now.least_w, solved.least_w);
      for (int l = 0; l < block.count; ++l) {
        if (((ok | given_up) >> l & 1u) != 0) block.instances[l].evaluations += corrections + 1;
      }
      solved.done |= ok;
      solved.lost |= given_up;
      active &= ~(ok | given_up);
      if (active == 0) return solved;
      now = correct_down(tree_, constants(), L::mask(active & ~changed), work_);
      norm = effects_.act(constants(), work_, now);
    }
  }

  Lanes finish(const Block<Real>& block, Lanes alive, const Solved& solved) {
    Lanes done = solved.done, lost = solved.lost;
    displacement_map(tree_, work_.motion, work_.delta);
    lost |= in_doubt(block, done, solved.least_w);
    done &= ~lost;

    Lanes frozen = 0;
    for (int l = 0; l < W; ++l) {
      if ((lost >> l & 1u) != 0 && !step_alone(block, l)) frozen |= 1u << l;
    }

    const Mask moves = L::mask(done);
    if constexpr (kEffects) effects_.end(block, done, work_);
    advance(moves);
    update_momentum(moves);
    if constexpr (kEffects) {
      effects_.add_end(constants(), moves, work_, p_);
      effects_.refresh(work_.placement, q_);
    }
    if (done == 0) return alive & ~frozen;

    std::array<std::int32_t, W> known;
    for (int l = 0; l < W; ++l) {
      known[static_cast<std::size_t>(l)] = -1;
      if ((done >> l & 1u) == 0) continue;
      InstanceRecord& instance = block.instances[l];
      known[static_cast<std::size_t>(l)] = instance.displacements;
      instance.displacements = static_cast<std::int8_t>(std::min(instance.displacements + 1, 2));
      instance.steps += 1;
    }
    constexpr int words = kHistoryWords<Real> * W;
    alignas(kAlignment) Real delta[W];
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      L::store(work_.delta(row), delta);
      remember<W>(delta, known.data(), block.past + row * words);
    }
    return alive & ~frozen;
  }

  /// Lane l as it stands, for alone_.
  void take_out(const Block<Real>& block, int l) {
    alone_.forget();
    State<double>& state = alone_.state();
    const auto take = [&](const Field<Pack>& from, std::span<double> to) {
      for (std::size_t row = 0; row < to.size(); ++row) to[row] = static_cast<double>(L::lane(from(static_cast<Index>(row)), l));
    };
    take(q_, state.q.flat());
    take(p_, state.p.flat());
    if (has_applied_) take(applied_, alone_.applied());
    if constexpr (kEffects) effects_.take_out(block, l, alone_);
    if constexpr (kOwnMasses) {
      Field<double, 10>& inertia = alone_.own_constants().inertia;
      for (Index i = 0; i < inertia.rows(); ++i) {
        for (int k = 0; k < 10; ++k) inertia(i, k) = static_cast<double>(L::lane(own_constants_.inertia(i, k), l));
      }
    }
    if (block.instances[l].displacements == 0) return;
    constexpr int words = kHistoryWords<Real> * W;
    for (Index row = 0; row < state.history.rows(); ++row) {
      state.history(row, 0) = static_cast<double>(remembered<Real>(block.past + row * words + l));
    }
    state.last_step(0) = options_.step;
  }

  void observe_alone(const Block<Real>& block, Real* velocities, Real* energy) {
    for (int l = 0; l < block.count; ++l) {
      take_out(block, l);
      const Energy seen = alone_.observe();
      for (Index row = 0; row < p_.rows(); ++row) velocities[row * W + l] = static_cast<Real>(alone_.rate()(row));
      energy[l] = static_cast<Real>(seen.kinetic);
      energy[W + l] = static_cast<Real>(seen.potential);
    }
  }

  /// What the next step of lane l wants to know of one taken alone: its displacement; of one that was split, that of its last part, as if it
  /// had been as long as a step.
  void keep_alone(const Block<Real>& block, int l) {
    if constexpr (kEffects) effects_.keep_alone(block, l, alone_);
    constexpr int words = kHistoryWords<Real> * W;
    std::array<std::int32_t, W> known;
    known.fill(-1);
    known[static_cast<std::size_t>(l)] = 0;
    std::array<Real, W> delta{};
    const State<double>& state = alone_.state();
    const double longer = options_.step / state.last_step(0);
    for (Index row = 0; row < tree_.shape.velocities; ++row) {
      delta[static_cast<std::size_t>(l)] = static_cast<Real>(longer * state.history(row, 0));
      remember<W>(delta.data(), known.data(), block.past + row * words);
    }
    block.instances[l].displacements = 1;
  }

  /// One instance with everything a Simulation can do. False where that fails too: it is frozen then.
  [[gnu::noinline]] bool step_alone(const Block<Real>& block, int l) {
    State<double>& state = alone_.state();
    take_out(block, l);
    const StepReport report = alone_.step(static_cast<double>(block.instances[l].steps) * options_.step);
    InstanceRecord& instance = block.instances[l];
    instance.evaluations += report.evaluations;
    if (!report.ok()) {
      instance.status = report.status;
      instance.slot = report.slot;
      instance.residual = report.residual;
      return false;
    }
    instance.rescued += 1;
    instance.steps += 1;
    keep_alone(block, l);
    for (Index row = 0; row < q_.rows(); ++row) L::set_lane(q_(row), l, state.q(row));
    for (Index row = 0; row < p_.rows(); ++row) L::set_lane(p_(row), l, state.p(row));
    return true;
  }

  const Model& model_;
  const Tree& tree_;
  Options options_;
  const BodyConstants<Real>& shared_constants_;
  bool has_gravity_ = false, has_applied_ = false;
  Vec3<Pack> gravity_;
  Pack tolerance_squared_, floor_unit_squared_, ceiling_squared_;
  double fall_per_mass_ = 0;  // h^2 x kinetic energy per kilogram that gravity gives in a step
  BodyConstants<Pack> own_constants_;  // empty where all share the model's
  Workspace<Pack> work_;
  Kept<Pack> kept_;
  Field<Pack> q_, p_, applied_;
  [[no_unique_address]] std::conditional_t<kEffects, LaneEffects<Pack>, NoLaneEffects> effects_;
  InstanceStepper alone_;
};

}  // namespace linden
