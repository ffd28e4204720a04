#include "engine/sweeps/sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "engine/effects/effect_plan.hpp"
#include "engine/sweeps/strategy.hpp"

namespace linden {

std::vector<Sweep> sweeps_of(const Model& model, const Options& options, const EffectPlan& plan) {
  const Effects& effects = plan.effects;
  const bool joints = plan.joints, bodies = plan.bodies, points = !plan.ground.points.empty();
  const bool limited = std::ranges::any_of(effects.servos, [](const Servo& servo) { return std::isfinite(servo.max_force); });
  const bool newton = options.solver == Solver::newton;
  const bool ties = !model.mimics.empty();
  const Strategy strategy = strategy_of(model, options, plan);
  const bool gravity = strategy.gravity, one_pass = strategy.one_pass;
  const bool quaternions = std::ranges::any_of(model.tree.runs, [](const Run& run) { return run.kind != JointKind::screw; });
  std::vector<Sweep> list;
  const auto add = [&](bool present, const Sweep& sweep) {
    if (present) list.push_back(sweep);
  };

  constexpr std::string_view first = "first", evaluation = "evaluation", factor = "factor", correction = "correction", last = "last";
  add(true, {first, "momentum_target_map", "p, force", "momentum_target"});
  switch (options.guess) {
    case FirstGuess::extrapolation: add(true, {first, "first guess: extrapolation", "history", "delta"}); break;
    case FirstGuess::ig1: add(true, {first, "first guess: ig1", "", "delta"}); break;
    case FirstGuess::ig2: add(true, {first, "first guess: ig2", "history", "delta"}); break;
    case FirstGuess::ig3:
      add(true, {first, "articulated_inertia_up", "inertia, screw, placement", "articulated, gains"});
      add(true, {first, "impulse_pass_up, rate_down", "placement, gains, p", "delta (velocity)"});
      add(true, {first, "velocity_down, coriolis_down", "inertia, screw, placement, delta", "twist, bias, impulse"});
      add(true, {first, "impulse_up", "screw, placement, impulse", "residual (acceleration's force)"});
      add(true, {first, "impulse_pass_up, rate_down", "placement, gains, residual", "delta"});
      break;
  }
  add(!effects.motions.empty(), {first, "given_motion_map", "motions, time, q", "delta"});
  add(!effects.limits.empty(), {first, "begin_limits", "q, history, delta", "limits, delta"});
  add(!effects.friction.empty(), {first, "begin_friction", "history, delta", "friction, delta"});
  add(!effects.armature.empty(), {first, "armature_map", "armature", "joint impulses"});
  add(!effects.springs.empty(), {first, "spring_map", "springs, q", "joint impulses"});
  add(!effects.ball_springs.empty(), {first, "ball_spring_stiffness", "ball springs", "joint impulses"});
  add(!effects.damping.empty(), {first, "damping_map", "damping", "joint impulses"});
  add(!effects.torques.empty(), {first, "torque_map", "torques, time", "joint impulses"});
  add(!effects.servos.empty(), {first, "servo_map", "servos, q", "joint impulses"});
  add(!effects.friction.empty(), {first, "friction_map", "friction", "joint impulses"});
  add(true, {first, "motion_map", "screw, delta", "motion"});
  add(true, {evaluation, "displacement_down", "placement, motion", "displacement"});
  add(true, {evaluation, "momentum_map", "inertia, displacement", "impulse"});
  add(!effects.drag.empty(), {evaluation, "drag_map", "drag, pose, displacement", "impulse, body impulses"});
  add(!effects.wrenches.empty(), {evaluation, "wrench_map", "wrenches, pose, displacement", "impulse, body impulses"});
  add(points, {evaluation, "ground_map", "points, displacement", "points, impulse, body impulses"});
  add(joints, {evaluation, "joint_impulses_map", "joint impulses, delta", "momentum_target"});
  add(!effects.ball_springs.empty(), {evaluation, "ball_spring_map", "ball springs, q, motion", "momentum_target"});
  add(!one_pass, {evaluation, "residual_up", "screw, placement, impulse, momentum_target", "impulse, residual"});
  add(ties, {evaluation, "fold_mimics", "residual", "residual"});
  add(newton, {factor, "newton_factor_up", "inertia, screw, placement, motion, displacement", "gains"});
  add(!newton, {factor, "articulated_inertia_up", "inertia, screw, placement", "articulated, gains"});
  add(ties, {factor, "ties: a tree solve for each leader", "gains", "ties"});
  add(!one_pass, {evaluation, "impulse_pass_up", "screw, placement, gains, residual", "bias, innovation"});
  add(one_pass, {evaluation, "innovation_up", "screw, placement, gains, impulse, momentum_target", "impulse, innovation"});
  add(newton, {correction, "increment_down", "screw, placement, motion, gains, innovation", "variation, increment"});
  add(!newton, {correction, "rate_down", "screw, placement, gains, innovation", "variation, increment"});
  add(ties, {correction, "ties: completion", "increment, ties", "increment"});
  add(limited, {correction, "revise_servos", "servos, q, delta", "servos, joint impulses"});
  add(!effects.friction.empty(), {correction, "revise_friction", "innovation, delta", "friction, delta, joint impulses"});
  add(!effects.limits.empty(), {correction, "revise_limits", "innovation, delta", "limits, delta, joint impulses"});
  add(points, {correction, "revise_ground", "points", "points"});
  add(true, {correction, "correct_motion_map", "screw, increment", "delta, motion"});
  add(quaternions, {last, "displacement_map", "motion", "delta"});
  add(joints, {last, "joint_impulses_end_map", "joint impulses, delta", "p"});
  add(bodies, {last, "add_given_up", "placement, body impulses", "impulse"});
  add(true, {last, "advance_map", "motion, delta", "q, history"});
  add(true, {last, "placement_map", "tree_placement, screw, q", "placement"});
  add(bodies, {last, "world_placement_down", "placement", "pose"});
  add(points, {last, "find_ground", "pose", "points"});
  add(gravity, {last, "gravity_field_down", "placement", "field"});
  add(gravity, {last, "gravity_force_up", "inertia, subtree_mass, screw, placement, field", "first_moment, force"});
  const std::string_view left = one_pass ? "screw, displacement, impulse, innovation, force" : "screw, displacement, impulse, residual, force";
  add(true, {last, "momentum_update_map", left, "p"});
  add(ties, {last, "fold_mimics", "p", "p"});
  add(plan.any(), {last, "end_reading", "joint impulses, body impulses, placement", "reading"});
  return list;
}

}  // namespace linden
