// tests/reference/plain_forces.hpp
// What the effects of a scene do at one instant, written down as their laws stand in layout/effects.hpp: forces that are numbers, and
// rows of what is sudden, whose force follows from how the motion goes on.
//
//   force   Q(q, v, t) [nv]                             gravity, springs, dead zones, damping, torques, wrenches, drag, servos
//   row     J v + compliance lambda = goal,  lambda within [low, high], or at an end of it and pushing on
//
//   friction    J one joint               goal 0                      |lambda| <= f dt
//   limit       J one joint, inward       goal -gap / dt or e |v|     lambda >= 0
//   speed       J one joint, slower       goal -most                  lambda >= 0
//   normal      J n.velocity of contact   goal -k gap / g             lambda >= 0            compliance 1 / (g dt), g = c + k dt
//   tangents    J across, two rows        goal 0                      |(lambda)| <= friction x lambda of the normal
//   rolling     J of turns, two rows      goal 0                      likewise, by the length of rolling friction
//   twist       J of turns about n        goal 0                      |lambda| <= torsional friction x lambda of the normal
//   servo       J one joint               goal pull at rest / g       |lambda| <= max dt     compliance 1 / (g dt), g = c + k dt
//
// Bodies touch each other (plain_touch.hpp) as one touches the ground, g = k (eases + dt): a step of implicit Euler's method takes from a spring what
// a damper of k times that step does, and what strikes within a step stops.
//
// lambda: impulse of a step of length dt [N m s, N s]. A servo of unlimited force is a force.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "layout/effects.hpp"
#include "tests/reference/plain_motion.hpp"
#include "tests/reference/plain_touch.hpp"

namespace linden::reference {

inline Vector3d vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

enum class RowKind { friction, limit, servo, normal, tangent, twist };

struct PlainRow {
  RowKind kind;
  Eigen::RowVectorXd J;  // [nv]
  double low, high, goal = 0, compliance = 0;
  double friction = 0;   // of a pair of tangents, or a twist: coefficient [1, m]
  Eigen::Index back = 1; // and how far before it, or the first of a pair, its normal stands
};

/// Where each velocity row's position is: of screws alone.
inline std::vector<Index> position_rows(const PlainTree& tree) {
  std::vector<Index> rows(static_cast<std::size_t>(tree.velocities), -1);
  for (Index i = 1; i < tree.slots(); ++i) {
    if (tree.body(i).kind == JointKind::screw) rows[static_cast<std::size_t>(tree.body(i).v)] = tree.body(i).q;
  }
  return rows;
}

/// -k log(rest^-1 R), in the frame of the body.
inline Vector3d ball_spring_torque(const BallSpring& spring, const Eigen::Vector4d& turned) {
  const Eigen::Quaterniond rest(spring.rest[3], spring.rest[0], spring.rest[1], spring.rest[2]);
  Eigen::Vector4d off = (rest.conjugate() * Eigen::Quaterniond(turned)).coeffs();
  if (off[3] < 0) off = -off;
  return -spring.stiffness * rotation_vector<double>(off);
}

/// A place where a body touches the ground, and that whose height its gap goes by: a ball's centre, or the place itself.
struct PlainContact {
  Index slot;
  Vector3d gauge, place;  // world
  double gap;
};

class PlainForces {
 public:
  PlainForces(const PlainTree& tree, const Effects& effects, const std::array<double, 3>& gravity)
      : tree_(&tree), effects_(&effects), gravity_(vector_of(gravity)), position_(position_rows(tree)) {
    if (effects.contact) touching_.emplace(*effects.contact);
  }

  Index position_row(Index row) const { return position_[static_cast<std::size_t>(row)]; }
  double position(const VectorXd& q, Index row) const { return q[position_[static_cast<std::size_t>(row)]]; }

  /// limited: servos of limited force as well, as numbers.
  VectorXd force(const VectorXd& q, const VectorXd& v, double time, const std::vector<BodyMotion>& motions, bool limited) const {
    VectorXd Q = VectorXd::Zero(tree_->velocities);
    const auto act = [&](Index slot, const Vector3d& at, const Vector3d& force, const Vector3d& moment) {
      const BodyMotion& motion = motions[static_cast<std::size_t>(slot)];
      Q += motion.rows_at(at).transpose() * force + motion.turning.transpose() * moment;
    };
    for (Index i = 1; i < tree_->slots(); ++i) {
      const PlainBody& body = tree_->body(i);
      act(i, motions[static_cast<std::size_t>(i)].world(center_of(body)), body.mass() * gravity_, Vector3d::Zero());
    }
    for (const JointSpring& spring : effects_->springs) Q[spring.row] -= spring.stiffness * (position(q, spring.row) - spring.rest);
    for (const BallSpring& spring : effects_->ball_springs) {
      const PlainBody& body = tree_->body(spring.slot);
      Q.segment<3>(body.v) += ball_spring_torque(spring, q.segment<4>(body.q));
    }
    for (const DeadZoneSpring& spring : effects_->dead_zone_springs) {
      const double x = position(q, spring.row) - spring.rest, beyond = x - std::clamp(x, -spring.half_width, spring.half_width);
      const double push = spring.stiffness * beyond + spring.damping * v[spring.row];
      if (push * beyond > 0) Q[spring.row] -= push;
    }
    for (const JointDamping& damper : effects_->damping) Q[damper.row] -= damper.coefficient * v[damper.row];
    for (const Servo& servo : effects_->servos) {
      if (is_row(servo) && !limited) continue;
      const double pull = still_pull(servo, q, time) - servo.damping * v[servo.row];
      Q[servo.row] += std::clamp(pull, -servo.max_force, servo.max_force);
    }
    for (const JointTorque& torque : effects_->torques) Q[torque.row] += torque.force.at(time);
    for (const BodyWrench& wrench : effects_->wrenches) {
      if (time < wrench.from || time >= wrench.to) continue;
      const BodyMotion& motion = motions[static_cast<std::size_t>(wrench.slot)];
      const Matrix3d turn = wrench.in_world ? Matrix3d(Matrix3d::Identity()) : motion.R;
      const double scale = wrench.scale.at(time);
      act(wrench.slot, motion.world(vector_of(wrench.point)), scale * turn * vector_of(wrench.force),
          scale * turn * vector_of(wrench.moment));
    }
    for (const Drag& drag : effects_->drag) {
      const BodyMotion& motion = motions[static_cast<std::size_t>(drag.slot)];
      const Vector3d c = motion.world(center_of(tree_->body(drag.slot)));
      const Vector3d wind = motion.velocity_at(c) - vector_of(effects_->wind);
      act(drag.slot, c, -(drag.linear + drag.quadratic * wind.norm()) * wind, Vector3d::Zero());
    }
    return Q;
  }

  /// Slopes of the joints' forces along their own rows: -dQ/dv, -dQ/dq, the latter at q.
  void joint_gains(const VectorXd& q, VectorXd& c, VectorXd& k) const {
    c = k = VectorXd::Zero(tree_->velocities);
    for (const JointSpring& spring : effects_->springs) k[spring.row] += spring.stiffness;
    for (const BallSpring& spring : effects_->ball_springs) {
      k.segment<3>(tree_->body(spring.slot).v).array() += spring.stiffness;
    }
    for (const DeadZoneSpring& spring : effects_->dead_zone_springs) {
      if (std::abs(position(q, spring.row) - spring.rest) <= spring.half_width) continue;
      k[spring.row] += spring.stiffness;
      c[spring.row] += spring.damping;
    }
    for (const JointDamping& damper : effects_->damping) c[damper.row] += damper.coefficient;
    for (const Servo& servo : effects_->servos) {
      if (is_row(servo)) continue;
      c[servo.row] += servo.damping;
      k[servo.row] += servo.stiffness;
    }
  }

  /// Over a plane; terrain is not in here. A rim touches at its lowest place, and at those opposite and a quarter turn to either side,
  /// which stay where they are in space while the rim turns: the last two as high as its centre.
  std::vector<PlainContact> contacts(const std::vector<BodyMotion>& motions) const {
    std::vector<PlainContact> result;
    if (!effects_->ground) return result;
    const Vector3d n = vector_of(effects_->ground->normal);
    for (const ContactSphere& sphere : effects_->ground->contacts.spheres) {
      const Vector3d c = motions[static_cast<std::size_t>(sphere.slot)].world(vector_of(sphere.center));
      result.push_back({sphere.slot, c, c - sphere.radius * n, n.dot(c) - effects_->ground->height - sphere.radius});
    }
    for (const ContactRim& rim : effects_->ground->contacts.rims) {
      const BodyMotion& motion = motions[static_cast<std::size_t>(rim.slot)];
      const Vector3d c = motion.world(vector_of(rim.center)), axis = motion.R * vector_of(rim.axis), across = n - n.dot(axis) * axis;
      const Vector3d down = across.norm() > 1e-9 ? Vector3d(-across.normalized()) : axis.unitOrthogonal();
      const Vector3d beside = axis.cross(down);
      for (const double way : {1.0, -1.0}) {
        const Vector3d end = c + way * rim.radius * down;
        result.push_back({rim.slot, end, end, n.dot(end) - effects_->ground->height});
        result.push_back({rim.slot, c, c + way * rim.radius * beside, n.dot(c) - effects_->ground->height});
      }
    }
    return result;
  }

  /// Room of a limit: what is left of it below (side 0) and above (side 1).
  double room(const JointLimit& limit, int side, const VectorXd& q) const {
    const double at = position(q, limit.row);
    return side == 0 ? at - limit.lower : limit.upper - at;
  }

  /// Where bodies touch each other, or may within dt. directions: of each pair, from one time to the next.
  std::vector<PlainTouch> touches(const std::vector<BodyMotion>& motions, double dt, std::vector<Vector3d>& directions) const {
    if (!touching_) return {};
    constexpr double kNear = 2e-3, kArm = 0.3;  // [m]
    double fast = 0;
    for (const BodyMotion& motion : motions) fast = std::max(fast, motion.velocity.norm() + kArm * motion.w.norm());
    return touching_->places(motions, kNear + 2 * dt * fast, directions);
  }

  /// Whether anything that is sudden may act at q and v.
  bool sudden(const VectorXd& q, const VectorXd& v, const std::vector<BodyMotion>& motions, const std::vector<PlainTouch>& touches) const {
    if (std::ranges::any_of(touches, [](const PlainTouch& touch) { return touch.gap <= 0; })) return true;
    for (const JointFriction& friction : effects_->friction) {
      if (friction.force > 0) return true;
    }
    for (const JointLimit& limit : effects_->limits) {
      if (room(limit, 0, q) <= 0 || room(limit, 1, q) <= 0 || std::abs(v[limit.row]) >= limit.velocity) return true;
    }
    return std::ranges::any_of(contacts(motions), [](const PlainContact& contact) { return contact.gap <= 0; });
  }

  /// Rows of a step of length dt that would go on with the velocities `free` if nothing sudden acted. eases: of bodies that touch each other, the
  /// damper beside the spring over its stiffness [s].
  std::vector<PlainRow> rows(const VectorXd& q, const VectorXd& v, const VectorXd& free, const std::vector<BodyMotion>& motions,
                             const std::vector<PlainTouch>& touches, double eases, double time, double dt) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::vector<PlainRow> rows;
    const auto unit = [&](Index row, double sign) {
      Eigen::RowVectorXd J = Eigen::RowVectorXd::Zero(tree_->velocities);
      J[row] = sign;
      return J;
    };
    for (const JointFriction& friction : effects_->friction) {
      rows.push_back({RowKind::friction, unit(friction.row, 1), -friction.force * dt, friction.force * dt});
    }
    for (const Servo& servo : effects_->servos) {
      const double g = servo.damping + servo.stiffness * dt;
      if (!is_row(servo)) continue;
      rows.push_back({RowKind::servo, unit(servo.row, 1), -servo.max_force * dt, servo.max_force * dt,
                      still_pull(servo, q, time) / g, 1 / (g * dt)});
    }
    for (const JointLimit& limit : effects_->limits) {
      for (const int side : {0, 1}) {
        const double inward = side == 0 ? 1 : -1, gap = room(limit, side, q);
        // always, for what other rows may throw it to
        if (std::isfinite(limit.velocity)) rows.push_back({RowKind::limit, unit(limit.row, inward), 0, kInfinity, -limit.velocity});
        if (gap + dt * std::min(inward * free[limit.row], inward * v[limit.row]) > 0) continue;
        const double back = -limit.restitution * inward * v[limit.row];
        rows.push_back({RowKind::limit, unit(limit.row, inward), 0, kInfinity, back > 0 ? back : -std::max(gap, 0.0) / dt});
      }
    }
    const std::vector<PlainContact> all = contacts(motions);
    for (const PlainContact& contact : all) {
      const Ground& ground = *effects_->ground;
      const Vector3d n = vector_of(ground.normal);
      const BodyMotion& motion = motions[static_cast<std::size_t>(contact.slot)];
      const Rows3 J = motion.rows_at(contact.place);
      const Eigen::RowVectorXd rise = n.transpose() * motion.rows_at(contact.gauge);
      if (contact.gap + dt * std::min(rise.dot(free), rise.dot(v)) > 0) continue;
      const double g = (contact.gap <= 0 ? ground.damping : 0) + ground.stiffness * dt;
      rows.push_back({RowKind::normal, rise, 0, kInfinity, -ground.stiffness * contact.gap / g, 1 / (g * dt)});
      const Vector3d x = n.unitOrthogonal(), y = n.cross(x);
      for (const Vector3d& across : {x, y}) {
        rows.push_back({RowKind::tangent, across.transpose() * J, 0, 0, 0, 0, ground.friction});
      }
    }
    for (const PlainTouch& touch : touches) {
      const Rows3 J = motions[static_cast<std::size_t>(touch.slot_b)].rows_at(touch.place) - motions[static_cast<std::size_t>(touch.slot_a)].rows_at(touch.place);
      const Eigen::RowVectorXd parts = touch.normal.transpose() * J;
      if (touch.gap + dt * std::min(parts.dot(free), parts.dot(v)) > 0) continue;
      const double stiffness = effects_->contact->materials[0].stiffness, g = stiffness * ((touch.gap <= 0 ? eases : 0) + dt);
      rows.push_back({RowKind::normal, parts, 0, kInfinity, -stiffness * touch.gap / g, 1 / (g * dt)});
      const Vector3d x = touch.normal.unitOrthogonal(), y = touch.normal.cross(x);
      const ContactMaterial& material = effects_->contact->materials[0];
      for (const Vector3d& across : {x, y}) rows.push_back({RowKind::tangent, across.transpose() * J, 0, 0, 0, 0, material.friction});
      if (!material.resists_turning()) continue;
      const Rows3 turns = motions[static_cast<std::size_t>(touch.slot_b)].turning - motions[static_cast<std::size_t>(touch.slot_a)].turning;
      for (const Vector3d& across : {x, y}) rows.push_back({RowKind::tangent, across.transpose() * turns, 0, 0, 0, 0, material.rolling_friction, 3});
      rows.push_back({RowKind::twist, touch.normal.transpose() * turns, 0, 0, 0, 0, material.torsional_friction, 5});
    }
    return rows;
  }

 private:
  /// Its force is limited and follows from how the motion goes on.
  static bool is_row(const Servo& servo) { return std::isfinite(servo.max_force) && (servo.stiffness > 0 || servo.damping > 0); }
  /// What it pulls with at no speed.
  double still_pull(const Servo& servo, const VectorXd& q, double time) const {
    return servo.stiffness * (servo.target_at(time) - position(q, servo.row)) + servo.damping * servo.target_velocity.at(time) +
           servo.feedforward.at(time);
  }

  const PlainTree* tree_;
  const Effects* effects_;
  Vector3d gravity_;
  std::vector<Index> position_;
  std::optional<PlainTouching> touching_;
};

}  // namespace linden::reference
