// engine/queries/observations.hpp
// A list of what is to be seen of a state, by name, made ready once and then read as often as wanted, one row of numbers a state: of a
// Simulation, or of all instances of a Batch, in lanes and on all threads, into memory of the caller. Only what is asked for is computed,
// of bodies only those asked for and those between them and the root.
//
//   Observations seen(scene.model, scene.effects, {"q", "v", "pose:pelvis", "contact:left_foot"});
//   std::vector<double> row(seen.width());
//   seen.observe(simulation, row);
//   std::vector<float> rows(batch.size() * seen.width());
//   batch.observe(seen, rows);                                           [size x width]
//   seen.layout()[2]                                                     pose:pelvis: offset, width, units, names of its numbers
//
//   name                  width   numbers
//   q, v, a               nq, nv  positions, velocities (engine/VELOCITY.md), accelerations (Simulation::accelerations) of all joints
//   p                     nv      discrete momenta of all joints (engine/VELOCITY.md)
//   q:J, v:J, a:J, p:J            of joint J
//   targets, target:J             of all servos in the order of Effects::servos, of that of joint J [rad, m]
//   time                  1       [s]
//   energy                2       kinetic, potential [J]
//   com, com_velocity     3       of the centre of mass, world frame [m, m/s]
//   momentum              6       of the whole system, angular about the world's origin, linear; world frame
//   pose:L                7       of link L in the world: x y z [m], unit quaternion x y z w with w >= 0
//   position:L            3       the first three of these
//   quaternion:L          4       the others
//   twist:L               6       angular and linear velocity of its origin, in the world's directions
//   acceleration:L        6       the same of acceleration
//   imu:L                 6       angular velocity and specific force, in the link's frame (engine/queries/imu.hpp)
//   contact:L             2       of the body that holds L: contact points in the ground, and places where another body or what stands in the world
//                                 pushes it; normal force of all of them [N]: of the ground what its law gives where the body is and as fast as it is
//                                 (Simulation::contacts has the mean over a step), of bodies the mean over the step taken last
//
// Numbers of a Batch equal those of a Simulation in the same state to rounding.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

class Simulation;
struct ObservationSchedule;  // engine/queries/observation_schedule.hpp
template <class Real>
class BlockObserver;         // engine/queries/block_observer.hpp

/// What one name stands for.
struct Observed {
  std::string name;                // as it was asked for
  Index offset = 0, width = 0;     // numbers [offset, offset + width) of a row
  std::vector<std::string> rows;   // what each number is called: "left_knee", "x", ...
  std::string units;               // of each, with commas, or one for all: "m, 1"
};

class Observations {
 public:
  /// Throws InputError for a name that is not known, is there twice, or asks for a link, joint, servo or ground that there is not, with the
  /// nearest name. Neither model nor effects are needed afterwards.
  Observations(const Model& model, const Effects& effects, const std::vector<std::string>& names);
  ~Observations();
  Observations(Observations&&) noexcept;
  Observations& operator=(Observations&&) noexcept;

  const std::vector<Observed>& layout() const { return layout_; }
  /// Throws InputError where it was not asked for.
  const Observed& at(const std::string& name) const;
  /// Numbers of a row.
  Index width() const { return width_; }

  /// `to` [width]. Throws InputError for another length, a simulation of another model, and for accelerations at an order above 2.
  void observe(Simulation& simulation, std::span<double> to);

  const std::shared_ptr<const ObservationSchedule>& schedule() const { return schedule_; }

 private:
  std::vector<Observed> layout_;
  Index width_ = 0;
  std::shared_ptr<const ObservationSchedule> schedule_;
  const Model* model_ = nullptr;  // that observer_ was made for
  std::unique_ptr<BlockObserver<double>> observer_;
};

}  // namespace linden
