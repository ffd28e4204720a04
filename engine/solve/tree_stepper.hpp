// engine/solve/tree_stepper.hpp
// The steps of a tree that is stepped alone. What is run is in tree_sweeps.hpp, how its equation is solved in tree_solve.hpp; what becomes of a
// solution, and what to do where there is none, is here.
//
//   momentum_target     h (p + h/2 Q)
//   first guess         delta; both on the way down of the first evaluation where nothing else needs them before
//   +-> motion_map      M = exp(S delta)                        solve.hpp: until decide.hpp says that it is over
//   |   displacement_down, momentum_map                         DRNEA, downward half
//   |   newton_factor_up (where that of an earlier step does not serve: held_factor.hpp) or articulated_inertia_up (riqn)
//   |   innovation_up (or residual_up, impulse_pass_up)         DRNEA, upward half: h r(delta); its energy norm: usable? converged?
//   +-- increment_down, correct_motion_map                      delta <- delta (-) Delta
//   advance_map, placement_map, gravity, momentum_update_map
//
// Effects (effect_sweeps.hpp) act after momentum_map and on the target, are part of the factor, and have their states - sticks, slides,
// at a limit - updated between corrections. Compiled with them and without (kEffects): a step without asks for none.
//
// The equation may have other roots, far from the motion, once a step is too large for it (judge.hpp). Whoever lands on one gains
// energy out of nothing: where a step turns bodies by much and its solution lies far from the first guess, kinetic energy of the mean
// motion minus the work of the impulses at its beginning is compared with the step before. Other steps are not asked.
#pragma once

#include <optional>
#include <type_traits>

#include "engine/effects/blows.hpp"
#include "engine/effects/impulse_account.hpp"
#include "engine/solve/stepper.hpp"
#include "engine/solve/tree_solve.hpp"
#include "engine/sweeps/tree_sweeps.hpp"

namespace linden {

template <bool kEffects>
class TreeStepper final : public Stepper {
 public:
  TreeStepper(const Model& model, const Options& options, const EffectPlan& plan);

  void refresh(const State<double>& state) override { sweeps_.refresh(state.q); }
  void apply(std::span<const double> force) override { sweeps_.apply(force); }
  void use(const BodyConstants<double>& constants) override { sweeps_.use(constants); }
  void use_gravity(const std::array<double, 3>& gravity) override {
    options_.gravity = gravity;
    sweeps_.use_gravity(gravity);
  }
  void forget() override;
  StepReport step(State<double>& state, int& history, double time, double h, Then then) override;
  const EffectAccount& effect_account() const override { return account_; }
  void mean_twists(const State<double>& state, Field<double, 6>& twist) override;
  void twists_of(const Field<double>& v, Field<double, 6>& twist) override;
  void keep_impulses() override;
  const StepImpulses& impulses() const override;
  std::vector<CouplingState> couplings(double h) const override { return sweeps_.couplings(h); }
  Assembly openness() override { return sweeps_.openness(); }
  void measure_cables(State<double>& state) override { sweeps_.measure_cables(state.q); }
  Assembly assemble(State<double>& state) override { return sweeps_.assemble(state.q); }
  EffectControls controls() override;
  std::vector<std::span<double>> memory() override;
  std::span<double> contact_memory() override { return sweeps_.contact_memory(); }
  void read_velocity(const State<double>& state, Field<double>& v) override;
  void momentum_of(Field<double>& v, Field<double>& p) override {
    sweeps_.close_velocities(v);
    sweeps_.momentum_read_as(v, p);
  }
  Wrench<double> total_momentum(const State<double>& state, Field<double>& rate) override;
  Energy energy_of(const State<double>& state, Field<double>& rate) override;

 private:
  StepReport whole_step(State<double>& state, int& history, double time, double h, Then then);
  void change_length(State<double>& state, double h);
  bool cannot_follow(const State<double>& state);
  bool gains_energy(const State<double>& state, int history, double h, StepReport& report);
  void begin_effects(const State<double>& state, double h)
    requires kEffects;
  void know_before(const State<double>& state, double h);
  void within_bend(const State<double>& state, Field<double>& v) const;
  Evaluated<double> first_evaluation(State<double>& state, int history, double h, Factor factor, StepReport& report);
  Evaluated<double> evaluation_at_rest(StepReport& report);
  StepStatus advance(State<double>& state, int& history, double h, Then then, StepReport& report);
  StepStatus advance_with_blows(State<double>& state, int& history, double h, StepReport& report)
    requires kEffects;
  double time_of_blow(State<double>& state, double h, StepReport& report)
    requires kEffects;
  bool strike(State<double>& state, double h, bool arrived, StepReport& report)
    requires kEffects;
  std::vector<std::span<double>> effect_memory();
  void clear_account();
  void keep(const State<double>& state);
  void restore(State<double>& state);
  StepStatus solve(State<double>& state, int history, double h, StepReport& report);
  bool halves(State<double>& state, int& history, double h, int depth, StepReport& report);
  void finish(State<double>& state, int& history, double h, Then then, StepReport& report);

  const Model& model_;
  Options options_;
  bool has_stages_;  // steps are sub-steps, of lengths that differ from one to the next
  TreeSweeps<kEffects> sweeps_;
  Workspace<double>& work_;
  EffectsIf<kEffects, double>& effects_;
  TreeSolve<kEffects> solve_;
  std::optional<double> unfinished_;  // h of a step that is solved and left for the next one to end
  EffectAccount account_;  // of the whole step
  [[no_unique_address]] std::conditional_t<kEffects, ImpulseAccount, NoImpulses> impulses_;  // likewise, where somebody asks
  Field<double> before_;  // see know_before
  [[no_unique_address]] std::conditional_t<kEffects, Blows, NoBlows> blows_;
  bool is_new_length_ = false;  // see change_length
  bool passable_ = false;  // see limits.hpp
  double time_ = 0;
  State<double> last_good_;           // see keep
  std::vector<double> last_memory_;   // likewise
};

/// See make_stepper.
template <bool kEffects>
std::unique_ptr<Stepper> make_tree_stepper(const Model& model, const Options& options, const EffectPlan& plan);
template <>
std::unique_ptr<Stepper> make_tree_stepper<false>(const Model& model, const Options& options, const EffectPlan& plan);
template <>
std::unique_ptr<Stepper> make_tree_stepper<true>(const Model& model, const Options& options, const EffectPlan& plan);

}  // namespace linden
