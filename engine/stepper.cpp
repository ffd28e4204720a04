#include "engine/stepper.hpp"

#include <cmath>
#include <limits>

#include "engine/convergence.hpp"
#include "kernels/advance_map.hpp"
#include "kernels/articulated_inertia_up.hpp"
#include "kernels/displacement_down.hpp"
#include "kernels/gravity.hpp"
#include "kernels/increment_down.hpp"
#include "kernels/innovation_up.hpp"
#include "kernels/momentum_map.hpp"
#include "kernels/momentum_update_map.hpp"
#include "kernels/motion_map.hpp"
#include "kernels/newton_factor_up.hpp"
#include "kernels/placement_map.hpp"
#include "kernels/residual_up.hpp"
#include "kernels/rounding_floor_map.hpp"
#include "kernels/velocity_down.hpp"

namespace linden {
namespace {

constexpr int kMaxBacktracks = 10;

/// Only a residual within this factor of the tolerance is looked at for bare rounding: the look costs a tenth of a correction.
constexpr double kNearTolerance = 1e4;

/// Next value of the polynomial through the last 1, ..., 5 values, latest first.
constexpr double kExtrapolation[kHistory][kHistory] = {
    {1}, {2, -1}, {3, -3, 1}, {4, -6, 4, -1}, {5, -10, 10, -5, 1},
};

/// Bodies that the sweeps of a part of a step go over before the next part: 64 of some 600 bytes stay in the nearest cache.
constexpr Index kPart = 64;

/// Revisions of effects' states in one solve: a pile of joints that stick and slide at once takes some ten.
constexpr int kMostRevisions = 20, kLastRevision = 60;

/// From then on they are made one by one.
constexpr int kBulkRevisions = 5;

/// Where they do not settle: speeds up to which friction is made smooth, one after the other [m/s, rad/s].
constexpr double kSoftCreeps[] = {1e-2, 1e-3, 1e-4, 1e-5};
constexpr int kMostSoftCorrections = 40;

/// A correction is cut where the slope at its end is steeper than this share of that at its beginning, the other way.
constexpr double kSteepest = 0.5;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Stepper::Stepper(const Model& model, const Options& options, const EffectPlan* plan)
    : model_(model),
      constants_(&model.constants),
      options_(options),
      max_iterations_(options.max_iterations > 0 ? options.max_iterations : options.solver == Solver::newton ? 50 : 1000),
      gravity_(options.gravity != std::array<double, 3>{0, 0, 0}),
      one_pass_(options.solver == Solver::newton && options.stop == StopTest::energy && model.mimics.empty()),
      ties_(model.mimics, model.tree.shape.velocities) {
  check(options);
  work_.allocate(model.tree.shape);
  last_good_.allocate(model.tree.shape);
  if (plan != nullptr && plan->any()) effects_ = std::make_unique<EffectSweeps<double>>(*plan, model);
  if (effects_) {
    before_.allocate(model.tree.shape.velocities);
    before_innovation_.allocate(model.tree.shape.velocities);
  }
}

void Stepper::refresh(const State<double>& state) {
  in_parts_down([&](Slots part) {
    placement_map(model_.tree, *constants_, state.q, part, work_.placement);
    if (gravity_) gravity_field_down(model_.tree, work_.placement, gravity_vector(), part, work_.field);
  });
  forces();
  if (!effects_) return;
  effect_potential_ = effects_->refresh(work_.placement, state.q);
  potential_ = (gravity_ ? potential_ : 0) + effect_potential_;
}

void Stepper::apply(std::span<const double> force) {
  applied_.assign(force.begin(), force.end());
  if (!gravity_) {
    for (double& value : work_.force.flat()) value = 0;
  }
}

void Stepper::forces() {
  if (gravity_) {
    potential_ = gravity_force_up(model_.tree, *constants_, work_.placement, work_.field, work_.first_moment, work_.force);
  }
  for (std::size_t row = 0; row < applied_.size(); ++row) {
    double& force = work_.force.flat()[row];
    force = gravity_ ? force + applied_[row] : applied_[row];
  }
}

Vec3<double> Stepper::gravity_vector() const { return {options_.gravity[0], options_.gravity[1], options_.gravity[2]}; }

StepReport Stepper::step(State<double>& state, int& history, double time, double h) {
  StepReport report;
  time_ = time;
  effect_work_ = {};
  report.status = solve(state, history, h, report);
  if (report.ok()) {
    finish(state, history, h);
    return report;
  }
  // The whole step failed: two halves, each split again if need be, from the state as it was.
  last_good_ = state;
  const int history_before = history;
  history = 0;
  report.substeps = 0;
  if (halves(state, history, h, 1, report)) {
    report.status = StepStatus::converged;
    report.slot = 0;
    return report;
  }
  report.residual = failed_residual_;
  state = last_good_;
  history = history_before;
  effect_work_ = {};
  refresh(state);
  return report;
}

bool Stepper::halves(State<double>& state, int& history, double h, int depth, StepReport& report) {
  if (depth > options_.max_splits) return false;
  for (int half = 0; half < 2; ++half) {
    report.status = solve(state, 0, h / 2, report);
    if (report.ok()) {
      finish(state, history, h / 2);
      report.substeps += 1;
    } else if (!halves(state, history, h / 2, depth + 1, report)) {
      return false;
    }
    history = 0;
  }
  return true;
}

bool Stepper::Evaluated::usable() const { return least_w > 0 && std::isfinite(plain) && std::isfinite(energy); }

/// action(slots) for parts of the tree, root to leaves: all sweeps of an action over as many bodies as stay in the nearest cache.
template <class Action>
void Stepper::in_parts_down(const Action& action) const {
  const Index slots = model_.tree.shape.slots;
  for (Index begin = 1; begin < slots; begin += kPart) action(Slots{begin, std::min(begin + kPart, slots)});
}

template <class Action>
void Stepper::in_parts_up(const Action& action) const {
  for (Index end = model_.tree.shape.slots; end > 1; end = std::max<Index>(1, end - kPart)) {
    action(Slots{std::max<Index>(1, end - kPart), end});
  }
}

/// motions(slots) brings work_.motion up to date.
template <class Motions>
Stepper::Evaluated Stepper::evaluate(StepReport& report, const Motions& motions) {
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
void Stepper::act(Evaluated& now) {
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
void Stepper::with_added(const Action& action) {
  if (!effects_) return action(NothingAdded{});
  const Field<double>& stiffness = effects_->joint_sum().stiffness;
  const Field<double, 36>& pull = effects_->body_sum().pull;
  const EffectPlan& plan = effects_->plan();
  if (plan.joints && plan.bodies) return action(EffectsAdded<double, true, true>{stiffness, pull});
  if (plan.joints) return action(EffectsAdded<double, true, false>{stiffness, pull});
  action(EffectsAdded<double, false, true>{stiffness, pull});
}

void Stepper::factor_mass() {
  if (effects_ && effects_->rotors().rows() > 0) {
    const EffectsAdded<double, true, false> rotors{effects_->rotors(), effects_->body_sum().pull};
    articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, gains(), rotors);
  } else {
    articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, gains());
  }
  tie_rates();
}

void Stepper::tie_rates() {
  if (ties_.empty()) return;
  ties_.factor(
      [&](const Field<double>& r, Field<double>& x) {
        impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), r, work_.bias, work_.innovation);
        rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, x);
      },
      work_.increment);
}

void Stepper::factor(StepReport& report) {
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

/// Squared energy norm of the residual of an evaluation.
double Stepper::pass_up(Evaluated& now) {
  if (one_pass_) return innovation_up(model_.tree, *constants_, work_);
  now.plain = residual_up(model_.tree, *constants_, work_.placement, work_.momentum_target, work_.impulse, work_.residual);
  fold_mimics(ties_.mimics(), work_.residual);
  return pass_residual();
}

/// The same with a fresh factor.
double Stepper::factor_and_pass(Evaluated& now, StepReport& report) {
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

/// The same for an evaluation that was passed up already.
double Stepper::factor_and_pass_again(Evaluated& now, StepReport& report) {
  if (!one_pass_) {
    factor(report);
    return pass_residual();
  }
  momentum_map(model_.tree, *constants_, work_.displacement, work_.impulse);
  if (effects_) act(now);
  return factor_and_pass(now, report);
}

/// Ties between joints make the whole solve necessary for the norm.
double Stepper::pass_residual() {
  const double norm =
      impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), work_.residual, work_.bias, work_.innovation);
  if (ties_.empty()) return norm;
  pass_down();
  double tied = 0;
  for (Index row = 0; row < model_.tree.shape.velocities; ++row) tied += work_.residual(row) * work_.increment(row);
  return std::abs(tied);
}

void Stepper::pass_down() {
  if (options_.solver == Solver::riqn) {
    rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, work_.increment);
  } else {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, work_.variation,
                   work_.increment);
  }
  if (!ties_.empty()) ties_.complete(work_.increment);
}

/// The evaluation after the correction applied last, times `factor`.
Stepper::Evaluated Stepper::correct(double factor, StepReport& report) {
  return evaluate(report, [&](Slots part) {
    correct_motion_map(model_.tree, *constants_, work_.applied, factor, part, work_.delta, work_.motion);
  });
}

/// The evaluation after a correction by what the factor makes of the residual.
Stepper::Evaluated Stepper::solve_and_correct(StepReport& report) {
  report.iterations += 1;
  if (!one_pass_) {
    if (ties_.empty()) pass_down();  // with ties, pass_up has solved already
    std::swap(work_.increment, work_.applied);
    return correct(1, report);
  }
  return evaluate(report, [&](Slots part) {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, part, work_.variation,
                   work_.applied);
    correct_motion_map(model_.tree, *constants_, work_.applied, 1.0, part, work_.delta, work_.motion);
  });
}

bool Stepper::converged(const Evaluated& now, double norm, double h) const {
  if (options_.stop == StopTest::absolute) return std::sqrt(now.plain) <= options_.tolerance * std::abs(h);
  return 0.5 * norm <= options_.tolerance * options_.tolerance * now.scale;
}

/// h^2 x kinetic energy that gravity gives in a step to what is at rest.
double Stepper::fall(double h) const {
  const auto& g = options_.gravity;
  return 0.5 * constants_->subtree_mass(0) * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * h * h * h * h;
}

void Stepper::begin_effects(const State<double>& state, int history, double h) {
  if (effects_->plan().joints) std::ranges::copy(work_.momentum_target.flat(), effects_->plain_target().flat().begin());
  const auto past = [&](Index row, int steps) { return state.history(row, steps - 1); };
  effects_->begin(time_ + 0.5 * h, h, state.q, past, history >= 2, work_.delta);
  if (history > 0) {
    for (Index row = 0; row < before_.rows(); ++row) before_(row) = state.history(row, 0);
  } else {
    velocity_of(state.p, before_);
    for (double& value : before_.flat()) value *= h;
  }
  effect_scale_ = fall(h);
  guess_points_ = true;
  known_ = history > 0;
}

std::span<double> Stepper::servo_targets() {
  if (!effects_) return {};
  return effects_->servo_targets().flat();
}

std::vector<std::span<double>> Stepper::effect_memory() {
  if (!effects_) return {};
  const auto memory = effects_->memory();
  return {memory.begin(), memory.end()};
}

/// Whether the state of an effect changed; work_.delta then says what the motion is to be.
bool Stepper::revise_effects(bool settled, bool one_by_one) {
  if (!effects_->revise(left(), settled, one_by_one, work_.delta)) return false;
  displacement_map(model_.tree, work_.motion, work_.delta);
  return true;
}

Index Stepper::worst_displacement() const {
  Index worst = 1;
  double least = kInfinity;
  for (Index i = 1; i < model_.tree.shape.slots; ++i) {
    const double w = std::min(work_.displacement(i, 3), work_.motion(i, 3));
    if (!std::isfinite(w)) return i;
    if (w < least) {
      least = w;
      worst = i;
    }
  }
  return worst;
}

Index Stepper::fastest_body() const {
  Index fastest = 1;
  double most = -1;
  for (Index i = 1; i < model_.tree.shape.slots; ++i) {
    const auto u = log(load<Displacement, double>(work_.displacement, i));
    const double energy = dot(load<Inertia, double>(constants_->inertia, i) * u, u);
    if (energy > most) {
      most = energy;
      fastest = i;
    }
  }
  return fastest;
}

Index Stepper::largest_residual() const {
  Index worst = 1;
  double largest = -1;
  up(model_.tree, [&](auto joint, Index i) {
    const Wrench<double> u = load_joint(joint, work_.innovation, model_.tree.first_v(i));
    const Wrench<double> given = yield(joint, work_.joint_inverse, model_.tree.first_block(i), u);
    const double share = dot(u.n, given.n) + dot(u.f, given.f);
    if (share > largest || !std::isfinite(share)) {
      largest = share;
      worst = i;
    }
  });
  return worst;
}

/// Whether a residual of this squared energy norm is rounding alone: epsilons of the impulses that meet at each joint, and small beside
/// the motion, or beside what gravity alone would do to it where all is at rest.
bool Stepper::at_rounding_floor(const Evaluated& now, double norm, double h, double epsilons) const {
  if (!(0.5 * norm <= kFloorCeiling * kFloorCeiling * (now.energy + fall(h)))) return false;
  const double sum = rounding_floor_map(model_.tree, *constants_, work_.momentum_target, work_.impulse, work_.joint_inverse);
  const double unit = epsilons * std::numeric_limits<double>::epsilon();
  return norm <= unit * unit * sum;
}

void Stepper::first_guess(const State<double>& state, int history, double h) {
  Field<double>& delta = work_.delta;
  const Index n = model_.tree.shape.velocities;
  const auto zero = [&] {
    for (Index row = 0; row < n; ++row) delta(row) = 0;
  };
  switch (options_.guess) {
    case FirstGuess::ig1: return zero();
    case FirstGuess::ig2:
      if (history == 0) break;
      for (Index row = 0; row < n; ++row) delta(row) = state.history(row, 0);
      return;
    case FirstGuess::ig3: {
      // qdd = M^-1 (-C + Q), semi-implicit Euler: delta = h (v + h qdd)
      velocity_of(state.p, delta);
      velocity_down(model_.tree, *constants_, work_.placement, delta, work_.twist);
      coriolis_down(model_.tree, *constants_, work_.placement, delta, work_.twist, work_.bias, work_.impulse);
      impulse_up(model_.tree, *constants_, work_.placement, work_.impulse, work_.residual);
      for (Index row = 0; row < n; ++row) work_.residual(row) = work_.force(row) - work_.residual(row);
      apply_mass_inverse(work_.residual, work_.residual);
      for (Index row = 0; row < n; ++row) delta(row) = h * (delta(row) + h * work_.residual(row));
      return;
    }
    case FirstGuess::extrapolation:
      if (history == 0) break;
      for (Index row = 0; row < n; ++row) {
        double next = 0;
        for (int k = 0; k < history; ++k) next += kExtrapolation[history - 1][k] * state.history(row, k);
        delta(row) = next;
      }
      return;
  }
  // No displacement is known yet: h M^-1 (p + h/2 Q).
  velocity_of(work_.momentum_target, delta);
}

StepStatus Stepper::solve(const State<double>& state, int history, double h, StepReport& report) {
  const StepStatus status = find_root(state, history, h, report);
  if (status != StepStatus::converged || !gains_energy(state, h)) return status;
  report.slot = fastest_body();
  return StepStatus::gains_energy;
}

/// Work of a force along the displacement of the step [J].
double Stepper::work(const Field<double>& force) const {
  double sum = 0;
  for (Index row = 0; row < model_.tree.shape.velocities; ++row) sum += force(row) * work_.delta(row);
  return sum;
}

/// Discrete energy, -dL_d/dh, is kinetic energy of the mean motion plus the mean potential of both ends: between neighbouring steps it
/// changes by what is compared here. Nothing is known of the step before the first.
bool Stepper::gains_energy(const State<double>& state, double h) {
  displacement_map(model_.tree, work_.motion, work_.delta);
  kinetic_ = momentum_energy_ / (h * h);
  const double before = state.pace(0, 0);
  double gain = kinetic_ - before - 0.5 * (state.pace(0, 1) + work(work_.force));
  if (effects_) {
    solved_work_ = effects_->work(left(), work_.delta, before_, known_);
    // forces that nearly balance leave less kinetic energy than their works, taken half a step apart, differ by
    double activity = effects_->activity(solved_work_, work_.motion, work_.delta) + effect_potential_;
    for (Index row = 0; row < model_.tree.shape.velocities; ++row) activity += std::abs(work_.force(row) * work_.delta(row));
    gain -= activity;
  }
  const double most = kMostGain * std::max(kinetic_, before);
  return gain > most && (options_.order == 2 || gain - push() > most);
}

/// Kinetic energy that the forces give in a whole step to what is at rest: neighbouring sub-steps of different length differ by so much
/// where the motion turns back.
double Stepper::push() {
  if (one_pass_) std::swap(work_.innovation, work_.residual);  // what the solve left is still needed
  velocity_of(work_.force, work_.increment);
  if (one_pass_) std::swap(work_.innovation, work_.residual);
  double sum = 0;
  for (Index row = 0; row < model_.tree.shape.velocities; ++row) sum += work_.force(row) * work_.increment(row);
  return 0.5 * options_.step * options_.step * sum;
}

/// Leads to the states that sudden revisions went round in circles about, by friction that is smooth at first and then ever less so;
/// `whole`: until that has converged.
///
/// With smooth friction the solution of the step minimises a function, convex but for the coupling of friction to the load it goes with,
/// whose gradient is the residual; each correction is cut to where it falls no further. Its slope along a correction is r.(A^-1 r_before),
/// the sum of u (d^-1 u_before): known from the passes.
template <class Start>
void Stepper::approach_softly(Evaluated& now, double& norm, double h, bool whole, const Start& start, StepReport& report) {
  for (const double creep : kSoftCreeps) {
    const bool to_the_end = whole && creep == std::end(kSoftCreeps)[-1];
    displacement_map(model_.tree, work_.motion, work_.delta);
    effects_->soften(creep, work_.delta);
    now = evaluate(report, start);
    norm = factor_and_pass(now, report);
    for (int k = 0; k < kMostSoftCorrections; ++k) {
      if (!now.usable() || !std::isfinite(norm)) return;
      const bool settled = 0.5 * norm <= kSettled * kSettled * now.scale;
      if (revise_effects(settled, false)) {
        now = evaluate(report, start);
        norm = factor_and_pass(now, report);
        continue;
      }
      if (to_the_end ? converged(now, norm, h) || at_rounding_floor(now, norm, h, kFloorEpsilons) : settled) break;
      std::ranges::copy(work_.innovation.flat(), before_innovation_.flat().begin());
      const double slope_before = slope_along();
      now = solve_and_correct(report);
      double taken = 1;
      for (int cut = 0; cut < kMaxBacktracks; ++cut) {
        double share = 0.5;
        if (now.usable()) {
          norm = pass_up(now);
          const double slope = slope_along();
          if (slope > -kSteepest * slope_before) break;
          share = std::clamp(slope_before / (slope_before - slope), 0.1, 0.9);
        }
        now = correct(taken * (share - 1), report);
        taken *= share;
      }
      if (now.usable()) norm = factor_and_pass_again(now, report);
    }
  }
}

/// u.(d^-1 u_before), summed over the joints.
double Stepper::slope_along() const {
  double sum = 0;
  up(model_.tree, [&](auto joint, Index i) {
    const Index row = model_.tree.first_v(i);
    const Wrench<double> u = load_joint(joint, work_.innovation, row);
    const Wrench<double> given = yield(joint, work_.joint_inverse, model_.tree.first_block(i), load_joint(joint, before_innovation_, row));
    sum += dot(u.n, given.n) + dot(u.f, given.f);
  });
  return sum;
}

StepStatus Stepper::find_root(const State<double>& state, int history, double h, StepReport& report) {
  momentum_target_map(model_.tree, h, state.p, work_.force, work_.momentum_target);
  first_guess(state, history, h);
  spread_mimics<double>(ties_.mimics(), work_.delta);  // corrections keep ties, so the guess must
  if (effects_) begin_effects(state, history, h);
  const auto start = [&](Slots part) { motion_map(model_.tree, *constants_, work_.delta, part, work_.motion); };
  Evaluated now = evaluate(report, start);
  if (!now.usable()) {
    // no displacement at all is always within the range of log
    for (double& value : work_.delta.flat()) value = 0;
    now = evaluate(report, start);
  }
  double norm = factor_and_pass(now, report);
  bool fresh = true;  // the factor belongs to the current displacement
  StepStatus trouble = StepStatus::not_converged;  // of the last correction that had to be cut short

  const auto end = [&](StepStatus status) {
    const double relative = now.scale > 0 ? std::sqrt(0.5 * norm / now.scale) : std::sqrt(norm);
    if (status == StepStatus::converged) {
      momentum_energy_ = now.energy;
      report.residual = std::max(report.residual, relative);
    } else {
      failed_residual_ = relative;
    }
    if (status == StepStatus::not_converged) report.slot = largest_residual();
    return status;
  };
  const auto try_out = [&](const Evaluated& tried) {
    now = tried;
    if (now.usable()) {
      const double squared = pass_up(now);
      if (std::isfinite(squared)) return squared;
    }
    trouble = now.least_w > 0 ? StepStatus::not_finite : StepStatus::past_pi;
    report.slot = worst_displacement();
    return kInfinity;
  };

  // the evaluation and factor for other states of effects, where they changed
  const bool revises = effects_ && effects_->plan().revises;
  int revisions = 0;
  const auto revised = [&](bool settled) {
    if (revises && one_pass_ && (revisions == kBulkRevisions || revisions == kMostRevisions)) {
      // at first only to find the states; where they still do not settle the step stays with friction smooth below the least creep
      const bool whole = revisions == kMostRevisions;
      approach_softly(now, norm, h, whole, start, report);
      if (!whole) effects_->harden();
      revisions += 1;
      displacement_map(model_.tree, work_.motion, work_.delta);
      now = evaluate(report, start);
      norm = factor_and_pass(now, report);
      return fresh = true;
    }
    if (!revises || !now.usable() || !std::isfinite(norm) || revisions == kLastRevision) return false;
    if (!revise_effects(settled, revisions >= kBulkRevisions)) return false;
    revisions += 1;
    report.iterations += 1;
    now = evaluate(report, start);
    norm = factor_and_pass(now, report);
    fresh = true;
    return true;
  };

  bool at_floor = false;
  for (int iteration = 0;; ++iteration) {
    if (!std::isfinite(norm) || !now.usable()) {
      report.slot = worst_displacement();
      return end(StepStatus::not_finite);
    }
    const bool done = at_floor || converged(now, norm, h);
    if (revised(done || 0.5 * norm <= kSettled * kSettled * now.scale)) {
      at_floor = false;
      continue;
    }
    if (done && revisions < kLastRevision) {
      report.at_rounding_floor |= at_floor;
      return end(StepStatus::converged);
    }
    if (iteration >= max_iterations_ || done) return end(StepStatus::not_converged);

    const double before = norm;
    double taken = 1;
    norm = try_out(solve_and_correct(report));
    if (revised(false)) continue;
    const bool slow = norm > kSlowProgress * kSlowProgress * before;
    const bool close = norm <= kNearTolerance * kNearTolerance * options_.tolerance * options_.tolerance * now.scale;
    if ((slow && at_rounding_floor(now, norm, h, kFloorEpsilons)) ||
        (close && !converged(now, norm, h) && at_rounding_floor(now, norm, h, kBareRounding))) {
      at_floor = true;
      continue;
    }
    for (int cut = 0; !(norm < before) && cut < kMaxBacktracks; ++cut) {
      taken /= 2;
      norm = try_out(correct(-taken, report));
      report.backtracks += 1;
    }
    if (!(norm < before)) {
      norm = try_out(correct(-taken, report));  // back to where this iteration began
      if (at_rounding_floor(now, norm, h, kFloorEpsilons)) {
        at_floor = true;
        continue;
      }
      if (fresh || options_.solver == Solver::riqn) return end(trouble);
    }
    fresh = false;
    if (slow && options_.solver == Solver::newton) {
      norm = factor_and_pass_again(now, report);
      fresh = true;
    }
  }
}

/// The new state, from a displacement that solves the step.
void Stepper::finish(State<double>& state, int& history, double h) {
  const Tree& tree = model_.tree;
  const double work_at_begin = work(work_.force);
  const bool joints = effects_ && effects_->plan().joints;
  if (joints) effects_->end_joints(work_.delta, work_.motion, one_pass_ ? work_.innovation : work_.residual, work_.increment);
  if (effects_ && effects_->plan().bodies) effects_->end_bodies(work_.placement, work_.displacement, work_.impulse);
  for (Index row = 0; row < tree.shape.velocities; ++row) {
    for (int k = kHistory - 1; k > 0; --k) state.history(row, k) = state.history(row, k - 1);
    state.history(row, 0) = work_.delta(row);
  }
  history = std::min(history + 1, kHistory);
  advance_map(tree, work_.motion, work_.delta, state.q);
  for (const Mimic& mimic : ties_.mimics()) {
    state.q(mimic.follower_q) = mimic.multiplier * state.q(mimic.leader_q) + mimic.offset;
  }
  refresh(state);
  state.pace(0, 1) = 0.5 * (work_at_begin + work(work_.force));
  if (effects_) {
    // an impact may take in one step what the next gives back
    state.pace(0, 0) = std::max(kinetic_, kImpactMemory * state.pace(0, 0));
    solved_work_.ground -= effects_->ground_stored();
    effect_work_.add(solved_work_);
    time_ += h;
  } else {
    state.pace(0, 0) = kinetic_;
  }
  momentum_update_map(tree, *constants_, h, work_.displacement, work_.impulse,
                      one_pass_ ? work_.innovation : work_.residual, work_.force, state.p);
  if (joints) {
    for (Index row = 0; row < tree.shape.velocities; ++row) state.p(row) += work_.increment(row);
  }
  fold_mimics(ties_.mimics(), state.p);
}

void Stepper::apply_mass_inverse(const Field<double>& p, Field<double>& v) {
  impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), p, work_.bias, work_.innovation);
  rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, v);
  if (!ties_.empty()) ties_.complete(v);
}

void Stepper::velocity_of(const Field<double>& p, Field<double>& v) {
  factor_mass();
  apply_mass_inverse(p, v);
}

void Stepper::forget() {
  if (effects_) effects_->forget();
}

const Field<double>& Stepper::read_velocity(const Field<double>& p, Field<double>& v) {
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

Energy Stepper::energy_of(const Field<double>& p, Field<double>& rate) {
  const Field<double>& read = read_velocity(p, rate);
  double kinetic = 0;
  for (Index row = 0; row < p.rows(); ++row) kinetic += 0.5 * read(row) * rate(row);
  return {kinetic, potential_};
}

void Stepper::momentum_of(const Field<double>& v, Field<double>& p) {
  velocity_down(model_.tree, *constants_, work_.placement, v, work_.twist);
  momentum_of_map(model_.tree, *constants_, work_.twist, work_.impulse);
  impulse_up(model_.tree, *constants_, work_.placement, work_.impulse, p);
  if (effects_) add_armature<double>(effects_->plan().effects.armature, v, p);
  fold_mimics(ties_.mimics(), p);
}

Wrench<double> Stepper::total_momentum(const Field<double>& v) {
  momentum_of(v, work_.increment);
  return load<Wrench, double>(work_.impulse, 0);
}

}  // namespace linden
