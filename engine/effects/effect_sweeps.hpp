// engine/effects/effect_sweeps.hpp
// The effects of a scene within a step: what they keep while it is solved, and when their kernels are called.
//
//   begin            means of tables over the step; states (sticks? at its limit?) as the first guess suggests
//   +-> bodies       forces on bodies, after their momenta are known                 once an evaluation
//   |   joints       impulses of joints into the target of the residual              once an evaluation
//   |   update_states       states that belong to the solution so far: did one change?      where some effect has states
//   +-- until none changes and the residual is small
//   end              impulses of the end of the step, work of each effect
//
// S is double, or a pack of W instances.
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

#include "engine/effects/effect_plan.hpp"
#include "engine/effects/effect_work.hpp"
#include "kernels/effects/law.hpp"
#include "kernels/effects/laws.hpp"
#include "kernels/tree/articulated.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/world_placement_down.hpp"
#include "layout/workspace.hpp"

namespace linden {

/// In the place of an impulse: the joint is held, its velocity zero. Anything above kMostRead says so.
inline constexpr double kHeld = 1e36, kMostRead = 1e35;

/// A velocity that is read is no farther from the mean one of the step that ended than this many times what that one differs from the mean
/// of the step before it. Half as much is what a steady acceleration makes.
inline constexpr double kMostBend = 1.5;

/// What becomes of a joint that a limit has stopped within a step: it rests there, or is struck there next (blows.hpp), and so let go of.
enum class Stopped : unsigned char { rests, struck };

template <class S>
class EffectSweeps {
 public:
  EffectSweeps(const EffectPlan& plan, const Model& model)
      : plan_(plan),
        tree_(model.tree),
        joint_laws_(laws_of<JointLaws<S>>(plan.setup(model.tree))),
        body_laws_(laws_of<BodyLaws<S>>(plan.setup(model.tree))) {
    sum_.allocate(tree_.shape);  // factors of blocks add joints and bodies whichever there are
    for (Field<S>* field : {&excess_, &excess_before_, &reading_, &bend_, &reading_stiffness_}) field->allocate(tree_.shape.velocities);
    if (plan.pairs) between_.allocate(tree_.shape.velocities, as<S>(0.0));
    if (plan.rotor.rows() > 0) {
      rotors_.allocate(plan.rotor.rows());
      for (Index row = 0; row < rotors_.rows(); ++row) rotors_(row) = as<S>(plan.rotor(row));
    }
    if (plan.bodies) {
      bodies_.allocate(tree_.shape);
      clear_bodies();
    }
  }
  EffectSweeps(const EffectSweeps&) = delete;
  EffectSweeps& operator=(const EffectSweeps&) = delete;

  const EffectPlan& plan() const { return plan_; }
  /// What joints are given, and bodies, for the factors.
  const JointImpulses<S>& joint_sum() const { return sum_; }
  const BodyImpulses<S>& body_sum() const { return bodies_; }
  /// action(added): what a factor has added to it, whatever acts.
  template <class Action>
  void with_added(const Action& action) const {
    const Field<S>& stiffness = sum_.stiffness;
    const Field<S, 36>& body_stiffness = bodies_.body_stiffness;
    if (plan_.joints && plan_.bodies) return action(EffectsAdded<S, true, true>{stiffness, body_stiffness});
    if (plan_.bodies) return action(EffectsAdded<S, false, true>{stiffness, body_stiffness});
    action(EffectsAdded<S, true, false>{stiffness, body_stiffness});  // where all acts between bodies, zeros
  }
  /// The same for the mass matrix, of which armature is the only part that is an effect.
  template <class Action>
  void with_rotors(const Action& action) const {
    if (rotors_.rows() == 0) return action(NothingAdded{});
    action(EffectsAdded<S, true, false>{rotors_, bodies_.body_stiffness});
  }
  /// And for the mass matrix that velocities are read with, after begin_reading, or that a blow is found with, after begin_blow: joints that
  /// are held are taken out.
  template <class Action>
  void with_reading(const Action& action) const {
    action(EffectsAdded<S, true, false>{reading_stiffness_, bodies_.body_stiffness});
  }
  /// Where momentum_target_map leaves the target that effects are taken from.
  Field<S>& plain_target() { return sum_.plain_target; }
  /// What is written between steps: targets, gains, friction of joints and of the ground (servo.hpp, friction.hpp, ground_law.hpp).
  Field<S>& servo_targets() { return law<ServoLaw<S>>().targets(); }
  Field<S>& friction_forces() { return law<FrictionLaw<S>>().forces(); }
  const Field<S>& gains() const { return law<ServoLaw<S>>().gains(); }
  void set_gain(Index k, const S& factor) { law<ServoLaw<S>>().set_gain(k, factor); }
  S& ground_friction() { return std::get<GroundLaw<S>>(body_laws_).own().mu; }
  const S& ground_friction() const { return ground().own().mu; }
  /// Gravity is another than that of the options.
  void use_gravity(const LaneGravity<S>& gravity) {
    std::get<GroundLaw<S>>(body_laws_).own().least_load =
        of_each_lane<S>(gravity, [&](const std::array<double, 3>& g) { return plan_.least_load(g); });
  }

  /// After placements changed. Returns the potential energy of springs and of the ground at q [J].
  S refresh(const Field<S, 12>& placement, const Field<S>& q) {
    S potential(0.0);
    if (plan_.bodies) {
      world_placement_down(tree_, placement, bodies_.pose);
      each_law(body_laws_, [&]<class Law>(Law& law) LINDEN_INLINE_LAMBDA {
        if constexpr (Law::facts.stores) potential = potential + law.place(bodies_.pose);
      });
    }
    const JointsView<S> at{q, plan_.q_row, tree_};
    each_law(joint_laws_, [&]<class Law>(const Law& law) LINDEN_INLINE_LAMBDA {
      if constexpr (Law::facts.stores) {
        S sum(0.0);
        for (const auto& entry : law.entries()) sum = sum + Law::potential(entry, at);
        potential = potential + sum;
      }
    });
    return potential;
  }

  /// A step of this length from these positions, before anything of it.
  void set_out(double step, const Field<S>& q) {
    h_ = as<S>(step);
    q_ = &q;
    stiction_speed_ = 0;
  }
  /// A step from `times` on. delta: the first guess, moved into the limits. before: displacement of the step before, where it is `known`.
  /// passable: limits that joints bounce off, see limits.hpp.
  void begin(const LaneTimes<S>& times, double step, const Field<S>& q, const Field<S>& before, const MaskOf<S>& known, bool passable,
             Field<S>& delta) {
    set_out(step, q);
    const StepStart<S> start{times, step, before, known, passable};
    each_law(body_laws_, [&](auto& law) LINDEN_INLINE_LAMBDA { law.begin(start); });
    if (!plan_.joints) return;
    const StepView<S> view = this->view();
    each_law(joint_laws_, [&](auto& law) LINDEN_INLINE_LAMBDA { law.begin(view, start, delta); });
    assemble();
  }

  /// Where a guess is given up for another: what is given stays.
  void put_motions(Field<S>& delta) const { law<MotionLaw<S>>().put(view(), delta); }

  /// Forces on bodies: impulse holds h mu.
  template <class Element>
  void bodies(const BodyConstants<Element>& constants, const Field<S, 7>& displacement, Field<S, 6>& impulse) {
    const StepView<S> view = this->view();
    for (const LoadedBody& body : plan_.loaded_bodies) {
      clear_body(bodies_, body.slot);
      auto range = body.ranges.begin();
      const auto add = [&](auto& law) LINDEN_INLINE_LAMBDA {
        if (range->first < range->last) law.add(view, constants, range->first, range->last, displacement, bodies_, impulse);
        ++range;
      };
      std::apply([&](auto&... law) LINDEN_INLINE_LAMBDA { (add(law), ...); }, body_laws_);
    }
  }
  /// Before the first of them: which points slide, as the first guess and the last step have it.
  void guess_points(const Field<S, 7>& displacement) { std::get<GroundLaw<S>>(body_laws_).guess(h_, displacement); }

  /// The target of the residual at delta.
  void joints(const Field<S>& delta, const Field<S, 7>& motion, Field<S>& target) const {
    joint_impulses_map(sum_, delta, target);
    evaluate(motion, target);
  }
  /// Of it what is not affine in delta; and the same of what the momenta get at the end of the step.
  void evaluate(const Field<S, 7>& motion, Field<S>& target) const {
    const StepView<S> view = this->view();
    each_law(joint_laws_, [&](const auto& law) LINDEN_INLINE_LAMBDA { law.evaluate(view, motion, target); });
  }
  void evaluate_end(const Field<S, 7>& motion, Field<S>& end) const {
    const StepView<S> view = this->view();
    each_law(joint_laws_, [&](const auto& law) LINDEN_INLINE_LAMBDA { law.end(view, motion, end); });
  }

  /// States that belong to the solution so far. Where the residual is small impulses that hold can be judged. delta is changed where a joint
  /// comes to rest. Of what sticks too hard all start to slide, or late that alone which does most: slower, and hardly ever in a circle.
  /// Softly only limits have states to update_states. Returns in which instances something changed: the factor is out of date there.
  MaskOf<S> update_states(const Field<S>& residual, const StateUpdate<MaskOf<S>>& now, Field<S>& delta) {
    using std::max;
    const StepView<S> view = this->view();
    auto changed = S(0.0) > S(1.0);
    S least(0.0);
    if (!is_regularized() && any(now.late)) {
      S overload(0.0);
      const auto see = [&](const auto& law) LINDEN_INLINE_LAMBDA { overload = max(overload, law.overload(view, residual)); };
      each_law(joint_laws_, see);
      each_law(body_laws_, see);
      least = select(now.late, overload, least);
    }
    each_law(joint_laws_, [&]<class Law>(Law& law) LINDEN_INLINE_LAMBDA {
      if constexpr (Law::facts.has_states) {
        if (!(is_regularized() && Law::kFollows)) changed = law.update_states(view, now, least, residual, delta) || changed;
      }
    });
    if (is_regularized()) return changed;
    if (plan_.joints && any(changed)) assemble();
    each_law(body_laws_, [&]<class Law>(Law& law) LINDEN_INLINE_LAMBDA {
      if constexpr (Law::facts.has_states) changed = law.update_states(view, now, least, residual, delta) || changed;
    });
    return changed;
  }

  /// What the next step wants to know of this one: what laws keep, and what velocities are read with.
  auto memory() {
    const auto of_laws = [](auto&... law) { return std::tuple_cat(law.memory()...); };
    return std::apply([](const auto&... numbers) { return std::array{numbers...}; },
                      std::tuple_cat(std::apply(of_laws, body_laws_), std::tuple(excess_before_.flat(), reading_.flat(), bend_.flat()),
                                     std::apply(of_laws, joint_laws_)));
  }
  Field<S>& excess_before() { return excess_before_; }
  Field<S>& reading() { return reading_; }
  Field<S>& bend() { return bend_; }

  /// What is kept beside the numbers of rows, EffectPlan::kept() of them: what each law keeps, those of bodies before those of joints.
  S kept(Index k) const {
    S number(0.0);
    with_kept(*this, k, [&](const auto& law, Index at) { number = law.kept(at); });
    return number;
  }
  void set_kept(Index k, const S& number) {
    with_kept(*this, k, [&](auto& law, Index at) { law.set_kept(at, number); });
  }
  const GivenMotions<S>& motions() const { return law<MotionLaw<S>>().motions(); }

  /// Friction that is smooth up to this speed, until end_regularization. joints() then goes by delta alone.
  void regularize(double stiction_speed, Field<S>& delta) {
    if (is_regularized()) each_law(joint_laws_, [&](const auto& law) { law.regularize(stiction_speed / stiction_speed_, delta); });
    stiction_speed_ = stiction_speed;
  }
  /// Friction as it is again, from the states that the smooth one has led to.
  void end_regularization() {
    stiction_speed_ = 0;
    if (plan_.joints) assemble();
  }
  bool is_regularized() const { return stiction_speed_ > 0; }
  /// While soft: states by the value of delta.
  void follow(const Field<S>& delta) {
    const StepView<S> view = this->view();
    each_law(joint_laws_, [&](auto& law) { law.follow(view, delta); });
    assemble();
  }

  void end_bodies(const Field<S, 12>& placement, const Field<S, 7>& displacement, Field<S, 6>& impulse) {
    add_ends(placement, displacement, impulse);
    each_law(body_laws_, [](auto& law) LINDEN_INLINE_LAMBDA { law.keep(); });
  }
  /// Impulses of the beginning become those of the end, but for being seen from the new poses.
  void add_ends(const Field<S, 12>& placement, const Field<S, 7>& displacement, Field<S, 6>& impulse) {
    const S rate = S(1.0) / h_;
    for (const LoadedBody& body : plan_.loaded_bodies) {
      const auto D = load<Displacement, S>(displacement, body.slot);
      store(bodies_.start_excess, body.slot, rate * carried(D, load<Wrench, S>(bodies_.start_excess, body.slot)));
    }
    add_given_up(tree_, placement, bodies_.applied, impulse);
  }

  /// What the momenta get at the end of the step; a joint that is held leaves nothing of its residual to the next step.
  void end_joints(const Field<S>& delta, const Field<S, 7>& motion, Stopped stopped, Field<S>& residual, Field<S>& end) {
    using std::abs;
    const S farthest = as<S>(stopped == Stopped::struck ? kAtLimit : std::numeric_limits<double>::infinity());
    const S half(0.5), rate = S(1.0) / h_;
    joint_impulses_end_map(sum_, h_, delta, end);
    evaluate_end(motion, end);
    const S most = as<S>(std::numeric_limits<typename ElementOf<S>::type>::max()), zero(0.0);
    each_law(joint_laws_, [&](auto& law) LINDEN_INLINE_LAMBDA { law.keep(residual); });
    for (Index row = 0; row < end.rows(); ++row) {
      S start_excess = -half * (sum_.offset(row) + sum_.end_offset(row) + (sum_.gain(row) + sum_.end_gain(row)) * delta(row));
      if (rotors_.rows() > 0) start_excess = start_excess + rotors_(row) * delta(row);
      const auto held = sum_.stiffness(row) > most;
      S excess = select(held && abs(delta(row)) <= farthest, as<S>(kHeld), rate * start_excess);
      if (plan_.fastest.rows() > 0) {
        // what holds a joint at its limit of velocity acts on, all of it at the beginning
        const auto at_speed = held && delta(row) != zero && abs(delta(row)) == h_ * as<S>(plan_.fastest(row));
        excess = select(at_speed, rate * (start_excess + half * residual(row)), excess);
      }
      residual(row) = select(held, zero, residual(row));
      excess_(row) = excess;
    }
    for (const JointMotion& one : motions().entries) excess_(one.row) = zero;  // what moves it is no stop
  }

  /// Before end_reading: half of what lasted between bodies, all of which acts at the beginning of steps; none.
  void add_to_reading(std::span<const double> lasting) {
    for (Index row = 0; row < between_.rows(); ++row) between_(row) = lasting.empty() ? S(0.0) : as<S>(lasting[static_cast<std::size_t>(row)]);
  }
  /// At the end of a step, once the bodies are where it leaves them: what velocities are read from beside p (engine/VELOCITY.md).
  /// `moves`: in which instances. before: displacement of the step before, as long as this one, where that is `known`. scratch, projected:
  /// 6 x n, nv.
  template <class Element, class Mask>
  void end_reading(const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Mask& moves, const Field<S>& delta,
                   const Field<S>& before, const Mask& known, Field<S, 6>& scratch, Field<S>& projected) {
    using std::abs;
    const S most = as<S>(kMostRead), zero(0.0), rate = as<S>(kMostBend) / h_, any = as<S>(kAnyBend);
    if (plan_.bodies) {
      std::ranges::copy(bodies_.start_excess.flat(), scratch.flat().begin());
      impulse_up(tree_, constants, placement, scratch, projected);
    }
    auto stopped = zero > zero;  // a limit has stopped a joint, and changed all velocities
    for (Index row = 0; row < reading_.rows(); ++row) {
      S read = plan_.joints ? excess_(row) : zero;
      stopped = stopped || (read > most && delta(row) != zero);
      if (plan_.bodies) {
        read = select(read > most, read, read + persistent(projected(row), excess_before_(row)));
        excess_before_(row) = select(moves, projected(row), excess_before_(row));
      }
      if (plan_.pairs) read = select(read > most, read, read + between_(row));
      reading_(row) = select(moves, read, reading_(row));
    }
    for (Index row = 0; plan_.bends && row < bend_.rows(); ++row) {
      const S bend = select(known && !stopped, rate * abs(delta(row) - before(row)), any);
      bend_(row) = select(moves, bend, bend_(row));
    }
    for (const JointMotion& motion : motions().entries) {
      reading_(motion.row) = select(moves, as<S>(kHeld), reading_(motion.row));
      bend_(motion.row) = any;
    }
  }
  /// A velocity that was read so, no farther from the mean one of the last step than the motion bends, and no faster than a limit
  /// of velocity lets it be.
  LINDEN_INLINE S within_bend(Index row, const S& velocity, const S& mean) const {
    using std::max;
    using std::min;
    const S v = min(max(velocity, mean - bend_(row)), mean + bend_(row));
    if (plan_.fastest.rows() == 0) return v;
    const S fastest = as<S>(plan_.fastest(row));
    return min(max(v, -fastest), fastest);
  }
  /// Prepares with_reading for a blow: joints whose motion is given go on as they do; others are held one by one.
  void begin_blow() {
    for (Index row = 0; row < reading_stiffness_.rows(); ++row) reading_stiffness_(row) = rotors_.rows() > 0 ? rotors_(row) : S(0.0);
    for (const JointMotion& motion : motions().entries) hold_in_blow(motion.row);
  }
  void hold_in_blow(Index row) { reading_stiffness_(row) = as<S>(std::numeric_limits<double>::infinity()); }
  /// Adds to p what velocities are read from beside it, and prepares with_reading.
  void begin_reading(Field<S>& p) {
    const S most = as<S>(kMostRead), zero(0.0), infinite = as<S>(std::numeric_limits<double>::infinity());
    for (Index row = 0; row < p.rows(); ++row) {
      const auto held = reading_(row) > most;
      p(row) = p(row) + select(held, zero, reading_(row));
      reading_stiffness_(row) = select(held, infinite, rotors_.rows() > 0 ? rotors_(row) : zero);
    }
  }
  /// Velocities of joints whose motion is given, all others zero; none is known of a start.
  void given_velocities(Field<S>& v) const {
    std::ranges::fill(v.flat(), S(0.0));
    const GivenMotions<S>& given = motions();
    for (Index k = 0; k < given.end.rows(); ++k) {
      if (reading_(given.row(k)) > S(kMostRead)) v(given.row(k)) = given.velocity(k);
    }
  }
  /// A joint that was struck has come to rest.
  void keep_still(Index row) { reading_(row) = S(kHeld); }
  /// Velocities have changed at once: nothing is known of how the motion bends.
  void forget_bends() { std::ranges::fill(bend_.flat(), S(kAnyBend)); }
  /// A blow has changed all velocities to those of these momenta.
  void read_as(const Field<S>& momentum, const Field<S>& p) {
    for (Index row = 0; row < p.rows(); ++row) reading_(row) = momentum(row) - p(row);
    for (const JointMotion& motion : motions().entries) reading_(motion.row) = S(kHeld);
    forget_bends();
  }
  const Limits<S>& limits() const { return law<LimitsLaw<S>>().limits(); }
  /// What acts in the step that was solved last, until it is ended (engine/effects/step_impulses.hpp).
  const Servos<S>& servos() const { return law<ServoLaw<S>>().servos(); }
  const GroundPoints<S>& points() const { return ground().points(); }
  /// Of the ground, at the end of the last step [J].
  S ground_potential() const { return ground().potential(); }
  /// The state is another's from now on.
  void forget() {
    const auto forgets = [](auto& law) { law.forget(); };
    each_law(body_laws_, forgets);
    each_law(joint_laws_, forgets);
    for (Field<S>* field : {&excess_before_, &reading_}) std::ranges::fill(field->flat(), S(0.0));
    std::ranges::fill(bend_.flat(), as<S>(kAnyBend));
  }

  /// Work of each effect in the step that was solved last; `q` and the ground as they were at its beginning. before: displacement of the
  /// last step; `known`: it was one of these sweeps and as long as this one.
  EffectAccount account(const Field<S>& residual, const Field<S>& delta, const Field<S>& before, bool known) const {
    EffectAccount account;
    const StepView<S> view = this->view();
    const SolvedStep<S> solved{residual, delta, before, known};
    const auto book = [&]<class Law>(const Law& law) LINDEN_INLINE_LAMBDA {
      if constexpr (Law::facts.account != Account::none) {
        using Entry = typename Law::Entry;
        double& sum = account.work.template of<Entry>();
        LeastLoss& least = account.least[kListOf<Entry>];
        law.account(view, solved, [&](Index at, double energy) {
          sum += energy;
          if constexpr (Law::facts.account == Account::taken) least.see(at, energy);
        });
      }
    };
    each_law(joint_laws_, book);
    each_law(body_laws_, book);
    return account;
  }
  /// All that a step has of it, for who runs one sweep by sweep (engine/sweeps/schedule.hpp).
  struct Parts {
    JointLaws<S>& joint_laws;
    BodyLaws<S>& body_laws;
    JointImpulses<S>& joints;
    BodyImpulses<S>& bodies;
  };
  Parts parts() { return {joint_laws_, body_laws_, sum_, bodies_}; }
  /// The step that was set out.
  StepView<S> view() const { return {{*q_, plan_.q_row, tree_}, h_, stiction_speed_}; }
  /// Taken from the work of the ground once the potential at the end is known.
  S ground_stored() const { return ground().stored(); }

 private:
  template <class Law>
  Law& law() {
    return std::get<Law>(joint_laws_);
  }
  template <class Law>
  const Law& law() const {
    return std::get<Law>(joint_laws_);
  }
  const GroundLaw<S>& ground() const { return std::get<GroundLaw<S>>(body_laws_); }

  /// sum_ from all effects in their states.
  void assemble() {
    clear(sum_);
    const StepView<S> view = this->view();
    each_law(joint_laws_, [&](const auto& law) LINDEN_INLINE_LAMBDA { law.add(view, sum_); });
  }

  /// action(law, k) of the law that keeps the number, with its place among those of the law.
  template <class Self, class Action>
  static void with_kept(Self& self, Index k, const Action& action) {
    const LawSetup setup = self.plan_.setup(self.tree_);
    const auto look = [&](auto& law) {
      const Index count = law.kept_numbers(setup);
      if (k >= 0 && k < count) action(law, k);
      k -= count;
    };
    each_law(self.body_laws_, look);
    each_law(self.joint_laws_, look);
  }

  void clear_bodies() {
    for (Index i = 0; i < tree_.shape.slots; ++i) clear_body(bodies_, i);
  }

  const EffectPlan& plan_;
  const Tree& tree_;
  S h_{};
  double stiction_speed_ = 0;
  Field<S> between_;           // see add_to_reading; no rows where nothing acts between bodies
  Field<S> excess_;            // what acts at the beginning of the step more than at its end, half of it; kHeld where a joint is held
  Field<S> excess_before_;     // the same of bodies, seen from the joints, of the step before
  Field<S> reading_;           // what velocities are read from beside p; kHeld where a joint is held
  Field<S> bend_;              // how far a velocity may be from the mean one of the last step
  Field<S> reading_stiffness_;
  const Field<S>* q_ = nullptr;
  Field<S> rotors_;  // armature of every row; no rows without
  JointImpulses<S> sum_;
  BodyImpulses<S> bodies_;
  JointLaws<S> joint_laws_;
  BodyLaws<S> body_laws_;
};

}  // namespace linden
