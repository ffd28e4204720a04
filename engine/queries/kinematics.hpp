// engine/queries/kinematics.hpp
// A state to be asked: where all bodies of a model are, how they move and how they accelerate. Every other question begins with it.
//
//   Kinematics now(simulation);                                       or  Kinematics now(model);  now.set(q, v, a);
//   const LinkPlace foot = place_of(model, "left_foot");              once; any link of the robot's file, those behind fixed joints too
//   link_pose(now, foot);  link_twist(now, foot);                     engine/queries/link_motion.hpp
//   centre_of_mass(now);  total_momentum(now);                        engine/queries/centre_of_mass.hpp
//   link_jacobian(now, foot);                                         engine/queries/jacobian.hpp
//   mass_matrix(now);  solve_mass_matrix(now, force);                 engine/queries/mass_matrix.hpp
//   inverse_dynamics(now);  bias_forces(now);  joint_reactions(now);  engine/queries/inverse_dynamics.hpp
//   step_forces(model, q0, q1, q2, h, gravity);                       engine/queries/step_forces.hpp
//   imu(now, head);                                                   engine/queries/imu.hpp
//
// Spatial vectors are angular first, as Featherstone has them: twists (w, v), wrenches (moment, force). Quaternions are x y z w. Positions
// [nq], velocities and accelerations [nv], conventions as everywhere (engine/simulation.hpp); which row is which joint says model.names.
//
// Joints that follow others (<mimic>) have rows like any joint; of a matrix or of forces what belongs to a follower's row is carried to its
// leader's, as with the momenta of a Simulation, and the follower's own row is zero.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "layout/body_constants.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

class Simulation;

/// A twist or an acceleration.
struct SpatialMotion {
  std::array<double, 3> angular{};  // [rad/s], [rad/s^2]
  std::array<double, 3> linear{};   // [m/s], [m/s^2]
};

/// A wrench.
struct SpatialForce {
  std::array<double, 3> moment{};  // [N m]
  std::array<double, 3> force{};   // [N]
};

/// What a twist, an acceleration or a Jacobian is seen from.
enum class Frame : std::uint8_t {
  aligned,  // the link's origin, in the directions of the world: the velocity of that place
  link,     // the link's own frame
  world,    // the world's frame: the spatial velocity, of what of the link passes the world's origin
};

template <class Scalar>
struct BodyMotions;  // kernels/queries/body_motion_down.hpp

class Kinematics {
 public:
  /// At rest in the zero configuration, gravity 0 0 -9.81 m/s^2. The model must outlive it.
  explicit Kinematics(const Model& model);
  explicit Kinematics(Model&&) = delete;
  /// A state; v and a may be left out, for zero.
  Kinematics(const Model& model, std::span<const double> q, std::span<const double> v = {}, std::span<const double> a = {});
  /// What a simulation is in now, its gravity and armature with it: accelerations are those of Simulation::accelerations, zero at orders
  /// above 2. What it is asked through, place_of and all else, is its model.
  explicit Kinematics(Simulation& simulation);
  ~Kinematics();
  Kinematics(const Kinematics&);
  Kinematics& operator=(const Kinematics&);
  Kinematics(Kinematics&&) noexcept;
  Kinematics& operator=(Kinematics&&) noexcept;

  /// Another state, as in the constructor; quaternions are normalised and mimic joints follow. Throws InputError for a wrong count or a
  /// number that is not finite. cost  one O(n) pass.
  void set(std::span<const double> q, std::span<const double> v = {}, std::span<const double> a = {});
  void set(Simulation& simulation);
  /// In the world's frame [m/s^2].
  void set_gravity(const std::array<double, 3>& gravity) { gravity_ = gravity; }
  /// Inertia of the rotors, on their rows of the mass matrix [nv; kg m^2, kg]; empty: none. Throws InputError for a wrong count
  /// and on a free joint.
  void set_armature(std::span<const double> armature);

  const Model& model() const { return *model_; }
  std::span<const double> positions() const { return q_.flat(); }
  std::span<const double> velocities() const { return v_.flat(); }
  std::span<const double> accelerations() const { return a_.flat(); }
  const std::array<double, 3>& gravity() const { return gravity_; }
  /// Empty where there is none.
  std::span<const double> armature() const { return armature_; }

  /// Of every slot, for those who compute on.
  const BodyMotions<double>& bodies() const { return *motions_; }

 private:
  void evaluate();

  const Model* model_;
  std::array<double, 3> gravity_{0, 0, -9.81};
  std::vector<double> armature_;
  Field<double> q_, v_, a_;
  std::unique_ptr<BodyMotions<double>> motions_;
};

}  // namespace linden
