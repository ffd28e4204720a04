#include "engine/sweeps/sweeps.hpp"

#include <algorithm>
#include <array>

#include "engine/effects/effect_plan.hpp"
#include "engine/sweeps/strategy.hpp"
#include "kernels/effects/laws.hpp"

namespace linden {
namespace {

/// When a sweep runs. The rows of joints are made when a step begins, those of bodies at each evaluation.
constexpr std::string_view first = "first", evaluation = "evaluation", factor = "factor", correction = "correction", last = "last";

/// Sweeps of the laws that have anything to do, as far as they are this part.
void add_parts(const EffectPlan& plan, const Model& model, Part part, Site site, std::string_view when, std::vector<Sweep>& list) {
  const LawSetup setup = plan.setup(model.tree);
  const auto add = [&]<class Law>(bool acts, bool settling) {
    for (const PartSweep& sweep : Law::sweeps) {
      if (sweep.part == part && acts && (part != Part::revise || settling)) list.push_back({when, sweep.name, sweep.reads, sweep.writes});
    }
  };
  if (site == Site::joint) {
    each_law_type<JointLaws<double>>([&]<class Law>() {
      const auto& entries = plan.effects.list<typename Law::Entry>();
      add.template operator()<Law>(!entries.empty(), std::ranges::any_of(entries, settles<typename Law::Entry>));
    });
  } else {
    each_law_type<BodyLaws<double>>([&]<class Law>() { add.template operator()<Law>(!Law::touching(setup).empty(), Law::facts.has_states); });
  }
}

}  // namespace

std::vector<Sweep> sweeps_of(const Model& model, const Options& options, const EffectPlan& plan) {
  const bool joints = plan.joints, bodies = plan.bodies;
  const bool newton = options.solver == Solver::newton;
  const bool ties = !model.mimics.empty();
  const Strategy strategy = strategy_of(model, options, plan);
  const bool gravity = strategy.gravity, one_pass = strategy.one_pass;
  const bool quaternions = std::ranges::any_of(model.tree.runs, [](const Run& run) { return run.kind != JointKind::screw; });
  std::vector<Sweep> list;
  const auto add = [&](bool present, const Sweep& sweep) {
    if (present) list.push_back(sweep);
  };
  const auto add_laws = [&](Part part, Site site, std::string_view when) { add_parts(plan, model, part, site, when, list); };

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
  add_laws(Part::begin, Site::body, first);
  add_laws(Part::begin, Site::joint, first);
  add_laws(Part::add, Site::joint, first);
  add(true, {first, "motion_map", "screw, delta", "motion"});
  add(true, {evaluation, "displacement_down", "placement, motion", "displacement"});
  add(true, {evaluation, "momentum_map", "inertia, displacement", "impulse"});
  add_laws(Part::add, Site::body, evaluation);
  add(joints, {evaluation, "joint_impulses_map", "joint impulses, delta", "momentum_target"});
  add_laws(Part::evaluate, Site::joint, evaluation);
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
  add_laws(Part::revise, Site::joint, correction);
  add_laws(Part::revise, Site::body, correction);
  add(true, {correction, "correct_motion_map", "screw, increment", "delta, motion"});
  add(quaternions, {last, "displacement_map", "motion", "delta"});
  add(joints, {last, "joint_impulses_end_map", "joint impulses, delta", "p"});
  add(bodies, {last, "add_given_up", "placement, body impulses", "impulse"});
  add(true, {last, "advance_map", "motion, delta", "q, history"});
  add(true, {last, "placement_map", "tree_placement, screw, q", "placement"});
  add(bodies, {last, "world_placement_down", "placement", "pose"});
  add_laws(Part::place, Site::body, last);
  add(gravity, {last, "gravity_field_down", "placement", "field"});
  add(gravity, {last, "gravity_force_up", "inertia, subtree_mass, screw, placement, field", "first_moment, force"});
  const std::string_view left = one_pass ? "screw, displacement, impulse, innovation, force" : "screw, displacement, impulse, residual, force";
  add(true, {last, "momentum_update_map", left, "p"});
  add(ties, {last, "fold_mimics", "p", "p"});
  add(plan.any(), {last, "end_reading", "joint impulses, body impulses, placement", "reading"});
  return list;
}

}  // namespace linden
