// engine/stepper.hpp
// The one-step map (q, p) -> (q, p): solve the discrete Euler-Lagrange equation for the displacement, then read off the new momentum.
//
//   momentum_target     h (p + h/2 Q)
//   first guess         delta
//   +-> motion_map      M = exp(S delta)
//   |   displacement_down, momentum_map                         DRNEA, downward half
//   |   newton_factor_up (once a step) or articulated_inertia_up (riqn)
//   |   innovation_up (or residual_up, impulse_pass_up)         DRNEA, upward half: h r(delta); its energy norm: usable? converged?
//   +-- increment_down, correct_motion_map                      delta <- delta (-) Delta
//   advance_map, placement_map, gravity, momentum_update_map
//
// The sweeps are called through tree_sweeps.hpp; what counts as solved is here. Effects (effect_sweeps.hpp), where a scene has
// any, act after momentum_map and on the target, are part of the factor, and have their states - sticks, slides, at a limit -
// revised between corrections.
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

#include "engine/options.hpp"
#include "engine/step_report.hpp"
#include "engine/tree_sweeps.hpp"
#include "layout/state.hpp"

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
  void refresh(const State<double>& state) { sweeps_->refresh(state.q); }

  /// Generalized forces [nv] on top of gravity, the same until they are set anew; followed by a refresh. Empty: none.
  void apply(std::span<const double> force) { sweeps_->apply(force); }
  /// Masses and inertias of an instance that differs from the model, followed by a refresh. They must live as long as they are used.
  void use(const BodyConstants<double>& constants) { sweeps_->use(constants); }

  /// One step of `h` seconds, `time` at its beginning; back in time where h < 0 (no effect may dissipate or depend on time then).
  /// `history`: how many rows of state.history are valid, displacements of earlier steps of the same h; updated.
  StepReport step(State<double>& state, int& history, double time, double h);
  /// Targets of the servos [rad, m] in the order of Effects::servos, to be written between steps; empty without servos.
  std::span<double> servo_targets();
  /// Forces of joint friction [N m, N] in the order of Effects::friction, likewise.
  std::span<double> friction_forces();
  /// How contact point k ended the last step (EffectSweeps::contact).
  double contact(Index k) const { return effects_->contact(k); }
  /// What effects keep from step to step beside the state: part of a checkpoint.
  std::vector<std::span<double>> effect_memory();
  /// Of effects, in the step taken last.
  const EffectWork<double>& effect_work() const { return effect_work_; }

  /// The state is another's from now on, or was changed: nothing is known of a step before.
  void forget();
  /// v = M(q)^-1 p for the positions of the last refresh or step; at the end of a step with effects, p with their impulses taken half
  /// at each end of it (kernels/effects/body_impulses.hpp). Returns that p.
  const Field<double>& read_velocity(const Field<double>& p, Field<double>& v) { return sweeps_->read_velocity(p, v); }
  /// p = M(q) v.
  void momentum_of(const Field<double>& v, Field<double>& p) { sweeps_->momentum_of(v, p); }
  /// Momentum of the whole system about the world's origin, in the world's frame, for rates v.
  Wrench<double> total_momentum(const Field<double>& v);
  /// Of a state with the positions of the last refresh or step; rate = M^-1 p on the way.
  Energy energy_of(const Field<double>& p, Field<double>& rate);

  const Workspace<double>& workspace() const { return work_; }

 private:
  bool converged(const Evaluated& now, double norm, double h) const;
  bool gains_energy(const State<double>& state, double h);
  double push();
  void begin_effects(const State<double>& state, int history, double h);
  bool revise_effects(bool settled, bool one_by_one);
  double fall(double h) const;
  void approach_softly(Evaluated& now, double& norm, double h, bool whole, StepReport& report);
  double work(const Field<double>& force) const;
  StepStatus solve(const State<double>& state, int history, double h, StepReport& report);
  StepStatus find_root(const State<double>& state, int history, double h, StepReport& report);
  bool halves(State<double>& state, int& history, double h, int depth, StepReport& report);
  void finish(State<double>& state, int& history, double h);

  const Model& model_;
  Options options_;
  int max_iterations_;
  std::unique_ptr<TreeSweeps> sweeps_;  // where it is stays the same when a stepper is moved
  Workspace<double>& work_;
  EffectsPointer<double>& effects_;
  double momentum_energy_ = 0;  // h^2 x kinetic energy of the mean motion, of the root found last
  double kinetic_ = 0;          // the same in J
  double failed_residual_ = 0;  // of the last solve that failed
  EffectWork<double> effect_work_, solved_work_;  // of the whole step; of the root found last
  Field<double> before_;         // displacement of the step before, as far as it is known [rad, m]
  Field<double> before_innovation_;
  double time_ = 0;
  bool known_ = false;         // the last step is one of this stepper
  State<double> last_good_;
};

}  // namespace linden
