// engine/sweeps/step_memory.hpp
// What the sweeps of a schedule work on: one instance's state, and all that a step of it needs.
#pragma once

#include <memory>

#include "engine/options.hpp"
#include "engine/solve/judge.hpp"
#include "engine/sweeps/coupling_sweeps.hpp"
#include "engine/sweeps/strategy.hpp"
#include "kernels/effects/law.hpp"
#include "kernels/tree/mimic.hpp"
#include "layout/state.hpp"
#include "layout/workspace.hpp"

namespace linden {

template <class S>
class EffectSweeps;

struct StepMemory {
  /// Model and plan must outlive it.
  StepMemory(const Model& model, const Options& options, const EffectPlan& plan);
  ~StepMemory();
  StepMemory(const StepMemory&) = delete;
  StepMemory& operator=(const StepMemory&) = delete;

  /// A step from the state there is begins; `time` at its beginning [s].
  void begin(double time);
  /// An evaluation begins.
  void begin_evaluation(Factor factor);
  /// The step is over.
  void end();

  Gains<double> gains() { return {work.gain_up, work.gain_down, work.joint_inverse}; }
  Gains<double> mass_gains() { return strategy.reuses_factor ? Gains<double>{mass.gain_up, mass.gain_down, mass.joint_inverse} : gains(); }
  /// The residual of each joint as its solve left it.
  Field<double>& joint_residual() { return strategy.one_pass ? work.innovation : work.residual; }
  bool is_known() const { return state.last_step(0) != 0; }

  const Model& model;
  const Options options;
  const EffectPlan& plan;
  const Strategy strategy;
  BodyConstants<double> constants;
  State<double> state;
  int history = 0;  // how many rows of state.history are valid
  Workspace<double> work;
  MassFactor<double> mass;  // empty where no factor outlasts a step
  MimicTies<double> ties;
  CouplingSweeps<double> couplings;
  std::unique_ptr<EffectSweeps<double>> effects;  // null without
  Field<double> before;

  double time = 0;
  // of the evaluation made last
  Evaluated<double> now;
  Factor factor = Factor::fresh;
  bool is_first = true;            // of the step
  bool finds_end_momenta = false;  // momenta at the end of the step are found on the way
  StateUpdate<bool> update{};       // how far the solve is
  bool changed = false;            // a state of an effect was not that of the solution
  double share = 1;                // of a correction that is made
};

}  // namespace linden
