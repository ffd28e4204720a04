#include "engine/sweeps/tree_sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/tree/advance_map.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/residual_up.hpp"
#include "kernels/tree/rounding_floor_map.hpp"
#include "kernels/tree/velocity_down.hpp"

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
      effects_(plan, model),
      tree_(model.tree) {
  work_.allocate(model.tree.shape);
  if (strategy_.reuses_factor) mass_.allocate(model.tree.shape);
  if (!plan.effects.motions.empty()) given_.allocate(model.tree.shape.velocities);
}

/// Placements of some bodies, and gravity there.
template <bool kEffects>
void TreeSweeps<kEffects>::place(const Field<double>& q, Slots part) {
  placement_map(model_.tree, *constants_, q, part, work_.placement);
  if (strategy_.gravity) gravity_field_down(model_.tree, work_.placement, gravity(), part, work_.field);
}

template <bool kEffects>
void TreeSweeps<kEffects>::find_potentials([[maybe_unused]] const Field<double>& q) {
  if (strategy_.gravity) potential_ = gravity_potential(work_.field, work_.first_moment);
  if constexpr (kEffects) {
    effect_potential_ = effects_.refresh(work_.placement, q);
    potential_ = (strategy_.gravity ? potential_ : 0) + effect_potential_;
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::refresh(const Field<double>& q) {
  tree_.run(
      true, false, [&](Slots part, Evaluated<double>&) { place(q, part); }, [&](Slots part, Evaluated<double>&) { forces(part); });
  valid_.placements = true;
  find_potentials(q);
}

/// Where branches share rows an evaluation leaves the placements of the last it met.
template <bool kEffects>
void TreeSweeps<kEffects>::place_all() {
  if (valid_.placements) return;
  placement_map(model_.tree, *constants_, *q_, work_.placement);
  valid_.placements = true;
}

/// Positions of some joints, and what depends on positions alone.
template <bool kEffects>
void TreeSweeps<kEffects>::arrive_down(Slots part, State<double>& state) {
  if (ties_.empty()) advance(part, state);
  place(state.q, part);
}

/// Forces on some joints and momenta there; found: those of the step that ends are there.
template <bool kEffects>
void TreeSweeps<kEffects>::arrive_up(Slots part, double h, bool found, State<double>& state) {
  forces(part);
  if (found) {
    momentum_end_map(model_.tree, h, work_.end_momentum, work_.force, part, state.p);
  } else {
    momentum_update_map(model_.tree, *constants_, h, work_.displacement, work_.impulse, joint_residual(), work_.force, part, state.p);
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::advance(Slots part, State<double>& state) {
  remember(work_.delta, velocities(model_.tree, part), state.history);
  advance_map(model_.tree, work_.motion, work_.delta, part, state.q);
}

template <bool kEffects>
void TreeSweeps<kEffects>::arrive(double h, State<double>& state) {
  if (!ties_.empty()) {
    advance(all_slots(model_.tree), state);
    for (const Mimic& mimic : mimics()) state.q(mimic.follower_q) = mimic.multiplier * state.q(mimic.leader_q) + mimic.offset;
  }
  if (!valid_.end_momenta) complete();
  tree_.run(
      true, false, [&](Slots part, Evaluated<double>&) { arrive_down(part, state); },
      [&](Slots part, Evaluated<double>&) { arrive_up(part, h, valid_.end_momenta, state); });
  valid_.placements = true;
  find_potentials(state.q);
}

template <bool kEffects>
void TreeSweeps<kEffects>::apply(std::span<const double> force) {
  applied_.assign(force.begin(), force.end());
  if (!strategy_.gravity) {
    for (double& value : work_.force.flat()) value = 0;
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::forces(Slots part) {
  const Tree& tree = model_.tree;
  if (strategy_.gravity) gravity_force_up(tree, *constants_, work_.placement, work_.field, part, work_.first_moment, work_.force);
  if (applied_.empty()) return;
  const Slots rows = velocities(tree, part);
  for (Index row = rows.begin; row < rows.end; ++row) {
    const double applied = applied_[static_cast<std::size_t>(row)];
    work_.force(row) = strategy_.gravity ? work_.force(row) + applied : applied;
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
  now.scale = now.energy;
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
      if (effects_.soft()) effects_.follow(work_.delta);
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

/// action(added), with joints held that are tied.
template <bool kEffects>
template <class Added, class Action>
void TreeSweeps<kEffects>::with_ties(const Added& added, const Action& action) {
  if (ties_.empty()) return action(added);
  action(ties_.held(added));
}

template <bool kEffects>
void TreeSweeps<kEffects>::factor() {
  effects_.with_added([&](const auto& given) {
    with_ties(given, [&](const auto& added) {
      if (options_.solver == Solver::riqn) {
        articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, gains(), added);
      } else {
        newton_factor_up(model_.tree, *constants_, work_.placement, work_.motion, work_.displacement, work_.articulated, gains(),
                         added);
      }
    });
  });
  if (options_.solver == Solver::riqn) return tie_rates(gains());
  tie(gains(), [&](Field<double>& x) {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, work_.variation, x);
  });
}

template <bool kEffects>
void TreeSweeps<kEffects>::tie_rates(const Gains<double>& gains) {
  tie(gains, [&](Field<double>& x) {
    rate_down(model_.tree, *constants_, work_.placement, gains, work_.innovation, work_.variation, x);
  });
}

/// down(x): the second half of a solve.
template <bool kEffects>
template <class Down>
void TreeSweeps<kEffects>::tie(const Gains<double>& gains, const Down& down) {
  if (ties_.empty()) return;
  ties_.factor(
      [&](const Field<double>& r, Field<double>& x) {
        impulse_pass_up(model_.tree, *constants_, work_.placement, gains, r, work_.bias, work_.innovation);
        down(x);
      },
      [&](Index i) { return tied_load(model_.tree, *constants_, gains, work_.bias, work_.variation, i); }, work_.increment);
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
    return effects_.with_added([&](const auto& added) {
      in_parts_up(all_slots(model_.tree), [&](Slots part) { now.norm += pass_part(part, how, added); });
    });
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
    factor();
    now.norm = pass_residual();
    return;
  }
  momentum_map(model_.tree, *constants_, work_.displacement, work_.impulse);
  act(now);
  pass_up(now, Factor::fresh);
}

/// Ties between joints make the whole solve necessary for the norm.
template <bool kEffects>
double TreeSweeps<kEffects>::pass_residual() {
  const double norm =
      impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), work_.residual, work_.bias, work_.innovation);
  if (ties_.empty()) return norm;
  pass_down();
  double tied = 0;
  for (Index row = 0; row < model_.tree.shape.velocities; ++row) tied += work_.residual(row) * work_.increment(row);
  return std::abs(tied);
}

template <bool kEffects>
void TreeSweeps<kEffects>::pass_down() {
  if (options_.solver == Solver::riqn) {
    rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, work_.increment);
  } else {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, work_.variation,
                   work_.increment);
  }
  if (!ties_.empty()) ties_.complete(work_.increment);
}

/// Placements of some bodies where the rows hold another branch's.
template <bool kEffects>
void TreeSweeps<kEffects>::place_again(Slots part) {
  if (strategy_.shares_rows && part.branch > 0) placement_map(model_.tree, *constants_, *q_, part, work_.placement);
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
    if (ties_.empty()) pass_down();  // with ties, pass_up has solved already
    std::swap(work_.increment, work_.applied);
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
  if (!below_ceiling(now.norm, now.energy, fall)) return false;
  complete();
  return is_rounding(now.norm, rounding_floor_map(model_.tree, *constants_, work_.momentum_target, work_.impulse, yields()), epsilons);
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
template <class Added>
void TreeSweeps<kEffects>::factor_mass(const Added& added) {
  place_all();
  with_ties(added, [&](const auto& all) {
    articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, mass_gains(), all);
  });
  tie_rates(mass_gains());
}

template <bool kEffects>
void TreeSweeps<kEffects>::apply_mass_inverse(const Field<double>& p, Field<double>& v) {
  impulse_pass_up(model_.tree, *constants_, work_.placement, mass_gains(), p, work_.bias, work_.innovation);
  rate_down(model_.tree, *constants_, work_.placement, mass_gains(), work_.innovation, work_.variation, v);
  if (!ties_.empty()) ties_.complete(v);
}

template <bool kEffects>
void TreeSweeps<kEffects>::velocity_of(const Field<double>& p, Field<double>& v) {
  effects_.with_rotors([&](const auto& rotors) { factor_mass(rotors); });
  apply_mass_inverse(p, v);
}

template <bool kEffects>
void TreeSweeps<kEffects>::response_to(const Field<double>& impulse, Field<double>& v) {
  if constexpr (kEffects) {
    effects_.with_reading([&](const auto& added) { factor_mass(added); });
    apply_mass_inverse(impulse, v);
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::momentum_of(const Field<double>& v, Field<double>& p) {
  place_all();
  velocity_down(model_.tree, *constants_, work_.placement, v, work_.twist);
  momentum_of_map(model_.tree, *constants_, work_.twist, work_.impulse);
  impulse_up(model_.tree, *constants_, work_.placement, work_.impulse, p);
  if constexpr (kEffects) add_armature<double>(effects_.plan().effects.armature, v, p);
  fold_mimics(ties_.mimics(), p);
}

template <bool kEffects>
const Field<double>& TreeSweeps<kEffects>::read_velocity(const Field<double>& p, Field<double>& v) {
  if constexpr (kEffects) {
    read_ = p;
    effects_.begin_reading(read_);
    fold_mimics(ties_.mimics(), read_);
    const bool given = given_.rows() > 0;
    if (given) {
      effects_.given_velocities(given_);
      spread_mimics<double>(ties_.mimics(), given_);
      momentum_of(given_, work_.momentum);
      for (Index row = 0; row < read_.rows(); ++row) read_(row) -= work_.momentum(row);
    }
    effects_.with_reading([&](const auto& added) { factor_mass(added); });
    apply_mass_inverse(read_, v);
    if (given) {
      for (Index row = 0; row < v.rows(); ++row) v(row) += given_(row);
      momentum_of(v, read_);
    }
    return read_;
  } else {
    velocity_of(p, v);
    return p;
  }
}

template class TreeSweeps<LINDEN_ACTING>;

}  // namespace linden
