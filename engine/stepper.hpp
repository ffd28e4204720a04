// engine/stepper.hpp
// The one-step map (q, p) -> (q, p): solve the discrete Euler-Lagrange equation for the displacement, then read off the new momentum.
//
//   momentum_target     h (p + h/2 Q)
//   first guess         delta
//   +-> motion_map      M = exp(S delta)
//   |   displacement_down, momentum_map                         DRNEA, downward half
//   |   newton_factor_up (once a step) or articulated_inertia_up (riqn)
//   |   innovation_up (or residual_up, impulse_pass_up)         DRNEA, upward half: h r(delta); its energy norm: converged?
//   +-- increment_down, correct_motion_map                      delta <- delta (-) Delta
//   advance_map, placement_map, gravity, momentum_update_map
//
// Effects (effect_sweeps.hpp), where a scene has any, act after momentum_map and on the target, are part of the factor, and have their
// states - sticks, slides, at a limit - revised between corrections.
//
// The equation may have other roots, far from the motion, once a step is too large for it. Whoever lands on one gains energy out of
// nothing: kinetic energy of the mean motion minus the work of the forces is compared with the step before.
//
// Symplectic, time-symmetric, second order; no allocation. A solve that makes no progress is backtracked, then given a fresh exact
// Jacobian; a step that still fails is split in two. If that fails too the state is left as it was.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "engine/effect_sweeps.hpp"
#include "engine/options.hpp"
#include "engine/step_report.hpp"
#include "kernels/articulated.hpp"
#include "kernels/mimic.hpp"
#include "layout/state.hpp"
#include "layout/workspace.hpp"

namespace linden {

struct Energy {
  double kinetic = 0;    // 1/2 p.M^-1 p [J]
  double potential = 0;  // of gravity (zero where the centre of mass is at the height of the world's origin), springs and ground [J]
  double total() const { return kinetic + potential; }
};

class Stepper {
 public:
  /// plan: the effects beside gravity, which must outlive the stepper; null: none.
  Stepper(const Model& model, const Options& options, const EffectPlan* plan = nullptr);

  /// Brings placements and forces to the positions in `state`; call after any change of them from outside.
  void refresh(const State<double>& state);

  /// Generalized forces [nv] on top of gravity, the same until they are set anew; followed by a refresh. Empty: none.
  void apply(std::span<const double> force);
  /// Masses and inertias of an instance that differs from the model, followed by a refresh. They must live as long as they are used.
  void use(const BodyConstants<double>& constants) { constants_ = &constants; }

  /// One step of `h` seconds, `time` at its beginning; back in time where h < 0 (no effect may dissipate or depend on time then).
  /// `history`: how many rows of state.history are valid, displacements of earlier steps of the same h; updated.
  StepReport step(State<double>& state, int& history, double time, double h);
  /// Targets of the servos [rad, m] in the order of Effects::servos, to be written between steps; empty without servos.
  std::span<double> servo_targets();
  /// How contact point k ended the last step (EffectSweeps::contact).
  double contact(Index k) const { return effects_->contact(k); }
  /// What effects keep from step to step beside the state: part of a checkpoint.
  std::vector<std::span<double>> effect_memory();
  /// Of effects, in the step taken last.
  const EffectWork<double>& effect_work() const { return effect_work_; }

  /// The state is another's from now on, or was changed: nothing is known of a step before.
  void forget();
  /// v = M(q)^-1 p, for the positions of the last refresh or step.
  void velocity_of(const Field<double>& p, Field<double>& v);
  /// The same for people: of a state at the end of a step with effects, see kernels/effects/body_impulses.hpp. Returns that p.
  const Field<double>& read_velocity(const Field<double>& p, Field<double>& v);
  /// p = M(q) v.
  void momentum_of(const Field<double>& v, Field<double>& p);
  /// Momentum of the whole system about the world's origin, in the world's frame, for rates v.
  Wrench<double> total_momentum(const Field<double>& v);
  /// Of a state with the positions of the last refresh or step; rate = M^-1 p on the way.
  Energy energy_of(const Field<double>& p, Field<double>& rate);

  const Workspace<double>& workspace() const { return work_; }

 private:
  struct Evaluated {
    double least_w;    // see displacement_down
    double energy;     // h^2 x kinetic energy of the mean motion
    double plain;      // |h r|^2
    double scale;      // what a residual is compared with: energy, with effects also what gravity gives in a step
    bool usable() const;
  };

  void first_guess(const State<double>& state, int history, double h);
  template <class Action>
  void in_parts_down(const Action& action) const;
  template <class Action>
  void in_parts_up(const Action& action) const;
  template <class Motions>
  Evaluated evaluate(StepReport& report, const Motions& motions);
  void factor(StepReport& report);
  void factor_mass();
  void tie_rates();
  double pass_up(Evaluated& now);
  double pass_residual();
  double factor_and_pass(Evaluated& now, StepReport& report);
  double factor_and_pass_again(Evaluated& now, StepReport& report);
  void pass_down();
  Evaluated correct(double factor, StepReport& report);
  Evaluated solve_and_correct(StepReport& report);
  bool converged(const Evaluated& now, double norm, double h) const;
  bool gains_energy(const State<double>& state, double h);
  double push();
  template <class Action>
  void with_added(const Action& action);
  void begin_effects(const State<double>& state, int history, double h);
  void act(Evaluated& now);
  bool revise_effects(bool settled, bool one_by_one);
  double fall(double h) const;
  double slope_along() const;
  template <class Start>
  void approach_softly(Evaluated& now, double& norm, double h, bool whole, const Start& start, StepReport& report);
  const Field<double>& left() const { return one_pass_ ? work_.innovation : work_.residual; }
  double work(const Field<double>& force) const;
  bool at_rounding_floor(const Evaluated& now, double norm, double h, double epsilons) const;
  Index worst_displacement() const;
  Index largest_residual() const;
  Index fastest_body() const;
  StepStatus solve(const State<double>& state, int history, double h, StepReport& report);
  StepStatus find_root(const State<double>& state, int history, double h, StepReport& report);
  bool halves(State<double>& state, int& history, double h, int depth, StepReport& report);
  void finish(State<double>& state, int& history, double h);
  void forces();
  Vec3<double> gravity_vector() const;
  void apply_mass_inverse(const Field<double>& p, Field<double>& v);
  Gains<double> gains() { return {work_.gain_up, work_.gain_down, work_.joint_inverse}; }

  const Model& model_;
  const BodyConstants<double>* constants_;
  Options options_;
  int max_iterations_;
  bool gravity_;
  bool one_pass_;  // residual and first half of a solve in one sweep: no ties, and nobody asks for |r|
  double potential_ = 0;
  double momentum_energy_ = 0;  // h^2 x kinetic energy of the mean motion, of the root found last
  double kinetic_ = 0;          // the same in J
  double failed_residual_ = 0;  // of the last solve that failed
  EffectsPointer<double> effects_;
  EffectWork<double> effect_work_, solved_work_;  // of the whole step; of the root found last
  Field<double> before_;         // displacement of the step before, as far as it is known [rad, m]
  Field<double> before_innovation_, read_;
  double effect_potential_ = 0;  // at the beginning of the step [J]
  double time_ = 0, effect_scale_ = 0;
  bool guess_points_ = false;  // no evaluation of this solve has been made yet
  bool known_ = false;         // the last step is one of this stepper
  std::vector<double> applied_;  // empty: no force but gravity
  Workspace<double> work_;
  MimicTies<double> ties_;
  State<double> last_good_;
};

}  // namespace linden
