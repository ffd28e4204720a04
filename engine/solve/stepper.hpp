// engine/solve/stepper.hpp
// The one-step map (q, p) -> (q, p) of one instance: solve the discrete Euler-Lagrange equation for the displacement, then read off the
// new momentum. tree_stepper.hpp says how.
//
// Symplectic, time-symmetric, second order; no allocation. A solve that makes no progress is backtracked, then given a fresh exact
// Jacobian; a step that still fails is split in two. If that fails too the state is left as it was.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/assembly.hpp"
#include "engine/coupling_state.hpp"
#include "engine/effects/effect_controls.hpp"
#include "engine/effects/effect_work.hpp"
#include "engine/effects/step_impulses.hpp"
#include "engine/energy.hpp"
#include "engine/options.hpp"
#include "engine/step_report.hpp"
#include "layout/state.hpp"

namespace linden {

struct EffectPlan;
struct Model;
template <class Scalar>
struct BodyConstants;
template <class Scalar>
struct Wrench;  // kernels/values/spatial.hpp

/// What follows a step: nothing that is known of, or a step of the same h before anything else is asked of stepper and state, which may then
/// be left for that step to complete.
enum class Then : std::uint8_t { stop, step };

class Stepper {
 public:
  virtual ~Stepper();

  /// Brings placements and forces to the positions in `state`; call after any change of them from outside.
  virtual void refresh(const State<double>& state) = 0;
  /// Generalized forces [nv] on top of gravity, the same until they are set anew; followed by a refresh. Empty: none.
  virtual void apply(std::span<const double> force) = 0;
  /// Masses and inertias of an instance that differs from the model, followed by a refresh. They must live as long as they are used.
  virtual void use(const BodyConstants<double>& constants) = 0;
  /// Another gravity [m/s^2] than that of the options, followed by a refresh.
  virtual void use_gravity(const std::array<double, 3>& gravity) = 0;
  /// The state is another's from now on, or was changed: nothing is known of a step before.
  virtual void forget() = 0;

  /// One step of `h` seconds, `time` at its beginning; back in time where h < 0 (no effect may dissipate or depend on time then).
  /// `history`: how many rows of state.history are valid, displacements of earlier steps; updated. Of order 2 they are brought to the length of this
  /// one where they are of another.
  /// A step that fails leaves the state complete, as it was at its beginning.
  virtual StepReport step(State<double>& state, int& history, double time, double h, Then then) = 0;
  /// Of effects, in the step taken last.
  virtual const EffectAccount& effect_account() const = 0;
  /// Twists of all bodies [rad/s, m/s], body frame: in the mean motion of the step taken last, of order 2; those that joint velocities make at the
  /// positions of the last refresh or step.
  virtual void mean_twists(const State<double>& state, Field<double, 6>& twist) = 0;
  virtual void twists_of(const Field<double>& v, Field<double, 6>& twist) = 0;

  /// From now on the impulses of effects in a step are kept, as those of the step taken last; without effects there are none.
  virtual void keep_impulses() = 0;
  virtual const StepImpulses& impulses() const = 0;

  /// Of the step taken last, of h seconds; without one no force.
  virtual std::vector<CouplingState> couplings(double h) const = 0;
  /// Coordinates of cables brought to their lengths, at the positions of the last refresh; those whose motion is given are left alone.
  virtual void measure_cables(State<double>& state) = 0;
  /// How far open they are at the positions of the last refresh; assemble: brings the positions to where they are closed, or least open.
  virtual Assembly openness() = 0;
  virtual Assembly assemble(State<double>& state) = 0;

  /// To set effects, and what they keep of the step taken last.
  virtual EffectControls controls() = 0;
  /// What effects, or the solver, keep from step to step beside the state: part of a checkpoint.
  virtual std::vector<std::span<double>> memory() = 0;

  /// Of these what contacts of bodies with each other keep (engine/sweeps/body_contacts.hpp); empty without.
  virtual std::span<double> contact_memory() = 0;

  /// The velocity of the motion at the positions of the last refresh or step, see engine/VELOCITY.md: M(q)^-1 p where nothing acts
  /// but potentials; else p is read with the effects' impulses taken half at each end of the last step, what they hold is at rest, and no
  /// velocity is farther from the mean one of that step than the motion bends.
  virtual void read_velocity(const State<double>& state, Field<double>& v) = 0;
  /// p = M(q) v of a start, whose velocities are brought to the nearest that leave couplings closed.
  virtual void momentum_of(Field<double>& v, Field<double>& p) = 0;
  /// Momentum of the whole system about the world's origin, in the world's frame, as its energy is. rate: scratch.
  virtual Wrench<double> total_momentum(const State<double>& state, Field<double>& rate) = 0;
  /// Of a state with the positions of the last refresh or step; rate: its velocity. The kinetic energy is that of p and of M^-1 p as they
  /// are read, which the works of effects go with.
  virtual Energy energy_of(const State<double>& state, Field<double>& rate) = 0;
};

/// With the effects of the plan, where it has any. Model and plan must outlive the stepper. Throws InputError for options that make no
/// sense.
std::unique_ptr<Stepper> make_stepper(const Model& model, const Options& options, const EffectPlan& plan);

}  // namespace linden
