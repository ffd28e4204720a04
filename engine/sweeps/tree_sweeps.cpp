// Of tree_sweeps.hpp: evaluations of the residual.
#include "engine/sweeps/tree_sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "engine/sweeps/tree_kernels.hpp"

namespace linden {
namespace {

constexpr auto nothing = [](Slots, Evaluated<double>&) {};

}  // namespace

template <bool kEffects>
TreeSweeps<kEffects>::TreeSweeps(const Model& model, const Options& options, const EffectPlan& plan)
    : model_(model),
      constants_(&model.constants),
      options_(options),
      strategy_(strategy_of(model, options, plan)),
      ties_(model.mimics, model.tree),
      row_yields_(plan.row_yields),
      effects_(plan, model),
      tree_(model.tree) {
  work_.allocate(model.tree.shape);
  if (strategy_.reuses_factor) mass_.allocate(model.tree.shape);
  if (!plan.effects.motions.empty()) given_.allocate(model.tree.shape.velocities);
  couplings_.emplace(model, row_yields_, strategy_.reuses_factor ? Serves::steps_that_follow : Serves::till_the_next);
  if (plan.pairs) {
    contacts_.emplace(*plan.effects.contact, model);
    pose_.allocate(model.tree.shape.slots);
  }
}

/// motions(part) brings work_.motion up to date on the way down; before_up(part, sum) comes first on the way up.
template <bool kEffects>
template <class Motions, class BeforeUp>
Evaluated<double> TreeSweeps<kEffects>::evaluate_motions(StepReport& report, Pass pass, Factor factor, const Motions& motions,
                                                 const BeforeUp& before_up) {
  report.evaluations += 1;
  if (factor == Factor::fresh) report.factorisations += 1;
  Evaluated<double> now;
  const auto move = [&](Slots part, Evaluated<double>& sum) {
    motions(part);
    const double least = displacement_down(model_.tree, work_.placement, work_.motion, part, work_.displacement);
    sum.least_w = std::min(sum.least_w, least);
  };
  const auto momenta = [&](Slots part, Evaluated<double>& sum) {
    sum.energy += momentum_map(model_.tree, *constants_, work_.displacement, part, work_.impulse);
  };
  const auto down = [&](Slots part, Evaluated<double>& sum) {
    move(part, sum);
    momenta(part, sum);
  };
  if (!kEffects && strategy_.one_pass) {
    valid_.evaluation = !strategy_.shares_rows;
    valid_.end_momenta = factor == Factor::kept && strategy_.finds_end_momenta();
    valid_.placements = !strategy_.shares_rows;
    const auto up = [&](Slots part, Evaluated<double>& sum) {
      before_up(part, sum);
      sum.norm += pass_part(part, factor, NothingAdded{});
      if (valid_.end_momenta) {
        momentum_at_end_map(model_.tree, *constants_, work_.displacement, work_.impulse, work_.innovation, part, work_.end_momentum);
      }
    };
    if (strategy_.order == Order::long_chain) {
      // momenta on the way up, where a factor reads inertias and displacements too; of a part its parent's, to which it adds, and not its
      // last, which it had from the part before
      const Slots all = all_slots(model_.tree);
      in_parts_down(all, [&](Slots part) { move(part, now); });
      in_parts_up(all, [&](Slots part) {
        momenta({std::max(all.begin, part.begin - 1), part.end == all.end ? part.end : part.end - 1}, now);
        up(part, now);
      });
    } else {
      // a correction begins where the pass before it ended: what that left is still in the cache
      now = tree_.run(pass == Pass::first, strategy_.shares_rows, down, up);
    }
    now.scale = now.energy;
    return now;
  }
  in_parts_down(all_slots(model_.tree), [&](Slots part) { down(part, now); });
  before_up(all_slots(model_.tree), now);
  take_multipliers();
  now.scale = now.energy;
  couplings_->find_gaps(work_.placement, work_.motion, work_.delta, factor == Factor::fresh ? Asked::rows : Asked::gaps);
  if (contacts_) couplings_->find_contact_gaps(pose_, work_.displacement);
  act(now);
  pass_up(now, factor);
  return now;
}

template <bool kEffects>
void TreeSweeps<kEffects>::complete() {
  if (valid_.evaluation) return;
  const Slots all = all_slots(model_.tree);
  place_all();
  motion_map(model_.tree, *constants_, work_.delta, work_.motion);
  displacement_down(model_.tree, work_.placement, work_.motion, work_.displacement);
  momentum_map(model_.tree, *constants_, work_.displacement, work_.impulse);
  innovation_up(model_.tree, *constants_, all, work_);
  valid_.evaluation = true;
}

/// What couplings push joins that which the residual is to be: of effects on joints, what they start from.
template <bool kEffects>
void TreeSweeps<kEffects>::take_multipliers() {
  Field<double>* target = &work_.momentum_target;
  if constexpr (kEffects) {
    if (effects_.plan().joints) target = &effects_.plain_target();
  }
  couplings_->take_multipliers(true, *target);
}

/// Effects on bodies and joints, for the displacements of an evaluation.
template <bool kEffects>
void TreeSweeps<kEffects>::act([[maybe_unused]] Evaluated<double>& now) {
  if constexpr (kEffects) {
    const EffectPlan& plan = effects_.plan();
    if (plan.bodies) {
      if (guess_points_) effects_.guess_points(work_.displacement);
      guess_points_ = false;
      effects_.bodies(*constants_, work_.displacement, work_.impulse);
    }
    if (plan.joints) {
      if (plan.balls) displacement_map(model_.tree, work_.motion, work_.delta);
      if (effects_.is_regularized()) effects_.follow(work_.delta);
      effects_.joints(work_.delta, work_.motion, work_.momentum_target);
      now.energy += armature_energy<double>(plan.effects.armature, work_.delta);
    }
    now.scale = now.energy + effect_scale_;
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::begin(double scale) {
  guess_points_ = true;
  effect_scale_ = scale;
}

/// Residual and first half of a solve of some joints; a fresh factor is made on the way.
template <bool kEffects>
template <class Added>
double TreeSweeps<kEffects>::pass_part(Slots part, Factor factor, const Added& added) {
  if (factor == Factor::fresh) {
    newton_factor_up(model_.tree, *constants_, work_.placement, work_.motion, work_.displacement, part, work_.articulated, gains(), added);
  }
  return innovation_up(model_.tree, *constants_, part, work_);
}

template <bool kEffects>
void TreeSweeps<kEffects>::pass_up(Evaluated<double>& now, Factor how) {
  if (strategy_.one_pass) {
    now.norm = 0;
    effects_.with_added([&](const auto& added) {
      in_parts_up(all_slots(model_.tree), [&](Slots part) { now.norm += pass_part(part, how, added); });
    });
    return;
  }
  if (how == Factor::fresh) factor();
  now.plain = residual_up(model_.tree, *constants_, work_.placement, work_.momentum_target, work_.impulse, work_.residual);
  fold_mimics(ties_.mimics(), work_.residual);
  now.norm = pass_residual();
}

template <bool kEffects>
void TreeSweeps<kEffects>::factor_again(Evaluated<double>& now, StepReport& report) {
  complete();
  valid_.end_momenta = false;
  report.factorisations += 1;
  if (!strategy_.one_pass) {
    if (!couplings_->empty()) couplings_->add_push(work_.residual);
    couplings_->find_gaps(work_.placement, work_.motion, work_.delta, Asked::rows);
    if (contacts_) couplings_->find_contact_gaps(pose_, work_.displacement);
    factor();
    now.norm = pass_residual();
    return;
  }
  now.energy = momentum_map(model_.tree, *constants_, work_.displacement, work_.impulse);
  act(now);
  pass_up(now, Factor::fresh);
}

template <bool kEffects>
Evaluated<double> TreeSweeps<kEffects>::evaluate(Factor factor, StepReport& report) {
  const auto motions = [&](Slots part) {
    place_again(part);
    motion_map(model_.tree, *constants_, work_.delta, part, work_.motion);
  };
  return evaluate_motions(report, Pass::first, factor, motions, nothing);
}

template <bool kEffects>
Evaluated<double> TreeSweeps<kEffects>::evaluate_from(const State<double>& state, const Extrapolation& guess, double h, Factor factor,
                                                StepReport& report) {
  const auto motions = [&](Slots part) {
    place_again(part);
    extrapolate(guess, state.history, velocities(model_.tree, part), work_.delta);
    motion_map(model_.tree, *constants_, work_.delta, part, work_.motion);
  };
  const auto target = [&](Slots part, Evaluated<double>&) { momentum_target_map(model_.tree, h, state.p, work_.force, part, work_.momentum_target); };
  return evaluate_motions(report, Pass::first, factor, motions, target);
}

template <bool kEffects>
Evaluated<double> TreeSweeps<kEffects>::arrive_and_evaluate(double h_before, State<double>& state, const Extrapolation& guess, double h,
                                                            Factor factor, StepReport& report) {
  const auto motions = [&](Slots part) {
    arrive_down(part, state);
    extrapolate(guess, state.history, velocities(model_.tree, part), work_.delta);
    motion_map(model_.tree, *constants_, work_.delta, part, work_.motion);
  };
  const auto arrival = [&](Slots part, Evaluated<double>&) {
    arrive_up(part, h_before, true, state);
    momentum_target_map(model_.tree, h, state.p, work_.force, part, work_.momentum_target);
  };
  const Evaluated<double> now = evaluate_motions(report, Pass::first, factor, motions, arrival);
  find_potentials(state.q);
  return now;
}

template <bool kEffects>
Evaluated<double> TreeSweeps<kEffects>::correct(double factor, StepReport& report) {
  couplings_->correct(factor);
  const auto motions = [&](Slots part) {
    place_again(part);
    correct_motion_map(model_.tree, *constants_, work_.applied, factor, part, work_.delta, work_.motion);
  };
  return evaluate_motions(report, Pass::correction, Factor::kept, motions, nothing);
}

template <bool kEffects>
Evaluated<double> TreeSweeps<kEffects>::solve_and_correct(StepReport& report) {
  report.iterations += 1;
  if (!strategy_.one_pass) {
    if (!solves_with_residual()) {
      pass_down(work_.applied);
    } else {
      std::swap(work_.increment, work_.applied);  // pass_residual has solved already
      couplings_->apply();
    }
    return correct(1, report);
  }
  const auto motions = [&](Slots part) {
    place_again(part);
    if (strategy_.shares_rows && part.branch > 0) motion_map(model_.tree, *constants_, work_.delta, part, work_.motion);
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, part, work_.variation,
                   work_.applied);
    correct_motion_map(model_.tree, *constants_, work_.applied, 1.0, part, work_.delta, work_.motion);
  };
  return evaluate_motions(report, Pass::correction, Factor::kept, motions, nothing);
}

/// The residual along a correction.
template <bool kEffects>
double TreeSweeps<kEffects>::along(const Field<double>& correction) const {
  double sum = 0;
  for (Index row = 0; row < correction.rows(); ++row) sum += work_.residual(row) * correction(row);
  return sum;
}

template <bool kEffects>
double TreeSweeps<kEffects>::slope_along(const Field<double>& innovation_before) const {
  double sum = 0;
  up(model_.tree, [&](auto joint, Index i) {
    const Index row = model_.tree.first_v(i);
    const Wrench<double> u = load_joint(joint, work_.innovation, row);
    const Wrench<double> given = apply_inverse(joint, work_.joint_inverse, model_.tree.first_block(i), load_joint(joint, innovation_before, row));
    sum += dot(u.n, given.n) + dot(u.f, given.f);
  });
  return sum;
}

template <bool kEffects>
bool TreeSweeps<kEffects>::at_floor(const Evaluated<double>& now, double fall, double epsilons) {
  if (!couplings_->empty() && is_rounding(now.norm, couplings_->rounding(), epsilons)) return true;  // where nothing moves, gaps are all there is
  if (!below_ceiling(now.norm, now.energy, fall)) return false;
  complete();
  const double rounding = rounding_floor_map(model_.tree, *constants_, work_.momentum_target, work_.impulse, yields());
  return is_rounding(now.norm, rounding + couplings_->rounding(), epsilons);
}

/// h x momenta at the beginning of a step of displacement work_.delta from where the bodies are; returns h^2 x its kinetic energy.
template <bool kEffects>
double TreeSweeps<kEffects>::momenta_of_delta(Field<double>& momenta) {
  motion_map(model_.tree, *constants_, work_.delta, work_.motion);
  displacement_down(model_.tree, work_.placement, work_.motion, work_.displacement);
  double energy = momentum_map(model_.tree, *constants_, work_.displacement, work_.impulse);
  impulse_up(model_.tree, *constants_, work_.placement, work_.impulse, momenta);
  if constexpr (kEffects) {
    add_armature<double>(effects_.plan().effects.armature, work_.delta, momenta);
    energy += armature_energy<double>(effects_.plan().effects.armature, work_.delta);
  }
  return energy;
}

template <bool kEffects>
EnergyStep TreeSweeps<kEffects>::energy_step(const Field<double>& before, double h_before, double h, StepReport& report) {
  place_all();
  EnergyStep step;
  Field<double>& solution = work_.applied;
  std::ranges::copy(work_.delta.flat(), solution.flat().begin());
  const auto along_mean = [&](double momentum, Index row) { return 0.5 * momentum * (solution(row) / h + before(row) / h_before); };
  step.now = momenta_of_delta(work_.momentum) / (h * h);
  for (Index row = 0; row < before.rows(); ++row) step.work += along_mean(work_.momentum(row) / h, row);
  if (!couplings_->empty()) step.rigid_work = 0.5 / h * (couplings_->rigid_work(solution) / h + couplings_->rigid_work(before) / h_before);
  // the step before, seen from its end: the same step taken back, whose momenta point the other way
  for (Index row = 0; row < before.rows(); ++row) work_.delta(row) = -before(row);
  step.before = momenta_of_delta(work_.momentum) / (h_before * h_before);
  for (Index row = 0; row < before.rows(); ++row) step.work += along_mean(work_.momentum(row) / h_before, row);
  // all as it was
  std::ranges::copy(solution.flat(), work_.delta.flat().begin());
  evaluate(Factor::kept, report);
  return step;
}

template <bool kEffects>
void TreeSweeps<kEffects>::mean_twists(const Field<double, kHistory>& delta, double h, Field<double, 6>& twist) {
  place_all();
  for (Index row = 0; row < delta.rows(); ++row) work_.delta(row) = -delta(row, 0);
  motion_map(model_.tree, *constants_, work_.delta, work_.motion);
  displacement_down(model_.tree, work_.placement, work_.motion, work_.displacement);
  const double rate = -1 / h;
  for (Index i = 0; i < model_.tree.shape.slots; ++i) {
    const Twist<double> u = log(load<Displacement, double>(work_.displacement, i));
    store(twist, i, Twist<double>{rate * u.w, rate * u.v});
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::twists_of(const Field<double>& v, Field<double, 6>& twist) {
  place_all();
  velocity_down(model_.tree, *constants_, work_.placement, v, twist);
}

template class TreeSweeps<LINDEN_ACTING>;

}  // namespace linden
