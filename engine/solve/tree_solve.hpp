// engine/solve/tree_solve.hpp
// What a solve (solve.hpp) asks of one tree that is stepped alone: corrections that are cut and taken back, factors that are made anew or held
// from step to step, friction made smooth where sudden states do not settle. Compiled with effects and without.
#pragma once

#include "engine/solve/held_factor.hpp"
#include "engine/solve/solve.hpp"
#include "engine/sweeps/tree_sweeps.hpp"

namespace linden {

template <bool kEffects>
class TreeSolve {
 public:
  using Number = double;
  static constexpr bool kAlone = true;

  TreeSolve(const Model& model, const Options& options, TreeSweeps<kEffects>& sweeps);

  /// With which factor the first evaluation of a solve is to be made.
  Factor factor_for(int history) const {
    return history > 0 && sweeps_.reuses_factor() && held_.serves(options_.tolerance, held_.age()) ? Factor::kept : Factor::fresh;
  }
  /// Solves a step of h seconds from the evaluation of its first guess, made with that factor. What fails is told in the report.
  StepStatus run(Evaluated<double> now, Factor factor, double h, StepReport& report);
  /// Of the solve that converged last: see displacement_down; kinetic energy of the mean motion [J].
  double least_w() const { return least_w_; }
  double mean_kinetic() const { return mean_kinetic_; }
  /// Relative residual of the solve that failed last.
  double failed_residual() const { return failed_residual_; }
  /// h^2 x kinetic energy that gravity gives in a step of h to what is at rest.
  double fall(double h) const { return fall_per_mass(options_.gravity, h) * sweeps_.constants().subtree_mass(0); }
  HeldFactor<double>& held() { return held_; }

  // what solve.hpp asks
  Evaluated<double> evaluate(Lanes active, Lanes corrected, int round);
  Lanes converged(const Evaluated<double>& now) const;
  Lanes close(const Evaluated<double>& now) const;
  Lanes at_floor(const Evaluated<double>& now, double epsilons) { return sweeps_.at_floor(now, fall(h_), epsilons) ? 1 : 0; }
  bool has_states() const;
  Lanes update_states(const StateUpdate<bool>& update);
  void first_correction(double norm, double before, bool at_floor);
  bool stale(const Evaluated<double>& now, double before) const;
  Lanes refused(Lanes solved, const Evaluated<double>& now);
  void put_aside(Lanes, Lanes, Lanes) {}
  Evaluated<double> cut(double share);
  Evaluated<double> take_back(double share) { return tried(sweeps_.correct(-share, *report_)); }
  void refactor(Evaluated<double>& now) { sweeps_.factor_again(now, *report_); }
  void continuation(Evaluated<double>& now, bool whole);
  void give_up(const Seen& seen);

 private:
  Evaluated<double> tried(const Evaluated<double>& now);
  bool changes_states(const StateUpdate<bool>& update);
  void line_search(Evaluated<double>& now, double slope_before);

  const Model& model_;
  const Options& options_;
  Policy policy_;
  TreeSweeps<kEffects>& sweeps_;
  Workspace<double>& work_;
  HeldFactor<double> held_;
  Field<double> innovation_before_;  // of a correction that is searched along
  // of the solve there is
  StepReport* report_ = nullptr;
  double h_ = 0;
  double enough_ = 0;         // squared energy norm of a residual that will do, beside the tolerance
  bool holds_ = false;        // it began with a factor of an earlier step
  StepStatus trouble_{};      // of the last correction that had to be cut
  StepStatus status_{};
  // of the last one that converged, or failed
  double least_w_ = 1, mean_kinetic_ = 0, failed_residual_ = 0;
};

}  // namespace linden
