// layout/effects.hpp
// What acts on the bodies and joints of a scene beside gravity, as plain values: one list an effect, an empty list where the scene has
// none of it. Rows are velocity rows of screw joints, slots bodies; model.names says which is which. kernels/effects/ has a file for
// each with its equation, its energy and its cost.
//
//   Effects effects;
//   effects.damping = urdf_damping(model);
//   effects.servos.push_back({.row = elbow, .stiffness = 200, .damping = 20, .target = 0.4});
//   Simulation simulation(model, options, effects);
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "layout/contacts.hpp"
#include "layout/field.hpp"
#include "layout/names.hpp"

namespace linden {

struct Model;

/// A number over time [s]: straight lines between the given points, held before the first and after the last. Times ascend; where
/// two are equal the number jumps.
struct Course {
  std::vector<double> times{0};
  std::vector<double> values{0};
  double at(double time) const;
  /// Mean over [begin, end], exactly. What lies at one of its ends but for the rounding of times lies there: a jump at 0.3 s is that of
  /// the step from 3 x 0.1 s on.
  double mean(double begin, double end) const;
};

/// Inertia of a rotor that a joint turns along.
struct Armature {
  Index row;
  double inertia;  // [kg m^2, kg]
};

struct JointSpring {
  Index row;
  double stiffness;  // [N m/rad, N/m]
  double rest = 0;   // [rad, m]
};

/// Pulls a ball joint towards an orientation by an angle's worth of torque.
struct BallSpring {
  Index slot;
  double stiffness;                        // [N m/rad]
  std::array<double, 4> rest{0, 0, 0, 1};  // unit quaternion x y z w
};

struct JointDamping {
  Index row;           // of a screw, or any row of a ball joint
  double coefficient;  // [N m s/rad, N s/m]
};

/// Coulomb friction: holds the joint still below it, opposes its motion by it.
struct JointFriction {
  Index row;
  double force;  // [N m, N]
};

struct JointLimit {
  Index row;
  double lower = -std::numeric_limits<double>::infinity();  // [rad, m]
  double upper = std::numeric_limits<double>::infinity();
  double restitution = 0;  // 0: stops, 1: bounces back at the same speed
  double velocity = std::numeric_limits<double>::infinity();  // at most, either way [rad/s, m/s]
};

/// A force of stiffness (target - q) + damping (target_velocity - qdot) + feedforward on a joint, at most max_force in all.
struct Servo {
  Index row;
  double stiffness;    // [N m/rad, N/m]
  double damping = 0;  // [N m s/rad, N s/m]
  double target = 0;   // [rad, m]
  double max_force = std::numeric_limits<double>::infinity();  // [N m, N]
  Course target_over_time{{}, {}};  // [rad, m]; goes over target where it has any points
  Course target_velocity{};         // [rad/s, m/s]; that of a moving target is not taken from it
  Course feedforward{};             // [N m, N]

  bool target_moves() const;
  double target_at(double time) const;
};

struct JointTorque {
  Index row;
  Course force;  // [N m, N]
};

/// Moves a joint as given, along the smooth curve through the points (layout/smooth_curve.hpp), with whatever force that takes. It has
/// neither friction nor limits of its own.
struct JointMotion {
  Index row;
  Course position;                  // [rad, m]; no two times are equal
  std::vector<double> velocities{};  // at those points [rad/s, m/s]; none: the curve's own, which never overshoots
};

/// A wrench on a body.
struct BodyWrench {
  Index slot;
  std::array<double, 3> point{};   // where the force acts, body frame [m]
  std::array<double, 3> force{};   // [N]
  std::array<double, 3> moment{};  // [N m]
  bool in_world = true;            // directions of force and moment: the world's, or the body's
  double from = -std::numeric_limits<double>::infinity();  // [s]
  double to = std::numeric_limits<double>::infinity();
  Course scale{{0}, {1}};          // force and moment over time, as shares of the above
  double share_at(double time) const;
  /// Mean of what acts over [begin, end], exactly; ends are as those of Course::mean.
  double mean_share(double begin, double end) const;
};

/// -(linear + quadratic |v|) v at the centre of mass, v relative to the wind.
struct Drag {
  Index slot;
  double linear = 0;     // [N s/m]
  double quadratic = 0;  // [N s^2/m^2]
};

/// Heights over the ground's plane on a grid, two triangles a cell: (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0). Beyond an edge of the map its
/// last row or column goes on for ever: the height is that of the nearest point of the map, and the ground's normal is that of these heights,
/// level across the edge; beyond a corner all is level.
struct HeightField {
  Index columns, rows;           // along x, along y of the plane; 2 or more each
  double spacing_x, spacing_y;   // [m]
  double origin_x, origin_y;     // of heights[0], in the plane's frame [m]
  std::vector<double> heights;   // [rows x columns], row by row [m]
};

struct Ground {
  std::array<double, 3> normal{0, 0, 1};  // unit length, world frame
  double height = 0;                      // of the plane along its normal [m]
  double stiffness = 1e5;                 // of one contact point [N/m]
  double damping = 0;                     // of one contact point along the normal [N s/m]
  double friction = 0.8;                  // Coulomb's coefficient
  std::optional<HeightField> terrain{};
  Contacts contacts{};
};

struct Effects {
  std::vector<Armature> armature;
  std::vector<JointSpring> springs;
  std::vector<BallSpring> ball_springs;
  std::vector<JointDamping> damping;
  std::vector<JointFriction> friction;
  std::vector<JointLimit> limits;
  std::vector<Servo> servos;
  std::vector<JointTorque> torques;
  std::vector<JointMotion> motions;
  std::vector<BodyWrench> wrenches;
  std::vector<Drag> drag;
  std::array<double, 3> wind{0, 0, 0};  // [m/s], world frame
  std::optional<Ground> ground;
};

/// First velocity row of a joint. Throws InputError, with the nearest name, where no such joint moves.
Index row_of(const Model& model, const std::string& joint);

/// Body of a link and the link's frame in it. Throws InputError, with the nearest name, where there is no such link.
const LinkPlace& place_of(const Model& model, const std::string& link);

/// What the robot's file says of its joints. A mimic joint's share is carried to the joint that leads it.
std::vector<JointDamping> urdf_damping(const Model& model);
std::vector<JointFriction> urdf_friction(const Model& model);
/// Limits of position, with those of velocity or without: joints that the file limits neither way have no entry.
std::vector<JointLimit> urdf_limits(const Model& model, double restitution = 0, bool velocities = false);

/// The same on every joint: screws, for damping the rows of ball joints too. Mimic joints' shares are carried to their leaders.
std::vector<Armature> armature_everywhere(const Model& model, double inertia);
std::vector<JointDamping> damping_everywhere(const Model& model, double coefficient);
std::vector<JointFriction> friction_everywhere(const Model& model, double force);
std::vector<JointLimit> velocity_limit_everywhere(const Model& model, double velocity);

/// On every screw joint that follows no other, no stronger than the file's effort limits, with `positions` [nq] for targets; empty:
/// the zero configuration.
std::vector<Servo> servo_everywhere(const Model& model, double stiffness, double damping,
                                    const std::vector<double>& positions = {});

/// Carries what stands on followers' rows to their leaders' (q_f = m q + o): inertia and damping times m^2, friction times |m|,
/// limits through the map, velocities by |m|, the tighter ones and the smaller restitution where several meet. One entry a row is left,
/// sorted by row.
/// Throws InputError where limits leave no room.
std::vector<Armature> on_leaders(const Model& model, const std::vector<Armature>& list);
std::vector<JointDamping> on_leaders(const Model& model, const std::vector<JointDamping>& list);
std::vector<JointFriction> on_leaders(const Model& model, const std::vector<JointFriction>& list);
std::vector<JointLimit> on_leaders(const Model& model, const std::vector<JointLimit>& list);

/// Whether one takes momentum out of the system or brings it in: wrenches, drag, ground.
bool act_from_outside(const Effects& effects);

/// Throws InputError where an effect names what is not there or cannot have it (a row out of range, a screw's effect on a ball or
/// free joint or on a mimic joint's follower), holds a number that makes no sense, or meets another of its kind where there can be
/// only one: friction, limits and servos; or, where a joint's motion is given, none of the first two.
void check(const Effects& effects, const Model& model);

}  // namespace linden
