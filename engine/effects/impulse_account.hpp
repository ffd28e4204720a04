// engine/effects/impulse_account.hpp
// The impulses of effects in a part of a step, read off the solution before the part is ended.
//
//   joints    J = -(o + g delta) / h of both ends of the step (joint_impulses.hpp); of held joints also what is left of the residual, / h
//   bodies    J = S^T F, F the wrenches of wrenches, drag and ground summed over subtrees (body_impulses.hpp)
//   servos    of each alone, as its law and its limit have it (servo.hpp)
//   ground    h N of each contact point (ground.hpp)
//   touches   of each place where bodies push each other (engine/sweeps/body_contacts.hpp)
//
// cost    one pass up the tree where something acts on bodies
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include "engine/effects/effect_sweeps.hpp"
#include "engine/effects/step_impulses.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "layout/model.hpp"

namespace linden {

class ImpulseAccount {
 public:
  /// Until then nothing is kept.
  void allocate(const EffectPlan& plan, const Shape& shape) {
    sum_.joints.assign(static_cast<std::size_t>(shape.velocities), 0);
    sum_.servos.assign(plan.effects.servos.size(), 0);
    sum_.ground.assign(plan.ground.points.size(), 0);
    sum_.closed.assign(plan.ground.points.size(), 0);
    if (plan.bodies || plan.pairs) sum_.bodies.assign(static_cast<std::size_t>(shape.slots) * 6, 0);
    for (std::vector<double>* numbers : {&sum_.pushes, &sum_.normals, &sum_.places}) numbers->assign(plan.ground.points.size() * 3, 0);
    projected_.allocate(shape.velocities);
    end_.allocate(shape.velocities);
    wrench_.allocate(shape.slots);
  }
  bool kept() const { return projected_.rows() > 0; }
  void clear() { sum_.clear(); }
  const StepImpulses& sum() const { return sum_; }

  /// A part of h seconds: q and placement at its beginning, motion and delta over it; residual: what is left of it.
  void add(const EffectSweeps<double>& effects, const Model& model, double h, const Field<double>& q, const Field<double, 12>& placement,
           const Field<double, 7>& motion, const Field<double>& delta, const Field<double>& residual) {
    const EffectPlan& plan = effects.plan();
    const double rate = 1 / h;
    if (plan.joints) {
      const JointImpulses<double>& given = effects.joint_sum();
      for (Index row = 0; row < projected_.rows(); ++row) {
        const bool held = given.stiffness(row) > std::numeric_limits<double>::max();
        projected_(row) = given.end_offset(row) - given.offset(row) + (given.end_gain(row) - given.gain(row)) * delta(row) +
                          (held ? residual(row) : 0);
        end_(row) = 0;
      }
      effects.evaluate(motion, projected_);
      effects.evaluate_end(motion, end_);
      for (Index row = 0; row < projected_.rows(); ++row) sum_.joints[static_cast<std::size_t>(row)] += rate * projected_(row) + end_(row);
      const Servos<double>& servos = effects.servos();
      for (std::size_t k = 0; k < sum_.servos.size(); ++k) {
        const auto [o, g, most] = servo_force(servos, static_cast<Index>(k), plan.q_row, h, q);
        const double mode = servos.mode(static_cast<Index>(k));
        sum_.servos[k] += rate * (mode == 0 ? -(o + g * delta(servos.entries[k].row)) : mode * most);
      }
    }
    if (!plan.bodies) return;
    std::ranges::copy(effects.body_sum().applied.flat(), wrench_.flat().begin());
    for (std::size_t k = 0; k < sum_.bodies.size(); ++k) sum_.bodies[k] += rate * wrench_.flat()[k];
    impulse_up(model.tree, model.constants, placement, wrench_, projected_);
    for (Index row = 0; row < projected_.rows(); ++row) sum_.joints[static_cast<std::size_t>(row)] += rate * projected_(row);
    const GroundPoints<double>& points = effects.points();
    for (std::size_t k = 0; k < sum_.ground.size(); ++k) {
      sum_.ground[k] += h * points.push(static_cast<Index>(k));
      sum_.closed[k] = points.closed(static_cast<Index>(k)) > 0.5 ? 1 : 0;
      if (points.push(static_cast<Index>(k)) != 0) add_push(effects, plan.ground.points[k].slot, k, h);
    }
  }

  /// What bodies did to each other in a part: touches, and seen from the joints [N m s, N s]; pose: of bodies in the world, at its beginning.
  void add_between(std::vector<TouchImpulse> touches, const Field<double, 12>& pose, const Field<double>& joints) {
    for (Index row = 0; row < joints.rows(); ++row) sum_.joints[static_cast<std::size_t>(row)] += joints(row);
    for (const TouchImpulse& touch : touches) {
      for (const auto& [slot, sign] : {std::pair(touch.slot_a, -1.0), std::pair(touch.slot_b, 1.0)}) {
        if (slot == 0) continue;
        const auto T = load<Placement, double>(pose, slot);
        const Vec3<double> push = sign * Vec3<double>::from(touch.impulse.data()), arm = Vec3<double>::from(touch.place.data()) - T.p;
        double* const wrench = &sum_.bodies[6 * static_cast<std::size_t>(slot)];
        const Vec3<double> moment = cross(arm, push) + sign * Vec3<double>::from(touch.moment.data());
        (Vec3<double>::from(wrench) + transpose_times(T.R, moment)).to(wrench);
        (Vec3<double>::from(wrench + 3) + transpose_times(T.R, push)).to(wrench + 3);
      }
    }
    sum_.add_touches(std::move(touches));
  }

 private:
  /// What contact point k gives its body, with friction, and where.
  void add_push(const EffectSweeps<double>& effects, Index slot, std::size_t k, double h) {
    const GroundPoints<double>& points = effects.points();
    const auto row = static_cast<Index>(k);
    const Mat3<double> R = load<Placement, double>(effects.body_sum().pose, slot).R;
    const auto n = load<Vec3, double>(points.normal, row);
    const Vec3<double> push = R * (h * (points.push(row) * n + load<Vec3, double>(points.drag, row)));
    (Vec3<double>::from(&sum_.pushes[3 * k]) + push).to(&sum_.pushes[3 * k]);
    (R * n).to(&sum_.normals[3 * k]);
    load<Vec3, double>(points.place, row).to(&sum_.places[3 * k]);
  }

  StepImpulses sum_;
  Field<double> projected_, end_;
  Field<double, 6> wrench_;
};

/// Where there are no effects.
struct NoImpulses {};

}  // namespace linden
