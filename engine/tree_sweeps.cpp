#include "engine/tree_sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/convergence.hpp"
#include "kernels/articulated_inertia_up.hpp"
#include "kernels/displacement_down.hpp"
#include "kernels/gravity.hpp"
#include "kernels/increment_down.hpp"
#include "kernels/innovation_up.hpp"
#include "kernels/momentum_map.hpp"
#include "kernels/motion_map.hpp"
#include "kernels/newton_factor_up.hpp"
#include "kernels/placement_map.hpp"
#include "kernels/residual_up.hpp"
#include "kernels/rounding_floor_map.hpp"
#include "kernels/velocity_down.hpp"

namespace linden {
namespace {

/// Bodies that the sweeps of a part of a step go over before the next part: 64 of some 600 bytes stay in the nearest cache.
constexpr Index kPart = 64;

}  // namespace

bool Evaluated::usable() const { return least_w > 0 && std::isfinite(plain) && std::isfinite(energy); }

TreeSweeps::TreeSweeps(const Model& model, const Options& options, const EffectPlan* plan)
    : model_(model),
      constants_(&model.constants),
      options_(options),
      has_gravity_(options.gravity != std::array<double, 3>{0, 0, 0}),
      one_pass_(options.solver == Solver::newton && options.stop == StopTest::energy && model.mimics.empty()),
      ties_(model.mimics, model.tree.shape.velocities) {
  work_.allocate(model.tree.shape);
  if (plan != nullptr && plan->any()) effects_ = std::make_unique<EffectSweeps<double>>(*plan, model);
}

void TreeSweeps::refresh(const Field<double>& q) {
  in_parts_down([&](Slots part) {
    placement_map(model_.tree, *constants_, q, part, work_.placement);
    if (has_gravity_) gravity_field_down(model_.tree, work_.placement, gravity(), part, work_.field);
  });
  forces();
  if (!effects_) return;
  effect_potential_ = effects_->refresh(work_.placement, q);
  potential_ = (has_gravity_ ? potential_ : 0) + effect_potential_;
}

void TreeSweeps::apply(std::span<const double> force) {
  applied_.assign(force.begin(), force.end());
  if (!has_gravity_) {
    for (double& value : work_.force.flat()) value = 0;
  }
}

void TreeSweeps::forces() {
  if (has_gravity_) {
    potential_ = gravity_force_up(model_.tree, *constants_, work_.placement, work_.field, work_.first_moment, work_.force);
  }
  for (std::size_t row = 0; row < applied_.size(); ++row) {
    double& force = work_.force.flat()[row];
    force = has_gravity_ ? force + applied_[row] : applied_[row];
  }
}

/// action(slots) for parts of the tree, root to leaves: all sweeps of an action over as many bodies as stay in the nearest cache.
template <class Action>
void TreeSweeps::in_parts_down(const Action& action) const {
  const Index slots = model_.tree.shape.slots;
  for (Index begin = 1; begin < slots; begin += kPart) action(Slots{begin, std::min(begin + kPart, slots)});
}

template <class Action>
void TreeSweeps::in_parts_up(const Action& action) const {
  for (Index end = model_.tree.shape.slots; end > 1; end = std::max<Index>(1, end - kPart)) {
    action(Slots{std::max<Index>(1, end - kPart), end});
  }
}

/// motions(slots) brings work_.motion up to date.
template <class Motions>
Evaluated TreeSweeps::evaluate_motions(StepReport& report, const Motions& motions) {
  report.evaluations += 1;
  Evaluated result{1, 0, 0, 0};
  in_parts_down([&](Slots part) {
    motions(part);
    const double least = displacement_down(model_.tree, work_.placement, work_.motion, part, work_.displacement);
    result.least_w = std::min(result.least_w, least);
    result.energy += momentum_map(model_.tree, *constants_, work_.displacement, part, work_.impulse);
  });
  result.scale = result.energy;
  if (effects_) act(result);
  return result;
}

/// Effects on bodies and joints, for the displacements of an evaluation.
void TreeSweeps::act(Evaluated& now) {
  const EffectPlan& plan = effects_->plan();
  if (plan.bodies) {
    if (guess_points_) effects_->guess_points(work_.displacement, known_);
    guess_points_ = false;
    effects_->bodies(*constants_, work_.displacement, work_.impulse);
  }
  if (plan.joints) {
    if (plan.balls) displacement_map(model_.tree, work_.motion, work_.delta);
    if (effects_->soft()) effects_->follow(work_.delta);
    effects_->joints(work_.delta, work_.motion, work_.momentum_target);
    now.energy += armature_energy<double>(plan.effects.armature, work_.delta);
  }
  now.scale = now.energy + effect_scale_;
}

/// action(added): what effects add to a factor.
template <class Action>
void TreeSweeps::with_added(const Action& action) {
  if (!effects_) return action(NothingAdded{});
  const Field<double>& stiffness = effects_->joint_sum().stiffness;
  const Field<double, 36>& pull = effects_->body_sum().pull;
  const EffectPlan& plan = effects_->plan();
  if (plan.joints && plan.bodies) return action(EffectsAdded<double, true, true>{stiffness, pull});
  if (plan.joints) return action(EffectsAdded<double, true, false>{stiffness, pull});
  action(EffectsAdded<double, false, true>{stiffness, pull});
}

void TreeSweeps::begin(bool known, double scale) {
  guess_points_ = true;
  known_ = known;
  effect_scale_ = scale;
}

void TreeSweeps::factor(StepReport& report) {
  report.factorisations += 1;
  if (options_.solver == Solver::riqn) {
    with_added([&](const auto& added) {
      articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, gains(), added);
    });
    return tie_rates();
  }
  with_added([&](const auto& added) {
    newton_factor_up(model_.tree, *constants_, work_.placement, work_.motion, work_.displacement, work_.articulated, gains(), added);
  });
  if (ties_.empty()) return;
  ties_.factor(
      [&](const Field<double>& r, Field<double>& x) {
        impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), r, work_.bias, work_.innovation);
        increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, work_.variation, x);
      },
      work_.increment);
}

void TreeSweeps::tie_rates() {
  if (ties_.empty()) return;
  ties_.factor(
      [&](const Field<double>& r, Field<double>& x) {
        impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), r, work_.bias, work_.innovation);
        rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, x);
      },
      work_.increment);
}

double TreeSweeps::pass_up(Evaluated& now) {
  if (one_pass_) return innovation_up(model_.tree, *constants_, work_);
  now.plain = residual_up(model_.tree, *constants_, work_.placement, work_.momentum_target, work_.impulse, work_.residual);
  fold_mimics(ties_.mimics(), work_.residual);
  return pass_residual();
}

double TreeSweeps::factor_and_pass(Evaluated& now, StepReport& report) {
  if (!one_pass_) {
    factor(report);
    return pass_up(now);
  }
  report.factorisations += 1;
  double norm = 0;
  with_added([&](const auto& added) {
    in_parts_up([&](Slots part) {
      newton_factor_up(model_.tree, *constants_, work_.placement, work_.motion, work_.displacement, part, work_.articulated, gains(),
                       added);
      norm += innovation_up(model_.tree, *constants_, part, work_);
    });
  });
  return norm;
}

double TreeSweeps::factor_and_pass_again(Evaluated& now, StepReport& report) {
  if (!one_pass_) {
    factor(report);
    return pass_residual();
  }
  momentum_map(model_.tree, *constants_, work_.displacement, work_.impulse);
  if (effects_) act(now);
  return factor_and_pass(now, report);
}

/// Ties between joints make the whole solve necessary for the norm.
double TreeSweeps::pass_residual() {
  const double norm =
      impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), work_.residual, work_.bias, work_.innovation);
  if (ties_.empty()) return norm;
  pass_down();
  double tied = 0;
  for (Index row = 0; row < model_.tree.shape.velocities; ++row) tied += work_.residual(row) * work_.increment(row);
  return std::abs(tied);
}

void TreeSweeps::pass_down() {
  if (options_.solver == Solver::riqn) {
    rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, work_.increment);
  } else {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, work_.variation,
                   work_.increment);
  }
  if (!ties_.empty()) ties_.complete(work_.increment);
}

Evaluated TreeSweeps::evaluate(StepReport& report) {
  return evaluate_motions(report, [&](Slots part) { motion_map(model_.tree, *constants_, work_.delta, part, work_.motion); });
}

Evaluated TreeSweeps::correct(double factor, StepReport& report) {
  return evaluate_motions(report, [&](Slots part) {
    correct_motion_map(model_.tree, *constants_, work_.applied, factor, part, work_.delta, work_.motion);
  });
}

Evaluated TreeSweeps::solve_and_correct(StepReport& report) {
  report.iterations += 1;
  if (!one_pass_) {
    if (ties_.empty()) pass_down();  // with ties, pass_up has solved already
    std::swap(work_.increment, work_.applied);
    return correct(1, report);
  }
  return evaluate_motions(report, [&](Slots part) {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, part, work_.variation,
                   work_.applied);
    correct_motion_map(model_.tree, *constants_, work_.applied, 1.0, part, work_.delta, work_.motion);
  });
}

double TreeSweeps::slope_along(const Field<double>& innovation_before) const {
  double sum = 0;
  up(model_.tree, [&](auto joint, Index i) {
    const Index row = model_.tree.first_v(i);
    const Wrench<double> u = load_joint(joint, work_.innovation, row);
    const Wrench<double> given = yield(joint, work_.joint_inverse, model_.tree.first_block(i), load_joint(joint, innovation_before, row));
    sum += dot(u.n, given.n) + dot(u.f, given.f);
  });
  return sum;
}

bool TreeSweeps::at_rounding_floor(const Evaluated& now, double norm, double fall, double epsilons) const {
  if (!(0.5 * norm <= kFloorCeiling * kFloorCeiling * (now.energy + fall))) return false;
  const double sum = rounding_floor_map(model_.tree, *constants_, work_.momentum_target, work_.impulse, work_.joint_inverse);
  const double unit = epsilons * std::numeric_limits<double>::epsilon();
  return norm <= unit * unit * sum;
}

void TreeSweeps::factor_mass() {
  if (effects_ && effects_->rotors().rows() > 0) {
    const EffectsAdded<double, true, false> rotors{effects_->rotors(), effects_->body_sum().pull};
    articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, gains(), rotors);
  } else {
    articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, gains());
  }
  tie_rates();
}

void TreeSweeps::apply_mass_inverse(const Field<double>& p, Field<double>& v) {
  impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), p, work_.bias, work_.innovation);
  rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, v);
  if (!ties_.empty()) ties_.complete(v);
}

void TreeSweeps::velocity_of(const Field<double>& p, Field<double>& v) {
  factor_mass();
  apply_mass_inverse(p, v);
}

void TreeSweeps::momentum_of(const Field<double>& v, Field<double>& p) {
  velocity_down(model_.tree, *constants_, work_.placement, v, work_.twist);
  momentum_of_map(model_.tree, *constants_, work_.twist, work_.impulse);
  impulse_up(model_.tree, *constants_, work_.placement, work_.impulse, p);
  if (effects_) add_armature<double>(effects_->plan().effects.armature, v, p);
  fold_mimics(ties_.mimics(), p);
}

const Field<double>& TreeSweeps::read_velocity(const Field<double>& p, Field<double>& v) {
  if (!effects_) {
    velocity_of(p, v);
    return p;
  }
  read_ = p;
  effects_->even_out(*constants_, work_.placement, work_.impulse, work_.increment, read_);
  fold_mimics(ties_.mimics(), read_);
  velocity_of(read_, v);
  return read_;
}

}  // namespace linden
