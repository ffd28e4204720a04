// engine/solve/block_stepper.hpp
// What steps a block of W instances of one tree, W the lanes of a register: an interface, since which registers there are is known only
// when the program starts. engine/solve/lane_stepper.hpp implements it, compiled once for each set of instructions.
#pragma once

#include <cstdint>
#include <memory>

#include "engine/instance_record.hpp"
#include "engine/options.hpp"
#include "engine/solve/instructions.hpp"
#include "layout/model.hpp"

namespace linden {

struct EffectPlan;

/// Where the W instances of a block lie. Rows are [row][lane].
template <class Real>
struct Block {
  Real* q;                    // [nq]
  Real* p;                    // [nv]
  std::uint32_t* past;        // layout/packed_history.hpp
  std::uint32_t* factor;      // [packed_factor_words] of the step that made it last; null: no factor outlasts a step
  Real* held;                 // [4] what is known of it (engine/solve/held_factor.hpp); null likewise
  const Real* applied;        // [nv] forces given from outside; null: none
  const Real* mass;           // [slots x 11] inertia and subtree_mass of each instance; null: the model's
  const Real* gravity;        // [3] of each instance [m/s^2], world frame; null: that of the options
  const Real* targets;        // [servos] targets of each instance, NaN: of the plan's table; null: the plan's
  const Real* frictions;      // [frictions] forces of each instance; null: the plan's
  const Real* gains;          // [servos] factors of stiffness and damping of each instance; null: 1
  const Real* ground_friction;  // Coulomb's coefficient of each instance; null: the plan's
  Real* excess_before;        // [nv] see EffectControls::Reading; null: no effects
  Real* reading;              // [nv] likewise
  Real* bend;                 // [nv] likewise
  Real* kept;                 // [EffectPlan::kept] (EffectSweeps::kept); null: none
  double* contacts;           // [numbers] BodyContacts::memory of each instance; null: bodies do not touch each other
  InstanceRecord* instances;  // [W]
  int count;                  // instances in use, 1 to W
};

template <class Real>
class BlockStepper {
 public:
  virtual ~BlockStepper() = default;
  virtual int lanes() const = 0;

  /// `steps` steps of every instance that is not frozen.
  virtual void step(const Block<Real>& block, std::int64_t steps) = 0;

  /// velocities [nv] and energy [2] (kinetic, potential [J]; null: not asked for) of every instance, rows [row][lane]. stepped: this block
  /// was the last to be stepped here, and nothing of it was written since, so what its last step left need not be found anew.
  virtual void observe(const Block<Real>& block, Real* velocities, Real* energy, bool stepped) = 0;
};

/// The model's constants in the precision of the lanes, and how to step. Both must outlive the steppers.
template <class Real>
struct BlockSetup {
  const Model& model;
  const BodyConstants<Real>& constants;
  const Options& options;
  const EffectPlan& plan;  // beside gravity
  bool holds_factor;       // from step to step; what acts must have no states
};

/// kEffects: with those of the plan.
template <Instructions, bool kEffects>
std::unique_ptr<BlockStepper<double>> make_block_stepper(const BlockSetup<double>& setup);
template <Instructions, bool kEffects>
std::unique_ptr<BlockStepper<float>> make_block_stepper(const BlockSetup<float>& setup);

}  // namespace linden
