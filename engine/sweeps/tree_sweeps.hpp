// engine/sweeps/tree_sweeps.hpp
// The sweeps over one instance's tree that a step is made of, with the memory they share: what is run, in parts that stay in the nearest
// cache. What a solution is, and what to do where there is none, is the stepper's business (stepper.hpp).
//
//   evaluate                  delta -> motion, displacement, h mu              DRNEA, downward half
//                             Jacobian (riqn: articulated inertia), factored
//                             residual and first half of a solve, its norm     DRNEA, upward half
//   solve_and_correct         second half of the solve, and the next evaluation with the factor there is
//
// One upward sweep finds residual and norm where no joint is tied to another and nobody asks for |r|; else residual, ties and solve go one
// by one. Effects, where there are any, act in each evaluation and factor; where there are none, each branch of the tree is gone through
// down and up before the next (down_and_up.hpp). What an evaluation finds where a body turned too far is not usable.
//
// The end of a step and the first evaluation of the next may share their ways over the branches. Of a tree of screws alone, what is made and
// used up within a way over a branch - placements, motions, displacements, impulses - lies in rows that all branches share. A step of a
// binary tree of 65,535 takes 87 to 92 ns a body on one core in a run of steps, and 101 to 105 where each ends before the next begins
// (EPYC Zen 5, in the same minutes).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "engine/assembly.hpp"
#include "engine/coupling_state.hpp"
#include "engine/effects/no_effects.hpp"
#include "engine/guess/extrapolation.hpp"
#include "engine/options.hpp"
#include "engine/solve/judge.hpp"
#include "engine/step_report.hpp"
#include "engine/sweeps/body_contacts.hpp"
#include "engine/sweeps/coupling_sweeps.hpp"
#include "engine/sweeps/down_and_up.hpp"
#include "engine/sweeps/strategy.hpp"
#include "kernels/tree/articulated.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/tree/world_placement_down.hpp"
#include "layout/workspace.hpp"

namespace linden {

/// Kinetic energies of the mean motions of two neighbouring steps, and the work of the impulses between them [J].
struct EnergyStep {
  double before = 0, now = 0, work = 0;
  double rigid_work = 0;  // of it, that of rigid couplings: nothing, where steps follow how they turn
};

/// kEffects: with those of the plan, beside gravity.
template <bool kEffects>
class TreeSweeps {
 public:
  /// The plan must outlive the sweeps.
  TreeSweeps(const Model& model, const Options& options, const EffectPlan& plan);

  Workspace<double>& work() { return work_; }
  const Workspace<double>& work() const { return work_; }
  const BodyConstants<double>& constants() const { return *constants_; }
  std::span<const Mimic> mimics() const { return ties_.mimics(); }
  std::vector<CouplingState> couplings(double h) const;
  /// Positions moved by the displacement in work(), and a refresh there.
  void displace(Field<double>& q);
  /// How far open couplings are at the positions of the last refresh.
  Assembly openness();
  /// After an evaluation or a refresh: of the row that is farthest open, its gap beside the size of its mechanism, the number of its coupling.
  double widest_gap() const { return couplings_->widest_gap(); }
  Index widest_coupling() const;
  /// Whether couplings that give way work otherwise in the step solved last than their gaps change, by this share of the energies that move them.
  bool strays(double share, double h, const Evaluated<double>& now) {
    if (!couplings_->gives_way()) return false;
    displacement_map(model_.tree, work_.motion, work_.delta);
    return couplings_->strays(share, h, now.energy, work_.delta);
  }
  /// Whether all gaps are within this share of the size of their mechanism, but for rows that others hold already.
  bool is_closed(double share) const { return couplings_->empty() || couplings_->widest_pushed_gap() <= share; }
  /// Coordinates of cables brought to their lengths at the positions of the last refresh, and a refresh; not those whose motion is given.
  void measure_cables(Field<double>& q);
  /// Velocities brought to the nearest, as the mass matrix measures, that leave couplings closed.
  void close_velocities(Field<double>& v);
  /// Closes them, or leaves them where they are least open; from the positions of the last refresh, which are brought to what is found.
  Assembly assemble(Field<double>& q);
  EffectsIf<kEffects, double>& effects() { return effects_; }
  const EffectsIf<kEffects, double>& effects() const { return effects_; }

  /// Placements, forces and potentials at q.
  void refresh(const Field<double>& q);
  /// The same at the end of a step of h, whose displacement joins the history: positions, momenta.
  void arrive(double h, State<double>& state);
  /// Whether the end of a step whose last evaluation this was and the first evaluation of the next can go over each branch together.
  bool can_go_on() const { return valid_.end_momenta; }
  /// Of gravity, springs, couplings that give way and the ground at the last refresh; of these without gravity [J].
  double potential() const { return potential_; }
  double effect_potential() const { return effect_potential_; }
  /// See Stepper.
  void apply(std::span<const double> force);
  void use(const BodyConstants<double>& constants) { constants_ = &constants; }
  void use_gravity(const std::array<double, 3>& gravity);

  /// Before all else of a step from these positions, which must stay where they are until it is over.
  void start(const Field<double>& q, double h) {
    q_ = &q;
    couple_contacts();
    couplings_->begin(h);
  }
  /// Whether multipliers of couplings begin with those of the steps before; these by the shares of the first guess, after start.
  bool guesses_multipliers() const { return couplings_->has_history(); }
  void guess_multipliers(const Extrapolation& guess) { couplings_->guess(std::span(guess.shares).first(static_cast<std::size_t>(guess.terms))); }
  void remember_multipliers() { couplings_->remember(); }
  /// The laws of contacts in a step of h, after start; before: displacement of the step before, had it been as long.
  void begin_contacts(double h, const Field<double>& before);
  /// Before the evaluations of a step with effects. scale: what Evaluated::scale gets beside the energy.
  void begin(double scale);
  Evaluated<double> evaluate(Factor factor, StepReport& report);
  /// The same from a guess of delta, momentum_target and all.
  Evaluated<double> evaluate_from(const State<double>& state, const Extrapolation& guess, double h, Factor factor, StepReport& report);
  /// arrive at the end of the step before, of h_before, and evaluate_from there, both while a branch is in the cache; see can_go_on.
  Evaluated<double> arrive_and_evaluate(double h_before, State<double>& state, const Extrapolation& guess, double h, Factor factor,
                                        StepReport& report);
  /// Placements, motions, displacements and impulses of all bodies: where branches share rows an evaluation leaves those of the last it met.
  void complete();
  /// A fresh factor for the evaluation made last.
  void factor_again(Evaluated<double>& now, StepReport& report);
  /// The evaluation after a correction by what the factor makes of the residual.
  Evaluated<double> solve_and_correct(StepReport& report);
  /// The evaluation after the correction applied last, times `factor`.
  Evaluated<double> correct(double factor, StepReport& report);

  /// The residual of each joint as its solve left it [kg m^2, kg m]; with no ties and couplings, the innovation.
  Field<double>& joint_residual() { return strategy_.one_pass ? work_.innovation : work_.residual; }
  const Field<double>& joint_residual() const { return strategy_.one_pass ? work_.innovation : work_.residual; }
  /// d^-1 of each joint, of one that is tied that of its coordinate: how far an impulse moves it.
  const Field<double>& yields() { return ties_.empty() ? work_.joint_inverse : ties_.yields(work_.joint_inverse); }
  /// Whether slopes along corrections are known: by Newton's method with its energy norm.
  bool has_slopes() const { return options_.solver == Solver::newton && options_.stop == StopTest::energy; }
  /// r.(A^-1 r_before): the residual along a correction, r_before its own. Before the correction is made; after it, for the innovation there
  /// was before. Without ties the sum of u.(d^-1 u_before) over the joints, with the same factor.
  double slope_at_begin() const { return !solves_with_residual() ? slope_along(work_.innovation) : along(work_.increment); }
  double slope_at_end(const Field<double>& innovation_before) const {
    return !solves_with_residual() ? slope_along(innovation_before) : along(work_.applied);
  }
  /// Whether the residual is rounding alone: epsilons of the impulses that meet at each joint, and small beside the motion, or beside what
  /// gravity alone would do to it where all is at rest (fall).
  bool at_floor(const Evaluated<double>& now, double fall, double epsilons);
  /// What the step solved last, of h, does to the energy of the step before, of h_before and with the displacement `before`. Between the
  /// two acts an impulse, whatever it is made of: the momentum at the beginning of the one less that at the end of the other, which are
  /// made anew from their displacements. It works along the mean of both velocities, to second order.
  EnergyStep energy_step(const Field<double>& before, double h_before, double h, StepReport& report);

  /// Once a step is over: twists of the mean motion of one of h, `delta` its displacement, as the step taken back has them, whose twists point the
  /// other way. A mean twist is the same seen from either end. Those that joint velocities make where bodies are.
  void mean_twists(const Field<double, kHistory>& delta, double h, Field<double, 6>& twist);
  void twists_of(const Field<double>& v, Field<double, 6>& twist);
  /// Steps are so many times as long from now on.
  void change_length(double times) { couplings_->change_length(times); }

  /// Whether the factor outlasts a step: reading velocities then has one of its own.
  bool reuses_factor() const { return strategy_.reuses_factor; }
  /// The factor: part of a checkpoint where it outlasts a step.
  std::vector<std::span<double>> factor_memory() {
    std::vector<std::span<double>> memory{work_.gain_up.flat(), work_.gain_down.flat(), work_.joint_inverse.flat()};
    couplings_->each_kept([&](std::span<double> numbers) { memory.push_back(numbers); });
    return memory;
  }

  /// M(q)^-1 p, for the positions of the last refresh; apply_mass_inverse: where the mass matrix is factored already.
  void velocity_of(const Field<double>& p, Field<double>& v);
  void apply_mass_inverse(const Field<double>& p, Field<double>& v, const Field<double>* given = nullptr, Coupled of = Coupled::velocities);
  /// A blow in which joints that are held (EffectSweeps::hold_in_blow) change by what is asked of them, in `change`, and no other feels an
  /// impulse but what ties and couplings make of it: all changes, and the impulses that do it.
  void blow(Field<double>& change, Field<double>& impulse);
  void momentum_of(const Field<double>& v, Field<double>& p);
  /// Those that are read as v.
  void momentum_read_as(const Field<double>& v, Field<double>& p) {
    momentum_of(v, p);
    couplings_->take_excess(options_.step, v, p);
    fold_mimics(ties_.mimics(), p);
  }
  /// Whether some coupling does.
  bool gives_way() const { return couplings_->gives_way(); }
  /// Contacts of bodies with each other, where a scene has any: of the step solved last, of h, before it arrives; before: displacement of
  /// the step before; book(slot, what they took [J], and what they may give to push bodies out of each other [J]).
  template <class Book>
  void end_contacts(double h, const Field<double>& before, const Book& book) {
    if (contacts_) contacts_->keep(h, *couplings_, before, work_.delta, book);
  }
  /// Then, while bodies are where they were: what contacts pushed.
  template <class Account>
  void account_for_contacts(double h, Account& impulses) {
    if (!contacts_) return;
    std::ranges::fill(work_.momentum.flat(), 0.0);
    couplings_->add_contacts(1 / h, work_.momentum);
    impulses.add_between(contacts_->impulses(h), pose_, work_.momentum);
  }
  /// At the end of the last step [J].
  double contact_potential() const { return contacts_ ? contacts_->stored() : 0; }
  bool has_contacts() const { return contacts_.has_value(); }
  std::span<double> contact_memory() { return contacts_ ? contacts_->memory() : std::span<double>(); }
  /// A blow has changed all velocities.
  void drop_lasting_contact() {
    if (contacts_) contacts_->drop_lasting();
  }
  void forget_contacts() {
    if (contacts_) contacts_->forget();
  }
  /// What couplings that give way push at the end of a step of h: before it arrives; returns what they took [J]. After it: p gets it.
  double end_couplings(double h) { return couplings_->end(h); }
  void add_coupling_ends(double h, Field<double>& p) {
    couplings_->add_end(true, p);
    couplings_->change_step(h, options_.step, 1, p);
  }
  /// h (p + h/2 Q) of a step of h, where momenta are those of steps of options.step.
  void change_step(double h, Field<double>& target) { couplings_->change_step(options_.step, h, h, target); }
  /// As Stepper, but for how much the motion bends. Returns the momenta that belong to it.
  const Field<double>& read_velocity(const Field<double>& p, Field<double>& v);
  /// Kinetic energy that contacts are yet to take, v having been read with what they push in the half step to come; with the factor of the reading [J].
  /// With what they have stored it is kept as they work, in the middle of steps.
  double late_in_reading(const Field<double>& v);
  /// Fills with NaN what no sweep may read before it is written again, once a step is over and the next has not begun. Only where compiled
  /// with LINDEN_POISON.
  void poison_scratch();
  /// At the end of a step with effects: what velocities are read from beside p.
  void end_reading(double h, const Field<double>& before, bool known) {
    if constexpr (kEffects) {
      if (contacts_ && contacts_->lasted()) {
        // where bodies are now: at one point of space with both of a pair, so that momentum is told as it is kept
        world_placement_down(model_.tree, work_.placement, pose_);
        std::ranges::fill(work_.impulse.flat(), 0.0);
        contacts_->push_lasting(h, pose_, work_.impulse);
        impulse_up(model_.tree, *constants_, work_.placement, work_.impulse, work_.momentum);
        std::ranges::copy(work_.momentum.flat(), contacts_->lasting_push().begin());
      }
      if (contacts_) effects_.add_to_reading(contacts_->lasted() ? std::span<const double>(contacts_->lasting_push()) : std::span<const double>());
      effects_.end_reading(*constants_, work_.placement, true, work_.delta, before, known, work_.impulse, work_.increment);
    }
  }

 private:
  /// What the rows of the workspace hold. Between steps: placements of all bodies.
  struct Valid {
    bool placements = true;    // of all bodies; where branches share rows, those of the last
    bool evaluation = true;    // motions, displacements and impulses of all bodies, likewise
    bool end_momenta = false;  // momenta at the end of the step, of the evaluation made last
  };

  void place(const Field<double>& q, Slots part);
  void place_all();
  void place_again(Slots part);
  void find_potentials(const Field<double>& q);
  void couple_contacts();
  void advance(Slots part, State<double>& state);
  void arrive_down(Slots part, State<double>& state);
  void arrive_up(Slots part, double h, bool found, State<double>& state);
  /// Whether an evaluation begins a solve, or goes on where the pass before it ended.
  enum class Pass : std::uint8_t { first, correction };
  template <class Motions, class BeforeUp>
  Evaluated<double> evaluate_motions(StepReport& report, Pass pass, Factor factor, const Motions& motions, const BeforeUp& before_up);
  template <class Added>
  double pass_part(Slots part, Factor factor, const Added& added);
  void act(Evaluated<double>& now);
  void forces(Slots part);
  void pass_up(Evaluated<double>& now, Factor how);
  void factor();
  template <class Added>
  void factor_mass(const Added& added, Coupled of = Coupled::velocities, double damping = 0);
  void rates_down(Slots part, Field<double>& v);
  void factor_for_start(Coupled of, double damping = 0);
  bool is_closed_to(double enough) const;
  void close_gaps(double damping, Field<double>& q);
  /// visit(row of its coupling, its coordinate) of all cables whose length follows.
  template <class Visit>
  void each_cable(const Visit& visit) const;
  template <class Added, class Action>
  void with_ties(const Added& added, const Action& action);
  void close(std::size_t closure, Coupled of, const Gains<double>& gains, double damping = 0);
  void take_multipliers();
  template <class Down>
  void tie(const Gains<double>& gains, const Down& down);
  double pass_residual();
  void increments_down(Slots part, Field<double>& x);
  void pass_down(Field<double>& correction);
  double momenta_of_delta(Field<double>& momenta);
  double slope_along(const Field<double>& innovation_before) const;
  double along(const Field<double>& correction) const;
  /// What ties joints, or bodies, makes the whole solve necessary for the norm.
  bool solves_with_residual() const { return !ties_.empty() || !couplings_->empty(); }
  Gains<double> gains() { return {work_.gain_up, work_.gain_down, work_.joint_inverse}; }
  Gains<double> mass_gains() { return strategy_.reuses_factor ? Gains<double>{mass_.gain_up, mass_.gain_down, mass_.joint_inverse} : gains(); }
  Vec3<double> gravity() const { return {options_.gravity[0], options_.gravity[1], options_.gravity[2]}; }

  const Model& model_;
  const BodyConstants<double>* constants_;
  Options options_;
  Strategy strategy_;
  Valid valid_;
  const Field<double>* q_ = nullptr;  // see start
  double potential_ = 0, effect_potential_ = 0;
  double effect_scale_ = 0;
  bool guess_points_ = false;  // no evaluation of this solve has been made yet
  std::vector<double> applied_;  // empty: no force but gravity
  Workspace<double> work_;
  MimicTies<double> ties_;
  std::optional<BodyContacts> contacts_;               // of a scene that has any
  std::optional<CouplingSweeps<double>> couplings_;    // made anew where other contacts come; never empty
  std::span<const double> row_yields_;
  Field<double, 12> pose_;                             // of bodies in the world, for contacts
  [[no_unique_address]] EffectsIf<kEffects, double> effects_;
  DownAndUp<Evaluated<double>> tree_;
  Field<double> read_;  // see read_velocity
  Field<double> given_;  // velocities of joints whose motion is given; no rows without
  MassFactor<double> mass_;  // empty where nothing is held
};

}  // namespace linden
