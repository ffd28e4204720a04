// engine/effects/lane_effects.hpp
// The effects of a block of instances: what a step of lanes asks of effect_sweeps.hpp, with what is each instance's own - time, targets,
// gains, friction, how its contact points ended the last step.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/effects/effect_controls.hpp"
#include "engine/effects/no_effects.hpp"
#include "engine/solve/block_stepper.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/values/lanes_of.hpp"
#include "layout/packed_history.hpp"

namespace linden {

template <class Pack>
class LaneEffects {
 public:
  using Real = typename ElementOf<Pack>::type;
  using L = LanesOf<Pack>;
  using Mask = typename L::Mask;
  static constexpr int W = L::count;

  explicit LaneEffects(const BlockSetup<Real>& setup) : tree_(setup.model.tree), sweeps_(setup.plan, setup.model) {
    end_.allocate(tree_.shape.velocities);
    before_.allocate(tree_.shape.velocities);
  }
  EffectSweeps<Pack>* operator->() { return &sweeps_; }
  void use_gravity(const LaneGravity<Pack>& gravity) { sweeps_.use_gravity(gravity); }
  const EffectPlan& plan() const { return sweeps_.plan(); }

  void load(const Block<Real>& block) {
    const auto load = [](const Real* from, Field<Pack>& to) {
      for (Index k = 0; from != nullptr && k < to.rows(); ++k) to(k) = L::load(from + k * W);
    };
    load(block.targets, sweeps_.servo_targets());
    load(block.frictions, sweeps_.friction_forces());
    for (Index k = 0; block.gains != nullptr && k < sweeps_.gains().rows(); ++k) sweeps_.set_gain(k, L::load(block.gains + k * W));
    if (block.ground_friction != nullptr) sweeps_.ground_friction() = L::load(block.ground_friction);
    load(block.excess_before, sweeps_.excess_before());
    load(block.reading, sweeps_.reading());
    load(block.bend, sweeps_.bend());
    for (Index k = 0; block.kept != nullptr && k < sweeps_.plan().kept(); ++k) {
      sweeps_.set_kept(k, L::load(block.kept + k * W));
    }
  }
  void store(const Block<Real>& block) {
    for (Index row = 0; row < end_.rows(); ++row) {
      L::store(sweeps_.excess_before()(row), block.excess_before + row * W);
      L::store(sweeps_.reading()(row), block.reading + row * W);
      L::store(sweeps_.bend()(row), block.bend + row * W);
    }
  }

  /// Returns the potential energy of springs and ground.
  Pack refresh(const Field<Pack, 12>& placement, const Field<Pack>& q) { return sweeps_.refresh(placement, q); }

  /// After the first guess. Lanes are each at their own time.
  void begin(const Block<Real>& block, double h, const Field<Pack>& q, Workspace<Pack>& work) {
    if (sweeps_.plan().joints) std::ranges::copy(work.momentum_target.flat(), sweeps_.plain_target().flat().begin());
    LaneTimes<Pack> time{};
    Lanes known = 0;
    for (int l = 0; l < block.count; ++l) {
      time[static_cast<std::size_t>(l)] = static_cast<double>(block.instances[l].steps) * h;
      known |= block.instances[l].displacements > 0 ? 1u << l : 0u;
    }
    constexpr int words = kHistoryWords<Real> * W;
    for (Index row = 0; row < before_.rows(); ++row) {
      before_(row) = last_displacement(block.past + row * words);
    }
    known_ = known;
    sweeps_.begin(time, h, q, before_, L::mask(known), false, work.delta);
  }
  /// Lanes whose solution has a blow in it, which must be found in time.
  Lanes blows(const Field<Pack>& q, const Field<Pack>& delta) const {
    if (!sweeps_.plan().bounces) return 0;
    return L::bits(stopped_bounces(sweeps_.limits(), sweeps_.plan().q_row, q, delta, before_, L::mask(known_)));
  }

  /// What effects do to an evaluation, and to its h^2 x kinetic energy.
  template <class Element>
  void act(const BodyConstants<Element>& constants, Workspace<Pack>& work, Pack& energy) {
    const EffectPlan& plan = sweeps_.plan();
    if (plan.bodies) sweeps_.bodies(constants, work.displacement, work.impulse);
    if (plan.joints) {
      if (plan.balls) displacement_map(tree_, work.motion, work.delta);
      sweeps_.joints(work.delta, work.motion, work.momentum_target);
      energy = energy + armature_energy<Pack>(plan.effects.armature, work.delta);
    }
  }
  /// action(added): what they add to a factor.
  template <class Action>
  void with_added(const Action& action) const {
    const auto& stiffness = sweeps_.joint_sum().stiffness;
    const auto& body_stiffness = sweeps_.body_sum().body_stiffness;
    if (sweeps_.plan().bodies) {
      action(EffectsAdded<Pack, true, true>{stiffness, body_stiffness});
    } else {
      action(EffectsAdded<Pack, true, false>{stiffness, body_stiffness});
    }
  }

  /// Velocities no farther from the mean ones of the last step than the motion bends; those of a start as they are.
  void follow_motion(const Block<Real>& block, const Pack& rate, Field<Pack>& v) const {
    constexpr int words = kHistoryWords<Real> * W;
    Lanes moved = 0;
    for (int l = 0; l < block.count; ++l) moved |= Lanes{block.instances[l].steps > 0} << l;
    for (Index row = 0; row < v.rows(); ++row) {
      v(row) = select(L::mask(moved), sweeps_.within_bend(row, v(row), rate * last_displacement(block.past + row * words)), v(row));
    }
  }

  /// What is lane l's own, and what effects keep of it, for it to be stepped alone; contact points as they ended the step before, whatever
  /// lanes that are solved together have made of them since.
  void take_out(const Block<Real>& block, int l, const EffectControls& alone) {
    const auto take = [&](const Field<Pack>& from, std::span<double> to) {
      for (std::size_t row = 0; row < to.size(); ++row) to[row] = static_cast<double>(L::lane(from(static_cast<Index>(row)), l));
    };
    if (block.targets != nullptr) take(sweeps_.servo_targets(), alone.servo_targets());
    if (block.frictions != nullptr) take(sweeps_.friction_forces(), alone.friction_forces());
    for (Index k = 0; block.gains != nullptr && k < sweeps_.gains().rows(); ++k) {
      alone.set_gain(k, static_cast<double>(L::lane(sweeps_.gains()(k), l)));
    }
    if (block.ground_friction != nullptr) alone.set_ground_friction(static_cast<double>(L::lane(sweeps_.ground_friction(), l)));
    const EffectControls::Reading reading = alone.reading();
    take(sweeps_.excess_before(), reading.excess_before);
    take(sweeps_.reading(), reading.reading);
    take(sweeps_.bend(), reading.bend);
    for (Index k = 0; k < sweeps_.plan().kept(); ++k) alone.set_kept(k, static_cast<double>(block.kept[k * W + l]));
  }
  /// And of the step that it took so.
  void keep_alone(const Block<Real>& block, int l, const EffectControls& alone) {
    const auto give = [&](std::span<const double> from, Field<Pack>& to) {
      for (std::size_t row = 0; row < from.size(); ++row) L::set_lane(to(static_cast<Index>(row)), l, from[row]);
    };
    const EffectControls::Reading reading = alone.reading();
    give(reading.excess_before, sweeps_.excess_before());
    give(reading.reading, sweeps_.reading());
    give(reading.bend, sweeps_.bend());
    for (Index k = 0; k < sweeps_.plan().kept(); ++k) block.kept[k * W + l] = static_cast<Real>(alone.kept(k));
  }

  /// The end of a step, of the lanes that took it together: impulses on bodies now, those of joints by add_end once the momenta are there.
  void end(const Block<Real>& block, Lanes done, Workspace<Pack>& work) {
    const Mask moves = L::mask(done);
    if (done != 0 && sweeps_.plan().joints) sweeps_.end_joints(work.delta, work.motion, Stopped::rests, work.innovation, end_);
    if (done != 0 && sweeps_.plan().bodies) sweeps_.end_bodies(work.placement, work.displacement, work.impulse);
    for (Index k = 0; k < sweeps_.plan().kept(); ++k) {
      const Pack ended = select(moves, sweeps_.kept(k), L::load(block.kept + k * W));
      sweeps_.set_kept(k, ended);
      L::store(ended, block.kept + k * W);
    }
  }
  template <class Element>
  void add_end(const BodyConstants<Element>& constants, const Mask& moves, Workspace<Pack>& work, Field<Pack>& p) {
    for (Index row = 0; sweeps_.plan().joints && row < p.rows(); ++row) p(row) = select(moves, p(row) + end_(row), p(row));
    sweeps_.end_reading(constants, work.placement, moves, work.delta, before_, L::mask(known_), work.impulse, work.increment);
  }

 private:
  static Pack last_displacement(const std::uint32_t* past) {
    std::array<Real, W> each;
    for (int l = 0; l < W; ++l) each[static_cast<std::size_t>(l)] = remembered<Real>(past + l);
    return L::load(each.data());
  }

  const Tree& tree_;
  EffectSweeps<Pack> sweeps_;
  Field<Pack> end_;     // what they add to p at the end of a step
  Field<Pack> before_;  // displacement of the step before
  Lanes known_ = 0;     // lanes in which there was one
};

/// Where a scene has none.
struct NoLaneEffects : NoEffects {
  template <class Real>
  explicit NoLaneEffects(const BlockSetup<Real>& setup) : NoEffects(setup.plan, setup.model) {}
  const NoEffects* operator->() const { return this; }
};

}  // namespace linden
