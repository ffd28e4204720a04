#include "engine/sweeps/schedule.hpp"

#include <algorithm>
#include <cmath>

#include "engine/effects/effect_sweeps.hpp"
#include "engine/guess/extrapolation.hpp"
#include "engine/sweeps/effect_schedule.hpp"
#include "engine/sweeps/step_memory.hpp"
#include "engine/sweeps/tree_kernels.hpp"

namespace linden {
namespace {

using Memory = StepMemory&;

/// action(added): what effects and ties add to a factor; added: what effects do.
template <class Added, class Action>
void with_ties(Memory m, const Added& added, const Action& action) {
  if (m.ties.empty()) return action(added);
  action(m.ties.held(added));
}

/// Couplings that close together; newton: within the factor of the Jacobian, else within that of the mass matrix.
template <bool kNewton>
void close(Memory m, std::size_t closure, Coupled of, const Gains<double>& gains) {
  const std::array<double, 36> felt = m.couplings.close(closure, of, m.constants, m.work.placement, kNewton ? &m.work.motion : nullptr, gains, m.ties, true);
  const Index slot = m.couplings.slot_of(closure);
  if (slot == 0) return;
  if constexpr (kNewton) {
    add_inertia(m.model.tree, all_slots(m.model.tree), slot, felt, m.work.articulated);
  } else {
    add_inertia(slot, felt, m.work.articulated);
  }
}
template <bool kNewton>
void close_at_world(Memory m, Coupled of, const Gains<double>& gains) {
  m.couplings.up_to_closures([](Slots) {}, [&](std::size_t closure) {
    if (m.couplings.slot_of(closure) == 0) close<kNewton>(m, closure, of, gains);
  });
}
/// A factor by sweep(slots), leaves to root, with couplings that close on the way.
template <bool kNewton, class Sweep>
void factor_to_world(Memory m, Coupled of, const Gains<double>& gains, const Sweep& sweep) {
  m.couplings.up_to_closures(sweep, [&](std::size_t closure) {
    if (m.couplings.slot_of(closure) != 0) close<kNewton>(m, closure, of, gains);
  });
}

void factor_mass(Memory m, Slots) {
  const auto part_up = [&](Slots part) {
    const auto factor = [&](const auto& rotors) {
      with_ties(m, rotors, [&](const auto& added) {
        articulated_inertia_up(m.model.tree, m.constants, m.work.placement, part, m.work.articulated, m.mass_gains(), added);
      });
    };
    m.effects ? m.effects->with_rotors(factor) : factor(NothingAdded{});
  };
  factor_to_world<false>(m, Coupled::velocities, m.mass_gains(), part_up);
}

template <bool kNewton>
void factor(Memory m, Slots part) {
  const auto all = [&](const auto& effects) {
    with_ties(m, effects, [&](const auto& added) {
      if constexpr (kNewton) {
        newton_factor_up(m.model.tree, m.constants, m.work.placement, m.work.motion, m.work.displacement, part, m.work.articulated,
                         m.gains(), added);
      } else {
        articulated_inertia_up(m.model.tree, m.constants, m.work.placement, part, m.work.articulated, m.gains(), added);
      }
    });
  };
  if (m.effects) return m.effects->with_added(all);
  all(NothingAdded{});
}
template <bool kNewton>
void factor_coupled(Memory m, Slots) {
  factor_to_world<kNewton>(m, Coupled::step, m.gains(), [&](Slots part) { factor<kNewton>(m, part); });
}

void pass_up(Memory m, const Gains<double>& gains, const Field<double>& right_side, Slots part) {
  m.now.norm += impulse_pass_up(m.model.tree, m.constants, m.work.placement, gains, right_side, part, m.work.bias, m.work.innovation);
}
void pass_down(Memory m, Slots part, Field<double>& correction) {
  increment_down<true>(m.model.tree, m.constants, m.work.placement, m.work.motion, m.gains(), m.work.innovation, part, m.work.variation, correction);
}
void pass_down_mass(Memory m, const Gains<double>& gains, Slots part, Field<double>& correction) {
  rate_down(m.model.tree, m.constants, m.work.placement, gains, m.work.innovation, part, m.work.variation, correction);
}
/// The same with what couplings do on the way.
void solve_up(Memory m, Coupled of, const Gains<double>& gains, const Field<double>& right_side) {
  m.now.norm = 0;
  m.couplings.begin_solve(of);
  m.couplings.up_to_closures([&](Slots part) { pass_up(m, gains, right_side, part); },
                             [&](std::size_t closure) { m.couplings.yield(closure, of, m.ties, m.work.innovation, m.work.bias); });
}
template <class Sweep>
void solve_down(Memory m, Coupled of, const Sweep& sweep) {
  m.couplings.down_from_closures(sweep, [&](std::size_t closure) { m.couplings.push(closure, of, m.work.variation, m.work.innovation); });
}

/// What all joints do while a tied coordinate moves; newton: with the factor of the Jacobian, else with that of the mass matrix.
void factor_ties(Memory m, const Gains<double>& gains, bool newton) {
  const Slots all = all_slots(m.model.tree);
  m.ties.factor(
      [&](const Field<double>& r, Field<double>& x) {
        pass_up(m, gains, r, all);
        newton ? pass_down(m, all, x) : pass_down_mass(m, gains, all, x);
      },
      [&](Index i) { return tied_load(m.model.tree, m.constants, gains, m.work.bias, m.work.variation, i); }, m.work.increment);
}

void spread(Memory m, Slots) { spread_mimics<double>(m.ties.mimics(), m.work.delta); }
void place(Memory m, Slots part) { placement_map(m.model.tree, m.constants, m.state.q, part, m.work.placement); }
void move(Memory m, Slots part) { motion_map(m.model.tree, m.constants, m.work.delta, part, m.work.motion); }
void find_coordinates(Memory m, Slots) { displacement_map(m.model.tree, m.work.motion, m.work.delta); }

Slots rows_of(Memory m, Slots part) { return velocities(m.model.tree, part); }

/// An array of the memory, by its name.
struct Array {
  std::string name;
  Field<double>& (*of)(Memory);
};
const Array kP{"p", [](Memory m) -> Field<double>& { return m.state.p; }};
const Array kBefore{"before", [](Memory m) -> Field<double>& { return m.before; }};
const Array kTarget{"momentum_target", [](Memory m) -> Field<double>& { return m.work.momentum_target; }};
const Array kResidual{"residual", [](Memory m) -> Field<double>& { return m.work.residual; }};
const Array kDelta{"delta", [](Memory m) -> Field<double>& { return m.work.delta; }};

constexpr std::string_view kTies = "ties: a tree solve for each leader", kCompletion = "ties: completion";
constexpr std::string_view kCloseAtWorld = "couplings: rows that close at the world, and their factor";

/// Writes the list phase by phase.
class Writer {
 public:
  Writer(const Model& model, const Options& options, const EffectPlan& plan)
      : draft_{model, options, plan, strategy_of(model, options, plan)} {}

  std::vector<Sweep> list() {
    first();
    evaluation();
    add_states_of_effects(draft_);
    changed();
    correction();
    last();
    return std::move(draft_.sweeps);
  }

 private:
  template <class Run>
  Sweep& add(When when, std::string_view name, std::string_view reads, std::string_view writes, const Run& run, Way way = Way::whole) {
    Sweep& sweep = draft_.add(when, name, reads, writes, run);
    sweep.way = way;
    return sweep;
  }
  bool ties() const { return !draft_.model.mimics.empty(); }
  bool couplings() const { return !draft_.model.couplings.empty(); }
  /// Whether an evaluation solves for the correction, not its first half alone.
  bool solves_at_once() const { return ties() || couplings(); }
  /// What a sweep reads where couplings close on its way, and what the second half of a solve writes.
  std::string coupled() const { return couplings() ? ", couplings" : ""; }
  std::string pushed() const { return couplings() ? ", couplings, innovation" : ""; }
  bool springs() const { return std::ranges::any_of(draft_.model.couplings, gives_way); }
  bool newton() const { return draft_.options.solver == Solver::newton; }
  bool one_pass() const { return draft_.strategy.one_pass; }

  void first();
  void guess();
  void start();
  void explicit_guess();
  void factor_mass_matrix(When when);
  void solve_mass_matrix(When when, const Array& right_side, const Array& solution);
  void evaluation();
  void residual_by_itself();
  void changed();
  void correction();
  void last();
  void complete();
  void arrival();

  ScheduleDraft draft_;
};

void Writer::first() {
  if (couplings()) {
    add(When::first, "couplings: first multipliers", "history, couplings", "couplings", [](Memory m, Slots) {
      m.couplings.begin(m.options.step);
      if (m.history == 0 || !m.couplings.has_history()) return;
      const Extrapolation guess = extrapolation(m.state.history, m.history);
      m.couplings.guess(std::span(guess.shares).first(static_cast<std::size_t>(guess.terms)));
    });
  }
  add(When::first, "momentum_target_map", "p, force", "momentum_target", [](Memory m, Slots part) {
    momentum_target_map(m.model.tree, m.options.step, m.state.p, m.work.force, part, m.work.momentum_target);
  }, Way::down);
  guess();
  add_beginning_of_effects(draft_);
  if (ties()) add(When::first, "spread_mimics", "delta", "delta", spread);
  add(When::first, "motion_map", "screw, delta", "motion", move, Way::down);
}

void Writer::guess() {
  constexpr std::string_view extrapolation_name = "first guess: extrapolation", ig1 = "first guess: ig1", ig2 = "first guess: ig2";
  switch (draft_.options.guess) {
    case FirstGuess::extrapolation:
      add(When::first, extrapolation_name, "history", "delta", [](Memory m, Slots part) {
        if (m.history > 0) extrapolate(extrapolation(m.state.history, m.history), m.state.history, rows_of(m, part), m.work.delta);
      }, Way::down);
      break;
    case FirstGuess::ig1:
      add(When::first, ig1, "", "delta", [](Memory m, Slots) { std::ranges::fill(m.work.delta.flat(), 0.0); });
      break;
    case FirstGuess::ig2:
      add(When::first, ig2, "history", "delta", [](Memory m, Slots) {
        for (Index row = 0; m.history > 0 && row < m.work.delta.rows(); ++row) m.work.delta(row) = m.state.history(row, 0);
      });
      break;
    case FirstGuess::ig3: explicit_guess(); break;
  }
  if (draft_.plan.any() && draft_.options.order == 2) {
    add(When::first, "last_displacement", "history, last_step", "before", [](Memory m, Slots) {
      if (!m.is_known()) return;
      const double longer = m.options.step / m.state.last_step(0);
      for (Index row = 0; row < m.before.rows(); ++row) m.before(row) = longer * m.state.history(row, 0);
    });
  }
  start();
}

/// Where no displacement is known yet: what momenta and forces alone would do, h M^-1 (p + h/2 Q), and to effects h M^-1 p.
void Writer::start() {
  const bool guesses = draft_.options.guess == FirstGuess::extrapolation || draft_.options.guess == FirstGuess::ig2;
  if (!guesses && !draft_.plan.any()) return;
  factor_mass_matrix(When::start);
  if (guesses) solve_mass_matrix(When::start, kTarget, kDelta);
  if (!draft_.plan.any()) return;
  solve_mass_matrix(When::start, kP, kBefore);
  add(When::start, "times_step", "before", "before", [](Memory m, Slots) {
    for (double& value : m.before.flat()) value *= m.options.step;
  });
}

/// delta = h (v + h M^-1 (Q - C)): semi-implicit Euler.
void Writer::explicit_guess() {
  factor_mass_matrix(When::first);
  solve_mass_matrix(When::first, kP, kDelta);
  add(When::first, "velocity_down", "screw, placement, delta", "twist",
      [](Memory m, Slots) { velocity_down(m.model.tree, m.constants, m.work.placement, m.work.delta, m.work.twist); });
  add(When::first, "coriolis_down", "inertia, screw, placement, delta, twist", "bias, impulse", [](Memory m, Slots) {
    coriolis_down(m.model.tree, m.constants, m.work.placement, m.work.delta, m.work.twist, m.work.bias, m.work.impulse);
  });
  add(When::first, "impulse_up", "screw, placement, impulse", "impulse, residual", [](Memory m, Slots) {
    impulse_up(m.model.tree, m.constants, m.work.placement, m.work.impulse, m.work.residual);
  }).sums = true;
  add(When::first, "force_difference", "force, residual", "residual", [](Memory m, Slots) {
    for (Index row = 0; row < m.work.residual.rows(); ++row) m.work.residual(row) = m.work.force(row) - m.work.residual(row);
  });
  solve_mass_matrix(When::first, kResidual, kResidual);
  add(When::first, "first guess: ig3", "delta, residual", "delta", [](Memory m, Slots) {
    const double h = m.options.step;
    for (Index row = 0; row < m.work.delta.rows(); ++row) m.work.delta(row) = h * (m.work.delta(row) + h * m.work.residual(row));
  });
}

void Writer::factor_mass_matrix(When when) {
  add(when, "articulated_inertia_up", "inertia, screw, placement" + coupled(), "articulated, mass gains" + coupled(), factor_mass);
  if (ties()) {
    add(when, kTies, "screw, placement, mass gains", "ties, bias, innovation, variation, increment",
        [](Memory m, Slots) { factor_ties(m, m.mass_gains(), false); });
  }
  if (!couplings()) return;
  add(when, kCloseAtWorld, "screw, placement, mass gains, ties, couplings", "couplings",
      [](Memory m, Slots) { close_at_world<false>(m, Coupled::velocities, m.mass_gains()); });
}

void Writer::solve_mass_matrix(When when, const Array& right_side, const Array& solution) {
  add(when, "impulse_pass_up", "screw, placement, mass gains" + coupled() + ", " + right_side.name, "bias, innovation" + coupled(),
      [of = right_side.of](Memory m, Slots) { solve_up(m, Coupled::velocities, m.mass_gains(), of(m)); });
  add(when, "rate_down", "screw, placement, mass gains, innovation" + coupled(), "variation, " + solution.name + pushed(),
      [of = solution.of](Memory m, Slots) {
        solve_down(m, Coupled::velocities, [&](Slots part) { pass_down_mass(m, m.mass_gains(), part, of(m)); });
      });
  if (!ties()) return;
  add(when, kCompletion, "ties, " + solution.name, solution.name, [of = solution.of](Memory m, Slots) { m.ties.complete(of(m)); });
}

void Writer::evaluation() {
  if (couplings()) {
    const bool joints = draft_.plan.joints;
    const std::string target = joints ? "joint impulses" : "momentum_target";
    add(When::evaluation, "couplings: take multipliers", "couplings, " + target, "couplings, " + target, [joints](Memory m, Slots) {
      m.couplings.take_multipliers(true, joints ? m.effects->plain_target() : m.work.momentum_target);
    });
  }
  add(When::evaluation, "displacement_down", "placement, motion", "displacement", [](Memory m, Slots part) {
    m.now.least_w = std::min(m.now.least_w, displacement_down(m.model.tree, m.work.placement, m.work.motion, part, m.work.displacement));
  }, Way::down);
  add(When::evaluation, "momentum_map", "inertia, displacement", "impulse", [](Memory m, Slots part) {
    m.now.energy += momentum_map(m.model.tree, m.constants, m.work.displacement, part, m.work.impulse);
  }, draft_.strategy.order == Order::long_chain ? Way::parents_up : Way::down);
  if (couplings()) {
    add(When::evaluation, "couplings: gaps", "screw, placement, motion, delta, couplings", "couplings",
        [](Memory m, Slots) {
          m.couplings.find_gaps(m.work.placement, m.work.motion, m.work.delta, m.factor == Factor::fresh ? Asked::rows : Asked::gaps);
        });
  }
  add_action_of_effects(draft_);
  std::string added = draft_.plan.joints ? ", joint impulses" : "";
  if (draft_.plan.bodies) added += ", body impulses";
  if (newton()) {
    const std::string reads = "inertia, screw, placement, motion, displacement" + added;
    add(When::factor, "newton_factor_up", reads + coupled(), "articulated, gains" + coupled(), couplings() ? factor_coupled<true> : factor<true>,
        couplings() ? Way::whole : Way::up);
  } else {
    add(When::factor, "articulated_inertia_up", "inertia, screw, placement" + added + coupled(), "articulated, gains" + coupled(),
        couplings() ? factor_coupled<false> : factor<false>);
  }
  if (ties()) {
    add(When::factor, kTies, newton() ? "screw, placement, motion, gains" : "screw, placement, gains",
        "ties, bias, innovation, variation, increment",
        [newton = newton()](Memory m, Slots) { factor_ties(m, m.gains(), newton); });
  }
  if (couplings()) {
    add(When::factor, kCloseAtWorld, newton() ? "screw, placement, motion, gains, ties, couplings" : "screw, placement, gains, ties, couplings", "couplings",
        [newton = newton()](Memory m, Slots) {
          newton ? close_at_world<true>(m, Coupled::step, m.gains()) : close_at_world<false>(m, Coupled::step, m.gains());
        });
  }
  if (!one_pass()) return residual_by_itself();
  add(When::evaluation, "innovation_up", "screw, placement, gains, impulse, momentum_target", "impulse, innovation",
      [](Memory m, Slots part) { m.now.norm += innovation_up(m.model.tree, m.constants, part, m.work); }, Way::up).sums = true;
  if (!draft_.strategy.finds_end_momenta()) return;
  add(When::evaluation, "momentum_at_end_map", "screw, displacement, impulse, innovation", "end_momentum", [](Memory m, Slots part) {
    if (!m.finds_end_momenta) return;
    momentum_at_end_map(m.model.tree, m.constants, m.work.displacement, m.work.impulse, m.work.innovation, part, m.work.end_momentum);
  }, Way::up);
}

/// The residual, and the first half of a solve after it. What ties joints, or bodies, makes the whole solve necessary for the norm.
void Writer::residual_by_itself() {
  add(When::evaluation, "residual_up", "screw, placement, impulse, momentum_target", "impulse, residual", [](Memory m, Slots) {
    m.now.plain = residual_up(m.model.tree, m.constants, m.work.placement, m.work.momentum_target, m.work.impulse, m.work.residual);
  }).sums = true;
  if (ties()) {
    add(When::evaluation, "fold_mimics", "residual", "residual", [](Memory m, Slots) { fold_mimics(m.ties.mimics(), m.work.residual); });
  }
  add(When::evaluation, "impulse_pass_up", "screw, placement, gains, residual" + coupled(), "bias, innovation" + coupled(),
      [](Memory m, Slots) { solve_up(m, Coupled::step, m.gains(), m.work.residual); });
  if (!solves_at_once()) return;
  if (newton()) {
    add(When::evaluation, "increment_down", "screw, placement, motion, gains, innovation" + coupled(), "variation, increment" + pushed(),
        [](Memory m, Slots) { solve_down(m, Coupled::step, [&](Slots part) { pass_down(m, part, m.work.increment); }); });
  } else {
    add(When::evaluation, "rate_down", "screw, placement, gains, innovation" + coupled(), "variation, increment" + pushed(),
        [](Memory m, Slots) { solve_down(m, Coupled::step, [&](Slots part) { pass_down_mass(m, m.gains(), part, m.work.increment); }); });
  }
  if (ties()) add(When::evaluation, kCompletion, "ties, increment", "increment", [](Memory m, Slots) { m.ties.complete(m.work.increment); });
  if (couplings()) {
    add(When::evaluation, "couplings: what they push leaves the residual", "couplings, residual", "residual", [](Memory m, Slots) {
      m.couplings.subtract_push(m.work.residual);
      fold_mimics(m.ties.mimics(), m.work.residual);
    });
  }
  add(When::evaluation, "norm of the residual", "residual, increment", "", [](Memory m, Slots) {
    double sum = 0;
    for (Index row = 0; row < m.work.residual.rows(); ++row) sum += m.work.residual(row) * m.work.increment(row);
    m.now.norm = std::abs(sum - m.couplings.beyond_norm(m.work.increment));
  });
}

void Writer::changed() {
  if (!draft_.plan.has_states) return;
  if (ties()) add(When::changed, "spread_mimics", "delta", "delta", spread);
  add(When::changed, "displacement_map", "motion", "delta", find_coordinates);
  add(When::changed, "motion_map", "screw, delta", "motion", move, Way::down);
}

void Writer::correction() {
  if (one_pass()) {
    add(When::correction, "increment_down", "screw, placement, motion, gains, innovation", "variation, applied", [](Memory m, Slots part) {
      increment_down(m.model.tree, m.constants, m.work.placement, m.work.motion, m.gains(), m.work.innovation, part, m.work.variation,
                     m.work.applied);
    }, Way::down);
  } else if (solves_at_once()) {
    add(When::correction, "swap_corrections", "increment, applied", "increment, applied",
        [](Memory m, Slots) {
          std::ranges::swap_ranges(m.work.increment.flat(), m.work.applied.flat());
          m.couplings.apply();
        });
  } else if (newton()) {
    add(When::correction, "increment_down", "screw, placement, motion, gains, innovation", "variation, applied",
        [](Memory m, Slots part) { pass_down(m, part, m.work.applied); });
  } else {
    add(When::correction, "rate_down", "screw, placement, gains, innovation", "variation, applied",
        [](Memory m, Slots part) { pass_down_mass(m, m.gains(), part, m.work.applied); });
  }
  add(When::correction, "correct_motion_map", "screw, applied, delta, motion", "delta, motion", [](Memory m, Slots part) {
    m.couplings.correct(m.share);
    correct_motion_map(m.model.tree, m.constants, m.work.applied, m.share, part, m.work.delta, m.work.motion);
  }, Way::down);
}

void Writer::last() {
  const bool quaternions = std::ranges::any_of(draft_.model.tree.runs, [](const Run& run) { return run.kind != JointKind::screw; });
  if (quaternions) add(When::last, "displacement_map", "motion", "delta", find_coordinates);
  add_end_of_effects(draft_);
  if (springs()) add(When::last, "couplings: end", "couplings", "couplings", [](Memory m, Slots) { m.couplings.end(m.options.step); });
  if (couplings()) add(When::last, "couplings: remember", "couplings", "couplings", [](Memory m, Slots) { m.couplings.remember(); });
  if (draft_.strategy.shares_rows) complete();
  add(When::last, "remember", "delta, history", "history",
      [](Memory m, Slots part) { remember(m.work.delta, rows_of(m, part), m.state.history); }, Way::down);
  add(When::last, "advance_map", "motion, delta, q", "q",
      [](Memory m, Slots part) { advance_map(m.model.tree, m.work.motion, m.work.delta, part, m.state.q); }, Way::down);
  if (ties()) {
    add(When::last, "follow_leaders", "q", "q", [](Memory m, Slots) {
      for (const Mimic& mimic : m.ties.mimics()) m.state.q(mimic.follower_q) = mimic.multiplier * m.state.q(mimic.leader_q) + mimic.offset;
    });
  }
  arrival();
  if (draft_.strategy.finds_end_momenta()) {
    add(When::last, "momentum_end_map", "end_momentum, force", "p", [](Memory m, Slots part) {
      if (m.finds_end_momenta) momentum_end_map(m.model.tree, m.options.step, m.work.end_momentum, m.work.force, part, m.state.p);
    }, Way::up);
  }
  const std::string residual(draft_.joint_residual());
  add(When::last, "momentum_update_map", "screw, displacement, impulse, force, " + residual, "p", [](Memory m, Slots part) {
    if (m.finds_end_momenta) return;
    momentum_update_map(m.model.tree, m.constants, m.options.step, m.work.displacement, m.work.impulse, m.joint_residual(), m.work.force,
                        part, m.state.p);
  }, Way::up);
  add_arrival_of_effects(draft_);
  add_impulses_of_effects(draft_);
  if (springs()) add(When::last, "couplings: impulses of the end", "couplings, p", "p", [](Memory m, Slots) { m.couplings.add_end(true, m.state.p); });
  if (ties()) add(When::last, "fold_mimics", "p", "p", [](Memory m, Slots) { fold_mimics(m.ties.mimics(), m.state.p); });
  add_reading_of_effects(draft_);
}

/// Where branches share rows and momenta at the end were not found on the way, all is found once more for all bodies.
void Writer::complete() {
  const auto add_unless_found = [&](std::string_view sweep, std::string_view reads, std::string_view writes, auto run) {
    add(When::last, sweep, reads, writes, [run](Memory m, Slots part) {
      if (!m.finds_end_momenta) run(m, part);
    });
  };
  add_unless_found("placement_map", "tree_placement, screw, q", "placement", place);
  add_unless_found("motion_map", "screw, delta", "motion", move);
  add_unless_found("displacement_down", "placement, motion", "displacement", [](Memory m, Slots part) {
    displacement_down(m.model.tree, m.work.placement, m.work.motion, part, m.work.displacement);
  });
  add_unless_found("momentum_map", "inertia, displacement", "impulse", [](Memory m, Slots part) {
    momentum_map(m.model.tree, m.constants, m.work.displacement, part, m.work.impulse);
  });
  add_unless_found("innovation_up", "screw, placement, gains, impulse, momentum_target", "impulse, innovation",
                   [](Memory m, Slots part) { innovation_up(m.model.tree, m.constants, part, m.work); });
  draft_.sweeps.back().sums = true;
}

void Writer::arrival() {
  add(When::arrival, "placement_map", "tree_placement, screw, q", "placement", place, Way::down);
  if (couplings()) {
    add(When::arrival, "couplings: places", "screw, placement, q", "couplings", [](Memory m, Slots) { m.couplings.place(m.work.placement, m.state.q); });
  }
  if (!draft_.strategy.gravity) return;
  add(When::arrival, "gravity_field_down", "placement", "field", [](Memory m, Slots part) {
    const std::array<double, 3>& g = m.options.gravity;
    gravity_field_down(m.model.tree, m.work.placement, Vec3<double>{g[0], g[1], g[2]}, part, m.work.field);
  }, Way::down);
  add(When::arrival, "gravity_force_up", "inertia, subtree_mass, screw, placement, field", "first_moment, force", [](Memory m, Slots part) {
    gravity_force_up(m.model.tree, m.constants, m.work.placement, m.work.field, part, m.work.first_moment, m.work.force);
  }, Way::up);
}

}  // namespace

std::string_view name(When when) {
  constexpr std::array<std::string_view, 9> names{"arrival", "first",   "start",      "evaluation", "factor",
                                                  "states",  "changed", "correction", "last"};
  return names[static_cast<std::size_t>(when)];
}

std::vector<Sweep> schedule_of(const Model& model, const Options& options, const EffectPlan& plan) {
  return Writer(model, options, plan).list();
}

void run(std::span<const Sweep> sweeps, std::initializer_list<When> phases, StepMemory& memory) {
  const Slots all = all_slots(memory.model.tree);
  for (const Sweep& sweep : sweeps) {
    if (std::ranges::find(phases, sweep.when) != phases.end()) sweep.run(memory, all);
  }
}

}  // namespace linden
