// engine/sweeps/lane_sweeps.hpp
// The sweeps over a block of W instances of one tree that a step is made of, lane = instance, with the memory they share. `Pack` is a register
// of W numbers, or one number; `kEffects` whether anything acts beside gravity. What a solution is, and what to do where there is none, is
// not their business (engine/solve/solve.hpp).
//
//   start            start_down                       guess -> displacements, momenta
//                    (block_factor_up)                Jacobian and its factor, where that of an earlier step does not serve
//                    innovation_up                    residual, first half of the solve
//   evaluate         correct_down                     second half of a solve, corrected displacements, momenta
//                    (block_factor_up), innovation_up the same
//   end              advance_down, momentum_up        new positions, placements, forces, momenta
//   read_velocity    mass_solve_up, rate_down         velocities of the momenta, where they are asked for
//
// A factor is held from step to step (lane_factor.hpp); effects that stick, stop or saturate want one of the step itself. It is made anew where
// a state changed, and exactly where a correction left more than a hundredth: to first order in turns it does not know how fast a body moves
// along. What falls at tens of metres a second is stepped alone even so: the correction after a slow one is made before its factor is. Lanes
// that wait for others compute what they had; without effects what they found is kept aside, which takes less.
#pragma once

#include <array>
#include <limits>

#include "engine/effects/lane_effects.hpp"
#include "engine/solve/block_stepper.hpp"
#include "engine/solve/judge.hpp"
#include "engine/sweeps/coupling_sweeps.hpp"
#include "engine/sweeps/lane_contacts.hpp"
#include "engine/sweeps/lane_factor.hpp"
#include "kernels/block/advance_down.hpp"
#include "kernels/block/block_factor_up.hpp"
#include "kernels/block/lane_constants.hpp"
#include "kernels/block/mass_solve_up.hpp"
#include "kernels/effects/law.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/residual_up.hpp"
#include "kernels/tree/rounding_floor_map.hpp"
#include "layout/workspace.hpp"

namespace linden {

template <class Pack, bool kEffects>
class LaneSweeps {
 public:
  using Real = typename ElementOf<Pack>::type;
  using L = LanesOf<Pack>;
  using Mask = typename L::Mask;
  using Number = Pack;
  static constexpr bool kAlone = false;

  explicit LaneSweeps(const BlockSetup<Real>& setup)
      : tree_(setup.model.tree), options_(setup.options), constants_(setup.constants), step_(options_.step), effects_(setup),
        contacts_(setup.model.tree, setup.plan), couplings_(setup.model, setup.plan.row_yields), factor_(setup.model, setup.holds_factor) {
    const Shape& shape = tree_.shape;
    work_.allocate(shape);
    if constexpr (!kEffects) kept_.allocate(shape);
    q_.allocate(shape.positions);
    p_.allocate(shape.velocities);
    applied_.allocate(shape.velocities);
    has_gravity_ = options_.gravity != std::array<double, 3>{0, 0, 0};
    LaneGravity<Pack> gravity;
    gravity.fill(options_.gravity);
    set_gravity(gravity);
    reduction_squared_ = options_.reduction * options_.reduction;
    enough_ = number(0);
    const double tolerance = sizeof(Real) == sizeof(float) ? std::max(options_.tolerance, kSingleTolerance) : options_.tolerance;
    tolerance_ = tolerance;
    tolerance_squared_ = number(tolerance * tolerance);
    for (Field<Pack>* field : {&work_.delta, &work_.force, &work_.innovation}) std::ranges::fill(field->flat(), number(0));
    std::ranges::fill(work_.impulse.flat(), number(0));
    std::ranges::fill(work_.field.flat(), number(0));
    set_motion_identity(work_.motion);
    set_motion_identity(work_.displacement);
    if constexpr (!kEffects) {
      set_motion_identity(kept_.motion);
      set_motion_identity(kept_.displacement);
    }
  }

  static Pack number(double value) { return Pack(static_cast<Real>(value)); }

  const BodyConstants<EachLane<Pack>>& constants() const { return constants_; }
  Workspace<Pack>& work() { return work_; }
  const Workspace<Pack>& work() const { return work_; }
  auto& effects() { return effects_; }
  LaneFactor<Pack>& factor() { return factor_; }
  Field<Pack>& q() { return q_; }
  Field<Pack>& p() { return p_; }
  /// Forces given from outside; null: none.
  const Field<Pack>* applied() const { return has_applied_ ? &applied_ : nullptr; }

  void load(const Block<Real>& block) {
    const auto load_rows = [](const Real* from, Field<Pack>& to) {
      for (Index row = 0; row < to.rows(); ++row) to(row) = L::load(from + row * L::count);
    };
    load_rows(block.q, q_);
    load_rows(block.p, p_);
    has_applied_ = block.applied != nullptr;
    if (has_applied_) load_rows(block.applied, applied_);
    constants_.use_masses(block.mass);
    if constexpr (kEffects) effects_.load(block);
    factor_.load(block, work_);
    if (block.gravity != nullptr) use_gravity(own_gravity(block));
  }
  /// Of each instance; lanes that hold none have that of the options.
  LaneGravity<Pack> own_gravity(const Block<Real>& block) const {
    LaneGravity<Pack> gravity;
    gravity.fill(options_.gravity);
    for (std::size_t l = 0; l < static_cast<std::size_t>(block.count); ++l) {
      for (std::size_t k = 0; k < 3; ++k) gravity[l][k] = static_cast<double>(block.gravity[k * std::size_t{L::count} + l]);
    }
    return gravity;
  }
  void store(const Block<Real>& block) {
    for (Index row = 0; row < q_.rows(); ++row) L::store(q_(row), block.q + row * L::count);
    for (Index row = 0; row < p_.rows(); ++row) L::store(p_(row), block.p + row * L::count);
    if constexpr (kEffects) effects_.store(block);
    factor_.store(block, work_);
  }

  /// Steps that come are of another length [s], negative ones back in time.
  void use_step(double h) {
    step_ = h;
    set_gravity(gravity_of_lanes_);
  }

  /// Placements of the positions as they are.
  void place() { advance(L::mask(0)); }
  /// Placements and forces of the positions as they are. The same instructions as at the end of a step, so that it does not matter how
  /// many steps are taken in one go.
  void refresh() {
    place();
    update_momentum(L::mask(0));
    if constexpr (kEffects) effects_.refresh(work_.placement, q_);
  }
  /// Potential energy, after refresh or the end of a step.
  Pack potential() {
    const Pack stored = of_gravity_ + couplings_.potential();
    if constexpr (kEffects) return stored + effects_.refresh(work_.placement, q_);
    return stored;
  }

  /// Contacts of bodies with each other: of a step in lanes there are none.
  LaneContacts<Pack>& contacts()
    requires kEffects
  {
    return contacts_;
  }
  Lanes near(const Block<Real>& block, Lanes alive)
    requires kEffects
  {
    return contacts_.near(block, work_.placement, alive);
  }

  void find_target() { momentum_target_map(tree_, number(step_), p_, work_.force, work_.momentum_target); }

  /// The evaluation of the first guess in work().delta. Without effects nobody judges it (kSmoothBlock): of what start_down finds on its way
  /// nothing is asked, and a compiler leaves it out, which is a fifth of that sweep.
  Evaluated<Pack> start(const Block<Real>& block, Lanes alive) {
    const Lanes due = alive & factor_.due(block, tolerance_);
    Evaluated<Pack> now;
    couplings_.begin(step_);
    if constexpr (kEffects) {
      effects_.begin(block, step_, q_, work_);
      const Evaluation<Pack> moved = start_down(tree_, constants_, work_);
      if (!effects_->plan().ground.points.empty()) effects_->guess_points(work_.displacement);
      now = evaluated(moved, due, 0);
    } else {
      start_down(tree_, constants_, work_);
      find_gaps(due != 0 ? Asked::rows : Asked::gaps);
      if (due != 0) make_factor(due, Jacobian::first_order);
      now.norm = pass_up();
    }
    norm_ = guess_norm_ = now.norm;
    slow_ = 0;
    enough_ = number(0);
    return now;
  }

  // what solve.hpp asks
  Evaluated<Pack> evaluate(Lanes active, Lanes corrected, int round) {
    const Mask mask = L::mask(corrected);
    if (coupled() && corrected != 0) take_multipliers(mask);
    const Evaluation<Pack> moved = is_solved() ? move_down(tree_, constants_, mask, work_) : correct_down(tree_, constants_, mask, work_);
    const Pack before = norm_;
    const Evaluated<Pack> now = evaluated(moved, active & ~corrected, corrected & slow_);
    slow_ = (slow_ & ~corrected) | (corrected & ~L::bits(now.norm <= number(kWorn * kWorn) * before));
    if (round == 1) {
      factor_.first_correction(corrected, guess_norm_, now.norm, now.scale);
      enough_ = enough(guess_norm_, now.scale);
    }
    return now;
  }
  Lanes converged(const Evaluated<Pack>& now) const {
    return L::bits(within(now.norm, tolerance_squared_, now.scale)) | L::bits(now.norm <= enough_);
  }
  Lanes close(const Evaluated<Pack>&) const { return 0; }
  Lanes at_floor(const Evaluated<Pack>& now, double epsilons) const {
    Pack sum = rounding_floor_map(tree_, constants_, work_.momentum_target, work_.impulse, work_.joint_inverse);
    Lanes gaps_alone = 0;  // where nothing moves, gaps are all there is
    if (coupled()) {
      const Pack of_gaps = couplings_.rounding();
      gaps_alone = L::bits(is_rounding(now.norm, of_gaps, epsilons));
      sum = sum + of_gaps;
    }
    return gaps_alone | (L::bits(below_ceiling(now.norm, now.energy, fall())) & L::bits(is_rounding(now.norm, sum, epsilons)));
  }
  bool has_states() const {
    if constexpr (kEffects) return effects_.plan().has_states;
    return false;
  }
  Lanes update_states([[maybe_unused]] const StateUpdate<Mask>& update) {
    if constexpr (kEffects) {
      const Mask changed = effects_->update_states(work_.innovation, update, work_.delta);
      for (const Mimic& mimic : factor_.ties().mimics()) {  // where a coordinate comes to hold, its leader's row was set
        Pack& follower = work_.delta(mimic.follower_v);
        follower = select(changed, as<Pack>(mimic.multiplier) * work_.delta(mimic.leader_v), follower);
      }
      return L::bits(changed);
    }
    return 0;
  }
  Lanes refused(Lanes lanes, const Evaluated<Pack>& now) {
    if (lanes == 0) return 0;
    Lanes found = 0;
    if constexpr (kEffects) found = effects_.blows(q_, work_.delta);
    if (coupled()) found |= ~L::bits(couplings_.widest_gap() <= number(kMostOpen));
    if (couplings_.gives_way()) {
      displacement_map(tree_, work_.motion, work_.delta);
      found |= L::bits(couplings_.strays(kMostStray, step_, now.energy, work_.delta));
    }
    return lanes & found;
  }
  void put_aside([[maybe_unused]] Lanes done, [[maybe_unused]] Lanes before, [[maybe_unused]] Lanes active) {
    if constexpr (!kEffects) {
      if (active == 0 && before != 0) bring_back(before);
      if (active != 0 && done != 0) keep(done);
    }
    factor_.end(done, norm_, scale_, tolerance_);
  }

  /// The end of a step in these lanes, whose displacement in coordinates is in work().delta.
  void end([[maybe_unused]] const Block<Real>& block, Lanes done) {
    const Mask moves = L::mask(done);
    if constexpr (kEffects) {
      effects_.end(block, done, work_);
      contacts_.end(block, done);
    }
    if (couplings_.gives_way()) {
      find_gaps(Asked::rows);  // of lanes that were brought back
      couplings_.end(step_);
    }
    advance(moves);
    if (tied()) follow_leaders();
    update_momentum(moves);
    if constexpr (kEffects) effects_.add_end(constants_, moves, work_, p_);
    couplings_.add_end(moves, p_);
    fold_mimics(factor_.ties().mimics(), p_);
    if constexpr (kEffects) effects_.refresh(work_.placement, q_);
  }

  /// M^-1 of what is on the right.
  [[gnu::noinline]] void solve_mass(const Field<Pack>& right_side, Field<Pack>& rate) {
    effects_->with_rotors([&](const auto& rotors) { factor_mass(rotors); });
    apply_mass_inverse(right_side, rate);
  }
  /// Velocities that the momenta are read as, in work().increment.
  void read_velocity() {
    if constexpr (kEffects) {
      effects_->begin_reading(p_);
      couplings_.begin_reading(step_, p_);
      fold_mimics(factor_.ties().mimics(), p_);
      effects_->with_reading([&](const auto& added) { find_rate(added); });
    } else {
      couplings_.begin_reading(step_, p_);
      find_rate(NothingAdded{});
    }
    if (couplings_.gives_way()) couplings_.take_pull(p_);
  }

 private:
  /// A correction that leaves more than this of the residual calls for another factor.
  static constexpr double kWorn = 1e-2;

  /// Of a screw's motion the sweeps of a block write three numbers of seven.
  static void set_motion_identity(Field<Pack, 7>& motion) {
    for (Index i = 0; i < motion.rows(); ++i) {
      for (int k = 0; k < 7; ++k) motion(i, k) = number(k == 3 ? 1 : 0);
    }
  }

  /// Not inline: the same numbers to the bit of whatever is its own in a lane, and of the options in all.
  [[gnu::noinline]] void set_gravity(const LaneGravity<Pack>& gravity) {
    gravity_of_lanes_ = gravity;
    const auto along = [&](std::size_t k) { return of_each_lane<Pack>(gravity, [&](const std::array<double, 3>& g) { return g[k]; }); };
    gravity_ = {along(0), along(1), along(2)};
    fall_per_mass_ = of_each_lane<Pack>(gravity, [&](const std::array<double, 3>& g) { return fall_per_mass(g, step_); });
  }
  void use_gravity(const LaneGravity<Pack>& gravity) {
    has_gravity_ = true;
    set_gravity(gravity);
    if constexpr (kEffects) effects_.use_gravity(gravity);
  }

  /// Of the mass matrix, where a factor of the steps is not to be touched.
  Gains<Pack> mass_gains() { return factor_.fresh(); }

  /// What an order above 2 takes for solved, by what its first guess left.
  Pack enough(const Pack& guess, const Pack& scale) const {
    using std::min;
    return number(reduction_squared_) * min(guess, number(2 * kRoughGuess * kRoughGuess) * scale);
  }

  /// The upward half, with a factor made anew to first order in some lanes, exactly in others.
  Evaluated<Pack> evaluated(const Evaluation<Pack>& moved, Lanes first_order, Lanes exact) {
    Evaluated<Pack> now{.least_w = moved.least_w, .energy = moved.energy};
    find_gaps((first_order | exact) != 0 ? Asked::rows : Asked::gaps);
    if constexpr (kEffects) effects_.act(constants_, work_, now.energy);
    if (first_order != 0) make_factor(first_order, Jacobian::first_order);
    if (exact != 0) make_factor(exact, Jacobian::exact);
    now.norm = pass_up();
    now.scale = kEffects ? now.energy + fall() : now.energy;
    norm_ = now.norm;
    scale_ = now.scale;
    return now;
  }
  void make_factor(Lanes lanes, Jacobian jacobian) {
    const auto factor_part = [&](Slots part) {
      const auto factor = [&](const auto& added) { block_factor_up(tree_, constants_, part, work_, factor_.fresh(), jacobian, added); };
      const auto factor_tied = [&](const auto& added) { tied() ? factor(factor_.fresh_ties().held(added)) : factor(added); };
      if constexpr (kEffects) {
        effects_.with_added(factor_tied);
      } else {
        factor_tied(NothingAdded{});
      }
    };
    couplings_.up_to_closures(
        [&](Slots part) {
          factor_part(part);
          if (tied()) tie(&LaneSweeps::increments);
        },
        [&](std::size_t closure) { close(closure, Coupled::step, factor_.fresh(), L::mask(lanes)); });
    factor_.take(lanes, work_);
  }
  /// The second half of a solve: increments or rates.
  using Down = void (LaneSweeps::*)(const Gains<Pack>& gains, Slots part, Field<Pack>& x);
  /// Where joints are tied to each other, what becomes of a factor with them held.
  [[gnu::noinline]] void tie(Down down) {
    const Gains<Pack> gains = factor_.fresh();
    factor_.fresh_ties().factor(
        [&](const Field<Pack>& r, Field<Pack>& x) {
          impulses_up(gains, r, all_slots(tree_));
          (this->*down)(gains, all_slots(tree_), x);
        },
        [&](Index i) { return tied_load(tree_, constants_, gains, work_.bias, work_.variation, i); }, work_.increment);
  }
  // not inline: each is called in several places, and takes seconds to compile
  [[gnu::noinline]] void impulses_up(const Gains<Pack>& gains, const Field<Pack>& r, Slots part) {
    impulse_pass_up(tree_, constants_, work_.placement, gains, r, part, work_.bias, work_.innovation);
  }
  [[gnu::noinline]] void increments(const Gains<Pack>& gains, Slots part, Field<Pack>& x) {
    increment_down<true>(tree_, constants_, work_.placement, work_.motion, gains, work_.innovation, part, work_.variation, x);
  }
  [[gnu::noinline]] void rates(const Gains<Pack>& gains, Slots part, Field<Pack>& x) {
    rate_down(tree_, constants_, work_.placement, gains, work_.innovation, part, work_.variation, x);
  }
  template <class Added>
  [[gnu::noinline]] void find_articulated_inertias(const Added& added, Slots part) {
    articulated_inertia_up(tree_, constants_, work_.placement, part, work_.articulated, mass_gains(), added);
  }
  /// Residual and first half of a solve; of what ties joints, or bodies, all of it, the correction in work_.increment. Returns the norm.
  Pack pass_up() {
    if (coupled()) return solve_coupled();
    const Pack norm = innovation_up(tree_, constants_, work_);
    if (!tied()) return norm;
    increments({work_.gain_up, work_.gain_down, work_.joint_inverse}, all_slots(tree_), work_.increment);
    const Pack of_ties = factor_.ties().complete(work_.increment);
    fold_mimics(factor_.ties().mimics(), work_.innovation);
    return norm + of_ties;
  }
  bool tied() { return !factor_.ties().empty(); }
  bool coupled() const { return !couplings_.empty(); }
  /// Whether an evaluation finds the correction, not its first half alone.
  bool is_solved() { return tied() || coupled(); }

  // what couplings do (coupling_sweeps.hpp); not inline, as above
  [[gnu::noinline]] void find_gaps(Asked asked) { couplings_.find_gaps(work_.placement, work_.motion, work_.delta, asked); }
  [[gnu::noinline]] void close(std::size_t closure, Coupled of, const Gains<Pack>& gains, const Mask& lanes) {
    const std::array<Pack, 36> felt =
        couplings_.close(closure, of, constants_, work_.placement, of == Coupled::step ? &work_.motion : nullptr, gains, factor_.fresh_ties(), lanes);
    if (couplings_.slot_of(closure) != 0) add_inertia(couplings_.slot_of(closure), felt, work_.articulated);
  }
  /// x of r; with the factor of a step, or with that of the mass matrix.
  [[gnu::noinline]] void solve_closed(Coupled of, const Gains<Pack>& gains, MimicTies<Pack>& ties, const Field<Pack>& r, Down down, Field<Pack>& x) {
    couplings_.begin_solve(of);
    couplings_.up_to_closures([&](Slots part) { impulses_up(gains, r, part); },
                              [&](std::size_t closure) { couplings_.yield(closure, of, ties, work_.innovation, work_.bias); });
    couplings_.down_from_closures([&](Slots part) { (this->*down)(gains, part, x); },
                                  [&](std::size_t closure) { couplings_.push(closure, of, work_.variation, work_.innovation); });
    if (!ties.empty()) ties.complete(x);
  }
  /// All of a solve of a step, and the residual that it leaves in work_.innovation. Returns its norm.
  [[gnu::noinline]] Pack solve_coupled() {
    using std::abs;
    residual_up(tree_, constants_, work_.placement, work_.momentum_target, work_.impulse, work_.residual);
    fold_mimics(factor_.ties().mimics(), work_.residual);
    solve_closed(Coupled::step, {work_.gain_up, work_.gain_down, work_.joint_inverse}, factor_.ties(), work_.residual, &LaneSweeps::increments,
                 work_.increment);
    couplings_.subtract_push(work_.residual);
    fold_mimics(factor_.ties().mimics(), work_.residual);
    std::ranges::copy(work_.residual.flat(), work_.innovation.flat().begin());
    Pack norm(Real(0));
    for (Index row = 0; row < work_.residual.rows(); ++row) norm = norm + work_.residual(row) * work_.increment(row);
    return abs(norm);
  }
  [[gnu::noinline]] void take_multipliers(const Mask& lanes) {
    couplings_.apply();
    couplings_.correct(1);
    Field<Pack>* target = &work_.momentum_target;
    if constexpr (kEffects) {
      if (effects_.plan().joints) target = &effects_->plain_target();
    }
    couplings_.take_multipliers(lanes, *target);
  }

  Pack fall() const { return fall_per_mass_ * constants_.subtree_mass(0); }

  // gravity is known when these sweeps are compiled: asked in each body it costs 1.5 % of a step of humanoids
  void advance(const Mask& moves) {
    if (has_gravity_) {
      advance_down<true>(tree_, constants_, gravity_, moves, work_, q_);
    } else {
      advance_down<false>(tree_, constants_, gravity_, moves, work_, q_);
    }
    couplings_.place(work_.placement, q_);
  }
  void update_momentum(const Mask& moves) {
    const Pack h = number(step_);
    of_gravity_ = has_gravity_ ? momentum_up<true>(tree_, constants_, h, moves, applied(), work_, p_)
                               : momentum_up<false>(tree_, constants_, h, moves, applied(), work_, p_);
  }

  template <class Added>
  [[gnu::noinline]] void factor_mass(const Added& added, Coupled of = Coupled::velocities) {
    couplings_.up_to_closures(
        [&](Slots part) {
          if (!tied()) return find_articulated_inertias(added, part);
          find_articulated_inertias(factor_.fresh_ties().held(added), part);
          tie(&LaneSweeps::rates);
        },
        [&](std::size_t closure) { close(closure, of, mass_gains(), L::mask(~Lanes(0))); });
  }
  template <class Added>
  [[gnu::noinline]] void find_rate(const Added& added) {
    if (tied() || coupled()) {
      factor_mass(added, Coupled::reading);
      return apply_mass_inverse(p_, work_.increment, Coupled::reading);
    }
    const Gains<Pack> gains = mass_gains();
    mass_solve_up(tree_, constants_, work_.placement, p_, work_.articulated, gains.down, gains.inverse, work_.bias, work_.innovation, added);
    rates(gains, all_slots(tree_), work_.increment);
  }
  void apply_mass_inverse(const Field<Pack>& right_side, Field<Pack>& rate, Coupled of = Coupled::velocities) {
    solve_closed(of, mass_gains(), factor_.fresh_ties(), right_side, &LaneSweeps::rates, rate);
  }
  /// Followers to where their leaders are, without what rounding adds up to.
  void follow_leaders() {
    for (const Mimic& mimic : factor_.ties().mimics()) {
      q_(mimic.follower_q) = as<Pack>(mimic.multiplier) * q_(mimic.leader_q) + as<Pack>(mimic.offset);
    }
    place();
  }

  [[gnu::noinline]] void keep(Lanes lanes) { blend(kept_, work_, L::mask(lanes)); }
  [[gnu::noinline]] void bring_back(Lanes lanes) { blend(work_, kept_, L::mask(lanes)); }
  template <class To, class From>
  static void blend(To& to, const From& from, const Mask& lanes) {
    const auto each = [&](auto& target, const auto& source) {
      for (std::size_t k = 0; k < target.flat().size(); ++k) target.flat()[k] = select(lanes, source.flat()[k], target.flat()[k]);
    };
    each(to.motion, from.motion);
    each(to.displacement, from.displacement);
    each(to.impulse, from.impulse);
    each(to.innovation, from.innovation);
    each(to.delta, from.delta);
  }

  const Tree& tree_;
  Options options_;
  BodyConstants<EachLane<Pack>> constants_;
  bool has_gravity_ = false, has_applied_ = false;
  LaneGravity<Pack> gravity_of_lanes_;
  Vec3<Pack> gravity_;
  Pack fall_per_mass_;
  double step_;  // h [s]
  double tolerance_;
  double reduction_squared_;
  Pack enough_;  // squared energy norm of a residual that will do, beside the tolerance
  Pack tolerance_squared_;
  Pack of_gravity_;  // potential energy
  Workspace<Pack> work_;
  Kept<Pack> kept_;  // empty with effects
  Pack guess_norm_;    // of the first guess of the solve there is
  Pack norm_, scale_;  // of the last evaluation
  Lanes slow_ = 0;     // lanes in which a correction left too much
  Field<Pack> q_, p_, applied_;
  [[no_unique_address]] std::conditional_t<kEffects, LaneEffects<Pack>, NoLaneEffects> effects_;
  [[no_unique_address]] std::conditional_t<kEffects, LaneContacts<Pack>, NoLaneContacts> contacts_;
  CouplingSweeps<Pack> couplings_;
  LaneFactor<Pack> factor_;
};

}  // namespace linden
