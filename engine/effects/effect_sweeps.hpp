// engine/effects/effect_sweeps.hpp
// The effects of a scene within a step: what they keep while it is solved, and when their kernels are called.
//
//   begin            means of tables over the step; states (sticks? at its limit?) as the first guess suggests
//   +-> bodies       forces on bodies, after their momenta are known                 once an evaluation
//   |   joints       impulses of joints into the target of the residual              once an evaluation
//   |   revise       states that belong to the solution so far: did one change?      where some effect has states
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
#include "engine/effects/lane_times.hpp"
#include "engine/effects/revision.hpp"
#include "kernels/effects/armature.hpp"
#include "kernels/effects/ball_spring.hpp"
#include "kernels/effects/damping.hpp"
#include "kernels/effects/drag.hpp"
#include "kernels/effects/friction.hpp"
#include "kernels/effects/given_motion.hpp"
#include "kernels/effects/ground.hpp"
#include "kernels/effects/limits.hpp"
#include "kernels/effects/servo.hpp"
#include "kernels/effects/spring.hpp"
#include "kernels/effects/torque.hpp"
#include "kernels/effects/wrench.hpp"
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

/// Where within a step the velocity of a given motion is that with which it comes to the end: but for the rounding of times, there.
inline constexpr double kComing = 1 - 1e-6;

template <class S>
class EffectSweeps {
 public:
  EffectSweeps(const EffectPlan& plan, const Model& model) : plan_(plan), tree_(model.tree) {
    const Effects& effects = plan.effects;
    const auto rows = [](Field<S>& field, std::size_t count) { field.allocate(static_cast<Index>(count)); };
    sum_.allocate(tree_.shape);  // factors of blocks add joints and bodies whichever there are
    if (plan.joints) {
      rows(force_, effects.torques.size());
      servos_.entries = effects.servos;
      for (Field<S>* field : {&servos_.stiffness, &servos_.damping, &servos_.share, &servos_.end_share, &servos_.mode, &servos_.lead,
                              &servos_.target, &set_targets_, &gains_}) {
        rows(*field, effects.servos.size());
      }
      for (std::size_t k = 0; k < effects.servos.size(); ++k) {
        const Servo& servo = effects.servos[k];
        set_gain(static_cast<Index>(k), S(1.0));
        set_targets_(static_cast<Index>(k)) = as<S>(servo.target_moves() ? std::numeric_limits<double>::quiet_NaN() : servo.target);
      }
      frictions_.entries = effects.friction;
      rows(frictions_.mode, effects.friction.size());
      rows(frictions_.force, effects.friction.size());
      for (std::size_t k = 0; k < effects.friction.size(); ++k) {
        frictions_.force(static_cast<Index>(k)) = as<S>(effects.friction[k].force);
      }
      motions_.entries = effects.motions;
      for (Field<S>* field : {&motions_.end, &motions_.next_velocity, &motions_.velocity, &motions_.force, &motions_.steady}) {
        rows(*field, effects.motions.size());
      }
      limits_.entries = effects.limits;
      for (Field<S>* field : {&limits_.lowest, &limits_.highest, &limits_.mode}) rows(*field, effects.limits.size());
    }
    for (Field<S>* field : {&excess_, &excess_before_, &reading_, &bend_, &reading_stiffness_}) field->allocate(tree_.shape.velocities);
    if (plan.rotor.rows() > 0) {
      rotors_.allocate(plan.rotor.rows());
      for (Index row = 0; row < rotors_.rows(); ++row) rotors_(row) = as<S>(plan.rotor(row));
    }
    if (plan.bodies) {
      bodies_.allocate(tree_.shape);
      clear_bodies();
      points_.allocate({.slots = static_cast<Index>(plan.ground.points.size())});
      ground_friction_ = as<S>(plan.ground.ground.friction);
      drags_.entries = effects.drag;
      drags_.share = plan.drag_share;
      drags_.wind = {effects.wind[0], effects.wind[1], effects.wind[2]};
      rows(drags_.loss, effects.drag.size());
      wrenches_.entries = effects.wrenches;
      rows(wrenches_.scale, effects.wrenches.size());
      rows(wrenches_.work, effects.wrenches.size());
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
    const Field<S, 36>& pull = bodies_.pull;
    if (plan_.joints && plan_.bodies) return action(EffectsAdded<S, true, true>{stiffness, pull});
    if (plan_.joints) return action(EffectsAdded<S, true, false>{stiffness, pull});
    action(EffectsAdded<S, false, true>{stiffness, pull});
  }
  /// The same for the mass matrix, of which armature is the only part that is an effect.
  template <class Action>
  void with_rotors(const Action& action) const {
    if (rotors_.rows() == 0) return action(NothingAdded{});
    action(EffectsAdded<S, true, false>{rotors_, bodies_.pull});
  }
  /// And for what a blow does: a joint whose motion is given goes on as it does.
  template <class Action>
  void with_struck(const Action& action) {
    if (motions_.entries.empty()) return with_rotors(action);
    for (Index row = 0; row < reading_stiffness_.rows(); ++row) reading_stiffness_(row) = rotors_.rows() > 0 ? rotors_(row) : S(0.0);
    for (const JointMotion& motion : motions_.entries) reading_stiffness_(motion.row) = as<S>(std::numeric_limits<double>::infinity());
    action(EffectsAdded<S, true, false>{reading_stiffness_, bodies_.pull});
  }
  /// And for the mass matrix that velocities are read with, after begin_reading: a joint that is held is taken out.
  template <class Action>
  void with_reading(const Action& action) const {
    action(EffectsAdded<S, true, false>{reading_stiffness_, bodies_.pull});
  }
  /// Where momentum_target_map leaves the target that effects are taken from.
  Field<S>& plain_target() { return sum_.plain_target; }
  /// To be written between steps; not a number: the target is that of the servo's table.
  Field<S>& servo_targets() { return set_targets_; }
  Field<S>& friction_forces() { return frictions_.force; }
  /// Factor of each servo's stiffness and damping; set_gain between steps. With it goes how implicit they are taken.
  const Field<S>& gains() const { return gains_; }
  void set_gain(Index k, const S& factor) {
    using std::max;
    const auto at = static_cast<std::size_t>(k);
    const S half(0.5), one(1.0);
    const auto plain = factor == one;
    gains_(k) = factor;
    servos_.stiffness(k) = as<S>(plan_.effects.servos[at].stiffness) * factor;
    servos_.damping(k) = as<S>(plan_.effects.servos[at].damping) * factor;
    const S share = max(half, one - half / (as<S>(plan_.servo_ratio[at]) * factor));
    servos_.share(k) = select(plain, as<S>(plan_.servo_share[at]), share);
    servos_.end_share(k) = select(plain, as<S>(1 - plan_.servo_share[at]), one - share);
  }
  /// Coulomb's coefficient of the ground, to be written between steps.
  S& ground_friction() { return ground_friction_; }

  /// After placements changed. Returns the potential energy of springs and of the ground at q [J].
  S refresh(const Field<S, 12>& placement, const Field<S>& q) {
    S potential(0.0);
    if (plan_.bodies) {
      world_placement_down(tree_, placement, bodies_.pose);
      if (!plan_.ground.points.empty()) ground_potential_ = find_ground(plan_.ground, bodies_.pose, points_);
      potential = potential + ground_potential_;
    }
    if (!plan_.effects.springs.empty()) potential = potential + spring_potential(plan_.effects.springs, plan_.q_row, q);
    if (!plan_.effects.ball_springs.empty()) potential = potential + ball_spring_potential(plan_.effects.ball_springs, tree_, q);
    return potential;
  }

  /// A step from `times` on. delta: the first guess, moved into the limits. before: displacement of the step before, where it is `known`.
  /// passable: limits that joints bounce off, see limits.hpp.
  template <class Mask>
  void begin(const LaneTimes<S>& times, double step, const Field<S>& q, const Field<S>& before, const Mask& known, bool passable,
             Field<S>& delta) {
    const S h = as<S>(step);
    h_ = h;
    q_ = &q;
    creep_ = 0;
    ground_before_ = ground_potential_;
    for (Index k = 0; k < wrenches_.scale.rows(); ++k) {
      const BodyWrench& wrench = plan_.effects.wrenches[static_cast<std::size_t>(k)];
      wrenches_.scale(k) = at_each_time<S>(times, [&](double t) LINDEN_INLINE_LAMBDA { return wrench.mean_share(t, t + step); });
    }
    if (!plan_.joints) return;
    for (Index k = 0; k < force_.rows(); ++k) {
      const JointTorque& torque = plan_.effects.torques[static_cast<std::size_t>(k)];
      force_(k) = at_each_time<S>(times, [&](double t) LINDEN_INLINE_LAMBDA { return torque.force.mean(t, t + step); });
    }
    std::ranges::copy(set_targets_.flat(), servos_.target.flat().begin());
    if (plan_.servos_move) begin_servo_tables(times, step);
    std::fill(servos_.mode.flat().begin(), servos_.mode.flat().end(), S(0.0));
    begin_friction(frictions_, before, known, delta);
    begin_limits(limits_, plan_.q_row, h, q, before, known, passable, delta);
    begin_motions(h, known, motions_);
    for (Index k = 0; k < motions_.end.rows(); ++k) {
      const SmoothCurve& curve = plan_.curves[static_cast<std::size_t>(k)];
      motions_.end(k) = at_each_time<S>(times, [&](double t) LINDEN_INLINE_LAMBDA { return curve.at(t + step); });
      motions_.next_velocity(k) =
          at_each_time<S>(times, [&](double t) LINDEN_INLINE_LAMBDA { return curve.slope(t + kComing * step); });
    }
    put_motions(delta);
    assemble();
  }

  /// Where a guess is given up for another: what is given stays.
  void put_motions(Field<S>& delta) const { given_motion_map(motions_, plan_.q_row, *q_, delta); }

  /// Forces on bodies: impulse holds h mu.
  template <class Element>
  void bodies(const BodyConstants<Element>& constants, const Field<S, 7>& displacement, Field<S, 6>& impulse) {
    for (const TouchedBody& body : plan_.touched) {
      clear_body(bodies_, body.slot);
      drag_map(drags_, body.drag.first, body.drag.last, constants, h_, displacement, bodies_, impulse);
      wrench_map(wrenches_, body.wrenches.first, body.wrenches.last, h_, displacement, bodies_, impulse);
      ground_map(plan_.ground, body.points.first, body.points.last, ground_friction_, h_, creep_, displacement, points_, bodies_, impulse);
    }
  }
  /// Before the first of them: which points slide, as the first guess and the last step have it.
  void guess_points(const Field<S, 7>& displacement) {
    guess_ground(plan_.ground, h_, true, displacement, points_);
    std::ranges::copy(points_.closed.flat(), points_.factored.flat().begin());
  }

  /// The target of the residual at delta.
  void joints(const Field<S>& delta, const Field<S, 7>& motion, Field<S>& target) const {
    joint_impulses_map(sum_, delta, target);
    if (!plan_.effects.ball_springs.empty()) ball_spring_map(plan_.effects.ball_springs, tree_, h_, *q_, motion, target);
  }

  /// States that belong to the solution so far. Where the residual is small impulses that hold can be judged. delta is changed where a joint
  /// comes to rest. Of what sticks too hard all start to slide, or late that alone which does most: slower, and hardly ever in a circle.
  /// Softly only limits have states to revise. Returns in which instances something changed: the factor is out of date there.
  template <class Mask>
  auto revise(const Field<S>& residual, const Revision<Mask>& now, Field<S>& delta) {
    using std::max;
    auto changed = S(0.0) > S(1.0);
    // limits that do not settle soon are judged at the solution: nearby, what holds a light joint is lost in what the others still lack
    const Mask limits_settled = now.solved || (now.near && !now.late);
    if (soft()) return revise_limits(limits_, residual, limits_settled, now.last, delta);
    S least(0.0);
    if (any(now.late)) {
      const S overload = max(friction_overload(frictions_, h_, residual), ground_overload(points_));
      least = select(now.late, overload, least);
    }
    if (plan_.joints) {
      changed = revise_servos(servos_, plan_.q_row, h_, *q_, delta);
      changed = revise_friction(frictions_, h_, residual, now.near, least, delta) || changed;
      changed = revise_limits(limits_, residual, limits_settled, now.last, delta) || changed;
      if (any(changed)) assemble();
    }
    if (!plan_.ground.points.empty()) changed = revise_ground(points_, now.near, least) || changed;
    return changed;
  }

  /// What the next step wants to know of this one: where contact points stick and how they moved, and what velocities are read with.
  auto memory() {
    return std::array{points_.closed.flat(), points_.slides.flat(), points_.bore.flat(), points_.rise_before.flat(), points_.slip_last.flat(),
                      excess_before_.flat(), reading_.flat(), bend_.flat(), motions_.velocity.flat(), motions_.force.flat(),
                      motions_.steady.flat()};
  }
  Field<S>& excess_before() { return excess_before_; }
  Field<S>& reading() { return reading_; }
  Field<S>& bend() { return bend_; }

  /// What is kept beside the numbers of rows, EffectPlan::kept() of them: of each contact point 0 apart, 1 sticks, 2 slides, and on a terrain
  /// what it bore; of each given motion velocity, steady force and force.
  S kept(Index k) const {
    const Index count = points_.slides.rows(), ground = plan_.ground.kept(), motions = motions_.end.rows();
    if (k < count) return points_.closed(k) * (S(1.0) + points_.slides(k));
    if (k < ground) return points_.bore(k - count);
    return (*std::array{&motions_.velocity, &motions_.steady, &motions_.force}[static_cast<std::size_t>((k - ground) / motions)])((k - ground) % motions);
  }
  void set_kept(Index k, const S& number) {
    const Index count = points_.slides.rows(), ground = plan_.ground.kept(), motions = motions_.end.rows();
    if (k < count) {
      points_.closed(k) = select(number > S(0.5), S(1.0), S(0.0));
      points_.slides(k) = select(number > S(1.5), S(1.0), S(0.0));
    } else if (k < ground) {
      points_.bore(k - count) = number;
    } else {
      (*std::array{&motions_.velocity, &motions_.steady, &motions_.force}[static_cast<std::size_t>((k - ground) / motions)])((k - ground) % motions) = number;
    }
  }
  const GivenMotions<S>& motions() const { return motions_; }

  /// Friction that is smooth up to this speed, until harden. joints() then goes by delta alone.
  void soften(double creep, Field<S>& delta) {
    if (soft()) shrink_friction(frictions_, creep / creep_, delta);
    creep_ = creep;
  }
  /// Friction as it is again, from the states that the smooth one has led to.
  void harden() {
    creep_ = 0;
    if (plan_.joints) assemble();
  }
  bool soft() const { return creep_ > 0; }
  /// While soft: states by the value of delta.
  void follow(const Field<S>& delta) {
    revise_servos(servos_, plan_.q_row, h_, *q_, delta);
    guess_friction(frictions_, h_, creep_, delta);
    assemble();
  }

  /// Impulses of the beginning become those of the end, but for being seen from the new poses.
  void end_bodies(const Field<S, 12>& placement, const Field<S, 7>& displacement, Field<S, 6>& impulse) {
    const S rate = S(1.0) / h_;
    for (const TouchedBody& body : plan_.touched) {
      const auto D = load<Displacement, S>(displacement, body.slot);
      store(bodies_.uneven, body.slot, rate * carried(D, load<Wrench, S>(bodies_.uneven, body.slot)));
    }
    add_given_up(tree_, placement, bodies_.given, impulse);
    keep_ground(points_);
  }

  /// What the momenta get at the end of the step; a joint that is held leaves nothing of its residual to the next step.
  void end_joints(const Field<S>& delta, const Field<S, 7>& motion, Field<S>& residual, Field<S>& end) {
    using std::abs;
    const S half(0.5), rate = S(1.0) / h_;
    joint_impulses_end_map(sum_, h_, delta, end);
    if (!plan_.effects.ball_springs.empty()) ball_spring_end_map(plan_.effects.ball_springs, tree_, h_, *q_, motion, end);
    const S most = as<S>(std::numeric_limits<typename ElementOf<S>::type>::max()), zero(0.0);
    end_motions(residual, motions_);
    for (Index row = 0; row < end.rows(); ++row) {
      S uneven = -half * (sum_.offset(row) + sum_.end_offset(row) + (sum_.gain(row) + sum_.end_gain(row)) * delta(row));
      if (rotors_.rows() > 0) uneven = uneven + rotors_(row) * delta(row);
      const auto held = sum_.stiffness(row) > most;
      S excess = select(held, as<S>(kHeld), rate * uneven);
      if (plan_.fastest.rows() > 0) {
        // what holds a joint at its limit of velocity acts on, all of it at the beginning
        const auto at_speed = held && delta(row) != zero && abs(delta(row)) == h_ * as<S>(plan_.fastest(row));
        excess = select(at_speed, rate * (uneven + half * residual(row)), excess);
      }
      residual(row) = select(held, zero, residual(row));
      excess_(row) = excess;
    }
    for (const JointMotion& one : motions_.entries) excess_(one.row) = zero;  // what moves it is no stop
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
      std::ranges::copy(bodies_.uneven.flat(), scratch.flat().begin());
      impulse_up(tree_, constants, placement, scratch, projected);
    }
    auto stopped = zero > zero;  // a limit has stopped a joint, and changed all velocities
    for (Index row = 0; row < reading_.rows(); ++row) {
      S read = plan_.joints ? excess_(row) : zero;
      stopped = stopped || (read > most && delta(row) != zero);
      if (plan_.bodies) {
        read = select(read > most, read, read + lasting(projected(row), excess_before_(row)));
        excess_before_(row) = select(moves, projected(row), excess_before_(row));
      }
      reading_(row) = select(moves, read, reading_(row));
    }
    for (Index row = 0; plan_.bends && row < bend_.rows(); ++row) {
      const S bend = select(known && !stopped, rate * abs(delta(row) - before(row)), any);
      bend_(row) = select(moves, bend, bend_(row));
    }
    for (const JointMotion& motion : motions_.entries) {
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
    for (Index k = 0; k < motions_.end.rows(); ++k) {
      if (reading_(motions_.row(k)) > S(kMostRead)) v(motions_.row(k)) = motions_.velocity(k);
    }
  }
  /// A joint that was held is to be struck; one that was struck has come to rest.
  void release(Index row) {
    if (reading_(row) > S(kMostRead)) reading_(row) = S(0.0);
  }
  void keep_still(Index row) { reading_(row) = S(kHeld); }
  /// A blow has changed all velocities to those of these momenta.
  void read_as(const Field<S>& momentum, const Field<S>& p) {
    for (Index row = 0; row < p.rows(); ++row) reading_(row) = momentum(row) - p(row);
    for (const JointMotion& motion : motions_.entries) reading_(motion.row) = S(kHeld);
    std::ranges::fill(bend_.flat(), S(kAnyBend));
  }
  const Limits<S>& limits() const { return limits_; }
  /// What acts in the step that was solved last, until it is ended (engine/effects/step_impulses.hpp).
  const Servos<S>& servos() const { return servos_; }
  const GroundPoints<S>& points() const { return points_; }
  /// Of the ground, at the end of the last step [J].
  S ground_potential() const { return ground_potential_; }
  /// The state is another's from now on.
  void forget() {
    const auto clear = [](auto& field) { std::ranges::fill(field.flat(), S(0.0)); };
    clear(excess_before_);
    clear(reading_);
    std::ranges::fill(bend_.flat(), as<S>(kAnyBend));
    clear(points_.closed);
    clear(points_.slides);
    clear(points_.bore);
    clear(motions_.velocity);
    clear(motions_.force);
    clear(motions_.steady);
  }

  /// Work of each effect in the step that was solved last; `q` and the ground as they were at its beginning. before: displacement of the
  /// last step; `known`: it was one of these sweeps and as long as this one.
  EffectAccount account(const Field<S>& residual, const Field<S>& delta, const Field<S>& before, bool known) const {
    EffectAccount account;
    EffectWork& work = account.work;
    const auto into = [](double& sum, LeastLoss& least) {
      return [&sum, &least](Index at, double loss) {
        sum += loss;
        least.see(at, loss);
      };
    };
    if (plan_.joints) {
      damping_loss(plan_.effects.damping, plan_.damping_share, h_, delta, before, into(work.damping, account.damping));
      friction_loss(frictions_, h_, residual, delta, before, into(work.friction, account.friction));
      limit_loss(limits_, h_, residual, delta, before, into(work.limits, account.limits));
      work.servo = servo_work(servos_, plan_.q_row, h_, *q_, delta, before);
      work.torque = torque_work(plan_.effects.torques, force_, delta);
      work.motion = motion_work(motions_, h_, residual, delta, before);
    }
    if (plan_.bodies) {
      const auto drag = into(work.drag, account.drag);
      for (Index k = 0; k < drags_.loss.rows(); ++k) drag(drags_.entries[static_cast<std::size_t>(k)].slot, drags_.loss(k));
      for (Index k = 0; k < wrenches_.work.rows(); ++k) work.wrench += wrenches_.work(k);
      const auto ground = into(work.ground, account.ground);
      ground_work(plan_.ground, known, points_, [&](Index slot, double given) { ground(slot, -given); });
    }
    return account;
  }
  /// Its kernels by their names in the schedule (sweeps.hpp), to be measured one by one in a step that has been evaluated: visit(name,
  /// call). What the calls write is of no use.
  template <class Element, class Visit>
  void each_kernel(const BodyConstants<Element>& constants, const Field<S>& q, Workspace<S>& work, Field<S>& end, const Visit& visit) {
    const Effects& effects = plan_.effects;
    const auto on = [&](bool any, const char* name, auto call) {
      if (any) visit(name, std::move(call));
    };
    const bool points = !plan_.ground.points.empty();
    on(!effects.motions.empty(), "given_motion_map", [=, this, &work] { put_motions(work.delta); });
    on(!effects.limits.empty(), "begin_limits", [=, this, &q, &work] { begin_limits(limits_, plan_.q_row, h_, q, work.delta, true, false, work.delta); });
    on(!effects.friction.empty(), "begin_friction", [=, this, &work] { begin_friction(frictions_, work.delta, true, work.delta); });
    on(!effects.armature.empty(), "armature_map", [=, this] { armature_map(plan_.effects.armature, sum_); });
    on(!effects.springs.empty(), "spring_map", [=, this, &q] { spring_map(plan_.effects.springs, plan_.q_row, h_, q, sum_); });
    on(!effects.ball_springs.empty(), "ball_spring_stiffness",
       [=, this] { ball_spring_stiffness(plan_.effects.ball_springs, tree_, h_, sum_); });
    on(!effects.damping.empty(), "damping_map", [=, this] { damping_map(plan_.effects.damping, plan_.damping_share, h_, sum_); });
    on(!effects.torques.empty(), "torque_map", [=, this] { torque_map(plan_.effects.torques, force_, h_, sum_); });
    on(!effects.servos.empty(), "servo_map", [=, this, &q] { servo_map(servos_, plan_.q_row, h_, q, sum_); });
    on(!effects.friction.empty(), "friction_map", [=, this] { friction_map(frictions_, h_, 0.0, sum_); });
    const auto on_bodies = [=, this](auto call) {
      return [=, this] {
        for (const TouchedBody& body : plan_.touched) call(body);
      };
    };
    on(!effects.drag.empty(), "drag_map", on_bodies([this, &constants, &work](const TouchedBody& body) {
         drag_map(drags_, body.drag.first, body.drag.last, constants, h_, work.displacement, bodies_, work.impulse);
       }));
    on(!effects.wrenches.empty(), "wrench_map", on_bodies([this, &work](const TouchedBody& body) {
         wrench_map(wrenches_, body.wrenches.first, body.wrenches.last, h_, work.displacement, bodies_, work.impulse);
       }));
    on(points, "ground_map", on_bodies([this, &work](const TouchedBody& body) {
         ground_map(plan_.ground, body.points.first, body.points.last, ground_friction_, h_, 0.0, work.displacement, points_, bodies_, work.impulse);
       }));
    on(plan_.joints, "joint_impulses_map", [=, this, &work] { joint_impulses_map(sum_, work.delta, work.momentum_target); });
    on(!effects.ball_springs.empty(), "ball_spring_map",
       [=, this, &q, &work] { ball_spring_map(plan_.effects.ball_springs, tree_, h_, q, work.motion, work.momentum_target); });
    on(!effects.servos.empty(), "revise_servos", [=, this, &q, &work] { revise_servos(servos_, plan_.q_row, h_, q, work.delta); });
    on(!effects.friction.empty(), "revise_friction",
       [=, this, &work] { revise_friction(frictions_, h_, work.innovation, true, S(0.0), work.delta); });
    on(!effects.limits.empty(), "revise_limits", [=, this, &work] { revise_limits(limits_, work.innovation, true, false, work.delta); });
    on(points, "revise_ground", [=, this] { revise_ground(points_, true, S(0.0)); });
    on(plan_.joints, "joint_impulses_end_map", [=, this, &work, &end] { joint_impulses_end_map(sum_, h_, work.delta, end); });
    on(plan_.bodies, "add_given_up", [=, this, &work] { add_given_up(tree_, work.placement, bodies_.given, work.impulse); });
    on(plan_.bodies, "world_placement_down", [=, this, &work] { world_placement_down(tree_, work.placement, bodies_.pose); });
    on(points, "find_ground", [=, this] { find_ground(plan_.ground, bodies_.pose, points_); });
    on(true, "end_reading",
       [=, this, &constants, &work, &end] { end_reading(constants, work.placement, S(0.0) < S(1.0), work.delta, work.delta, S(0.0) < S(1.0), work.impulse, end); });
  }
  /// Taken from the work of the ground once the potential at the end is known.
  S ground_stored() const { return ground_potential_ - ground_before_; }

 private:
  void begin_servo_tables(const LaneTimes<S>& times, double step) {
    for (Index k = 0; k < servos_.mode.rows(); ++k) {
      const Servo& servo = plan_.effects.servos[static_cast<std::size_t>(k)];
      servos_.lead(k) = at_each_time<S>(times, gains_(k), [&](double t, double gain) LINDEN_INLINE_LAMBDA {
        return gain * servo.damping * servo.target_velocity.mean(t, t + step) + servo.feedforward.mean(t, t + step);
      });
      if (!servo.target_moves()) continue;
      const double ratio = plan_.servo_ratio[static_cast<std::size_t>(k)];
      const S moving = at_each_time<S>(times, gains_(k), [&](double t, double gain) LINDEN_INLINE_LAMBDA {
        const double gone = 2 * begin_share(gain * ratio) - 1;
        return servo.target_over_time.mean(t + gone * step, t + step);
      });
      const S& given = set_targets_(k);
      servos_.target(k) = select(given == given, given, moving);
    }
  }

  /// sum_ from all effects in their states.
  void assemble() {
    clear(sum_);
    const Effects& effects = plan_.effects;
    armature_map(effects.armature, sum_);
    spring_map(effects.springs, plan_.q_row, h_, *q_, sum_);
    ball_spring_stiffness(effects.ball_springs, tree_, h_, sum_);
    damping_map(effects.damping, plan_.damping_share, h_, sum_);
    torque_map(effects.torques, force_, h_, sum_);
    servo_map(servos_, plan_.q_row, h_, *q_, sum_);
    friction_map(frictions_, h_, creep_, sum_);
    if (creep_ == 0) hold_friction(frictions_, sum_);
    hold_limits(limits_, sum_);
    hold_motions(motions_, sum_);
  }
  void clear_bodies() {
    for (Index i = 0; i < tree_.shape.slots; ++i) clear_body(bodies_, i);
  }

  const EffectPlan& plan_;
  const Tree& tree_;
  S h_{};
  double creep_ = 0;
  Field<S> excess_;            // what acts at the beginning of the step more than at its end, half of it; kHeld where a joint is held
  Field<S> excess_before_;     // the same of bodies, seen from the joints, of the step before
  Field<S> reading_;           // what velocities are read from beside p; kHeld where a joint is held
  Field<S> bend_;              // how far a velocity may be from the mean one of the last step
  Field<S> reading_stiffness_;
  const Field<S>* q_ = nullptr;
  Field<S> rotors_;  // armature of every row; no rows without
  JointImpulses<S> sum_;
  Servos<S> servos_;
  Field<S> set_targets_;  // of each servo, from outside; not a number where its table says
  Field<S> gains_;        // likewise: factor of its stiffness and damping
  Frictions<S> frictions_;
  Limits<S> limits_;
  GivenMotions<S> motions_;
  Field<S> force_;  // of each given torque
  BodyImpulses<S> bodies_;
  GroundPoints<S> points_;
  S ground_friction_ = S(0.0);
  Drags<S> drags_;
  Wrenches<S> wrenches_;
  S ground_potential_ = S(0.0), ground_before_ = S(0.0);
};

}  // namespace linden
