// engine/solve/instance_stepper.hpp
// One instance of a block on its own, in double precision: its start, and the steps that a block cannot take because they need
// backtracking or splitting.
#pragma once

#include <memory>
#include <span>

#include "engine/solve/stepper.hpp"
#include "layout/body_constants.hpp"

namespace linden {

class InstanceStepper {
 public:
  InstanceStepper(const Model& model, const Options& options, const EffectPlan& plan);
  // not inline: compiled for every processor, where those that use it are compiled for one
  ~InstanceStepper();

  State<double>& state() { return state_; }

  /// Inertia of every body [slots x 10]; subtree masses follow.
  BodyConstants<double>& own_constants();
  /// Generalized forces [nv] to be written; from the first call on they count.
  std::span<double> applied();
  /// Another gravity [m/s^2] than that of the options.
  void use_gravity(const std::array<double, 3>& gravity);

  /// Before all else of an instance: nothing is left of the one before it.
  void forget();
  /// To set effects, and what they keep: to be written before a step and read after it.
  EffectControls controls() { return stepper_->controls(); }
  /// Likewise; of contacts of bodies with each other.
  std::span<double> contact_memory() { return stepper_->contact_memory(); }

  /// One step of the state, from `time` on; after one that failed the state is no more what it was. The latest row of state().history and
  /// state().last_step say what is known of the step before; the first guess goes by `guessed` of them, 0 or 1.
  StepReport step(double time, int guessed);
  /// Closes the couplings of a start that leaves them nearly closed; returns how far open they are.
  Assembly close_nearly_closed();
  /// p = M(q) v.
  void set_velocities(std::span<const double> v);
  /// Energy; and rate() is the velocity that is read.
  Energy observe();
  const Field<double>& rate() const { return rate_; }

 private:
  void refresh();

  const Model& model_;
  Options options_;
  std::unique_ptr<Stepper> stepper_;
  State<double> state_;
  Field<double> rate_;
  BodyConstants<double> constants_;  // empty where the model's are meant
  std::vector<double> applied_;      // empty where there are none
};

/// Quaternions of ball and free joints to unit length, followers of mimic joints to their leaders. Throws InputError for a position that
/// is not finite or a quaternion of length zero.
void normalise_positions(const Model& model, std::span<double> q);

}  // namespace linden
