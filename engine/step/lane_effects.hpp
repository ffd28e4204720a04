// engine/step/lane_effects.hpp
// The effects of a block of instances: what a step of lanes asks of effect_sweeps.hpp, with what is each instance's own - time, targets,
// friction, how its contact points ended the last step.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/step/block_stepper.hpp"
#include "engine/step/effect_sweeps.hpp"
#include "engine/step/instance_stepper.hpp"
#include "engine/step/lanes_of.hpp"
#include "kernels/innovation_up.hpp"
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
    alone_contacts_.allocate(sweeps_.contacts(), Pack(Real(0)));
  }
  EffectSweeps<Pack>* operator->() { return &sweeps_; }

  void load(const Block<Real>& block) {
    const auto load = [](const Real* from, Field<Pack>& to) {
      for (Index k = 0; from != nullptr && k < to.rows(); ++k) to(k) = L::load(from + k * W);
    };
    load(block.targets, sweeps_.servo_targets());
    load(block.frictions, sweeps_.friction_forces());
    for (Index k = 0; block.contacts != nullptr && k < sweeps_.contacts(); ++k) {
      sweeps_.set_contact(k, L::load(block.contacts + k * W));
    }
  }
  void store(const Block<Real>& block) const {
    for (Index k = 0; block.contacts != nullptr && k < sweeps_.contacts(); ++k) {
      L::store(sweeps_.contact(k), block.contacts + k * W);
    }
  }

  /// Returns the potential energy of springs and ground.
  Pack refresh(const Field<Pack, 12>& placement, const Field<Pack>& q) { return potential_ = sweeps_.refresh(placement, q); }

  /// After the first guess. Lanes are each at their own time.
  void begin(const Block<Real>& block, double h, const Field<Pack>& q, Workspace<Pack>& work) {
    if (sweeps_.plan().joints) std::ranges::copy(work.momentum_target.flat(), sweeps_.plain_target().flat().begin());
    LaneTimes<Pack> time{};
    Lanes known = 0;
    for (int l = 0; l < block.count; ++l) {
      time[static_cast<std::size_t>(l)] = static_cast<double>(block.instances[l].steps) * h;
      known |= block.instances[l].displacements > 1 ? 1u << l : 0u;
    }
    constexpr int words = kHistoryWords<Real> * W;
    const auto past = [&](Index row, int steps) {
      const std::uint32_t* const from = block.past + row * words;
      std::array<Real, W> each;
      for (int l = 0; l < W; ++l) each[static_cast<std::size_t>(l)] = remembered<W, Real>(from + l, steps);
      return L::load(each.data());
    };
    sweeps_.begin(time, h, q, past, L::mask(known), work.delta);
  }

  /// What effects do to an evaluation, its exact factor, and its norm.
  template <class Element>
  Pack act(const BodyConstants<Element>& constants, Workspace<Pack>& work, Evaluation<Pack>& now) {
    const EffectPlan& plan = sweeps_.plan();
    if (plan.bodies) sweeps_.bodies(constants, work.displacement, work.impulse);
    if (plan.joints) {
      if (plan.balls) displacement_map(tree_, work.motion, work.delta);
      sweeps_.joints(work.delta, work.motion, work.momentum_target);
      now.energy = now.energy + armature_energy<Pack>(plan.effects.armature, work.delta);
    }
    const auto& stiffness = sweeps_.joint_sum().stiffness;
    const auto& pull = sweeps_.body_sum().pull;
    if (plan.bodies) return newton_up<false>(tree_, constants, work, EffectsAdded<Pack, true, true>{stiffness, pull});
    return newton_up<false>(tree_, constants, work, EffectsAdded<Pack, true, false>{stiffness, pull});
  }

  /// How much they did in the step that was solved, in either direction [J].
  Pack activity(const Workspace<Pack>& work) const {
    using std::abs;
    const EffectWork<Pack> done = sweeps_.work(work.innovation, work.delta, work.delta, false);
    Pack sum = sweeps_.activity(done, work.motion, work.delta) + potential_;
    for (Index row = 0; row < tree_.shape.velocities; ++row) sum = sum + abs(work.force(row) * work.delta(row));
    return sum;
  }

  /// Contacts of lane l, which was stepped alone.
  void keep_alone(int l, const InstanceStepper& alone) {
    for (Index k = 0; k < alone_contacts_.rows(); ++k) L::set_lane(alone_contacts_(k), l, alone.contact(k));
  }

  /// The end of a step, of the lanes that took it together: impulses on bodies now, those of joints by add_end once the momenta are there.
  void end(Lanes done, Workspace<Pack>& work) {
    const Mask moves = L::mask(done);
    if (done != 0 && sweeps_.plan().joints) sweeps_.end_joints(work.delta, work.motion, work.innovation, end_);
    if (done != 0 && sweeps_.plan().bodies) sweeps_.end_bodies(work.placement, work.displacement, work.impulse);
    for (Index k = 0; k < sweeps_.contacts(); ++k) {
      sweeps_.set_contact(k, select(moves, sweeps_.contact(k), alone_contacts_(k)));
      alone_contacts_(k) = Pack(Real(0));
    }
  }
  void add_end(const Mask& moves, Field<Pack>& p) const {
    if (!sweeps_.plan().joints) return;
    for (Index row = 0; row < p.rows(); ++row) p(row) = select(moves, p(row) + end_(row), p(row));
  }

 private:
  const Tree& tree_;
  EffectSweeps<Pack> sweeps_;
  Field<Pack> end_;             // what they add to p at the end of a step
  Field<Pack> alone_contacts_;  // of lanes that were stepped alone in this step; zero in others
  Pack potential_ = Pack(Real(0));
};

/// Where a scene has none.
struct NoLaneEffects : NoEffects {
  template <class Real>
  explicit NoLaneEffects(const BlockSetup<Real>& setup) : NoEffects(setup.plan, setup.model) {}
  const NoEffects* operator->() const { return this; }
};

}  // namespace linden
