// engine/queries/block_observer.hpp
// What computes observations of W states of one model at once: an interface, since which registers there are is known only when the program
// starts. engine/queries/lane_observer.hpp implements it, compiled once for each set of instructions; with one lane it serves a Simulation.
#pragma once

#include <array>
#include <memory>

#include "engine/queries/observation_schedule.hpp"
#include "engine/solve/instructions.hpp"

namespace linden {

/// Where the W states lie, rows [row][lane]; null: what the schedule does not ask for.
template <class Real>
struct ObservedBlock {
  const Real* q = nullptr;        // [nq]
  const Real* v = nullptr;        // [nv]
  const Real* a = nullptr;        // [nv]
  const Real* p = nullptr;        // [nv]
  const Real* targets = nullptr;  // [servos]
  const Real* time = nullptr;     // [1]
  const Real* energy = nullptr;   // [2]
  const Real* mass = nullptr;     // [slots x kMassRows] of each instance (engine/solve/block_stepper.hpp); null: the model's
  const double* contacts = nullptr;  // [numbers] what contacts of bodies with each other remember (engine/sweeps/body_contacts.hpp)
  const Real* gravity = nullptr;  // [3] of each instance [m/s^2]; null: that of the setup
};

template <class Real>
class BlockObserver {
 public:
  virtual ~BlockObserver() = default;
  /// rows [width][lane].
  virtual void observe(const ObservedBlock<Real>& block, Real* rows) = 0;
};

/// All of it must outlive the observer.
template <class Real>
struct ObserverSetup {
  const Tree& tree;
  const BodyConstants<Real>& constants;
  const ObservationSchedule& schedule;
  std::array<double, 3> gravity;  // [m/s^2]
};

template <Instructions>
std::unique_ptr<BlockObserver<double>> make_block_observer(const ObserverSetup<double>& setup);
template <Instructions>
std::unique_ptr<BlockObserver<float>> make_block_observer(const ObserverSetup<float>& setup);

/// Throw InputError for another model or other servos than the schedule was made for.
void require_same_model(const ObservationSchedule& schedule, const Model& model, std::uint64_t model_hash);
void require_same_servos(const ObservationSchedule& schedule, std::size_t servos);

/// With these instructions.
template <class Real>
std::unique_ptr<BlockObserver<Real>> make_block_observer(Instructions instructions, const ObserverSetup<Real>& setup);

}  // namespace linden
