// tests/reference/plain_motion.hpp
// Motion of a tree body by body in the world's frame, by Newton and Euler: what the equation M(q) v' = Q - bias is made of.
//
//   angular rate     w_i = w_l + u,  u = r qdot z, R_i w or R_i w        screw, ball, free; l the parent
//   frame's origin   o_i = o_l + w_l x d + s,  s = t qdot z, 0 or R_i v   d from the parent's origin to the body's
//   their slopes at v' = 0
//                    alpha_i = alpha_l + w_l x u,  a_i = a_l + alpha_l x d + w_l x (o_i - o_l) + (w_l or, free, w_i) x s
//   M    = sum m Jc^T Jc + Jw^T I Jw            J rows: velocity rows -> centre of mass, angular rate
//   bias = sum m Jc^T ac + Jw^T (I alpha + w x I w)
//
// Shares nothing with mass_matrix_plain.hpp and coriolis_plain.hpp, which work with twists in body frames and with derivatives of the
// kinetic energy, but the tree: each is the other's test. This one is fast enough for thousands of scenes.
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 2.15 (Newton and Euler in coordinates), 3.2 (equation of motion)
#pragma once

#include <vector>

#include "tests/reference/plain_tree.hpp"

namespace linden::reference {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Rows3 = Eigen::Matrix<double, 3, Eigen::Dynamic>;

struct BodyMotion {
  Matrix3d R = Matrix3d::Identity();  // body -> world
  Vector3d origin = Vector3d::Zero();
  Vector3d w = Vector3d::Zero(), velocity = Vector3d::Zero();            // angular rate; velocity of the origin
  Vector3d alpha = Vector3d::Zero(), acceleration = Vector3d::Zero();    // their slopes at v' = 0
  Rows3 turning, moving;                                                 // Jacobians of w and velocity

  /// Of a point of the body given in the world.
  Vector3d velocity_at(const Vector3d& x) const { return velocity + w.cross(x - origin); }
  Vector3d acceleration_at(const Vector3d& x) const {
    return acceleration + alpha.cross(x - origin) + w.cross(w.cross(x - origin));
  }
  Rows3 rows_at(const Vector3d& x) const { return moving - hat<double>(x - origin) * turning; }
  Vector3d world(const Vector3d& point) const { return origin + R * point; }
};

/// Pose of a joint in its parent at q.
inline Eigen::Isometry3d plain_joint_pose(const PlainBody& body, const VectorXd& q) {
  Eigen::Isometry3d own = Eigen::Isometry3d::Identity();
  switch (body.kind) {
    case JointKind::screw:
      own.linear() = Eigen::AngleAxisd(body.turn * q[body.q], Vector3d::UnitZ()).toRotationMatrix();
      own.translation() = body.shift * q[body.q] * Vector3d::UnitZ();
      break;
    case JointKind::ball: own.linear() = rotation_matrix<double>(q.segment<4>(body.q)); break;
    case JointKind::free:
      own.linear() = rotation_matrix<double>(q.segment<4>(body.q + 3));
      own.translation() = q.segment<3>(body.q);
      break;
  }
  return Eigen::Isometry3d(body.placement) * own;
}

/// standing: v' of a free joint's linear rows is the slope of its velocity seen from the frame as it stands now, not from that which turns.
inline std::vector<BodyMotion> body_motions(const PlainTree& tree, const VectorXd& q, const VectorXd& v, bool standing = false) {
  std::vector<BodyMotion> motions(tree.bodies.size());
  motions[0].turning = motions[0].moving = Rows3::Zero(3, tree.velocities);
  for (Index i = 1; i < tree.slots(); ++i) {
    const PlainBody& body = tree.body(i);
    const BodyMotion& parent = motions[static_cast<std::size_t>(body.parent)];
    BodyMotion& motion = motions[static_cast<std::size_t>(i)];
    const Eigen::Isometry3d joint = plain_joint_pose(body, q);
    const Vector3d arm = parent.R * joint.translation();
    motion.R = parent.R * joint.linear();
    motion.origin = parent.origin + arm;
    motion.turning = parent.turning;
    motion.moving = parent.moving - hat<double>(arm) * parent.turning;
    // the joint's own columns
    if (body.kind == JointKind::screw) {
      motion.turning.col(body.v) += body.turn * motion.R.col(2);
      motion.moving.col(body.v) += body.shift * motion.R.col(2);
    } else {
      motion.turning.middleCols<3>(body.v) += motion.R;
      if (body.kind == JointKind::free) motion.moving.middleCols<3>(body.v + 3) += motion.R;
    }
    motion.w = motion.turning * v;
    motion.velocity = motion.moving * v;
    const Vector3d turns = motion.w - parent.w;
    const Vector3d slides = motion.velocity - parent.velocity - parent.w.cross(arm);
    motion.alpha = parent.alpha + parent.w.cross(turns);
    motion.acceleration = parent.acceleration + parent.alpha.cross(arm) + parent.w.cross(motion.velocity - parent.velocity) +
                          (body.kind == JointKind::free && !standing ? motion.w : parent.w).cross(slides);
  }
  return motions;
}

/// Centre of mass in the body's frame; the origin where there is no mass.
inline Vector3d center_of(const PlainBody& body) {
  return body.mass() > 0 ? Vector3d(body.moment() / body.mass()) : Vector3d(Vector3d::Zero());
}

/// Inertia about the centre of mass, world frame.
inline Matrix3d turning_inertia(const PlainBody& body, const Matrix3d& R) {
  const Matrix3d c = hat<double>(center_of(body));
  return R * (body.G.topLeftCorner<3, 3>() + body.mass() * c * c) * R.transpose();
}

inline MatrixXd mass_matrix_of(const PlainTree& tree, const std::vector<BodyMotion>& motions) {
  MatrixXd M = MatrixXd::Zero(tree.velocities, tree.velocities);
  for (Index i = 1; i < tree.slots(); ++i) {
    const PlainBody& body = tree.body(i);
    const BodyMotion& motion = motions[static_cast<std::size_t>(i)];
    const Rows3 at_center = motion.rows_at(motion.world(center_of(body)));
    const Rows3 turned = turning_inertia(body, motion.R) * motion.turning;
    M.noalias() += body.mass() * at_center.transpose() * at_center;
    M.noalias() += motion.turning.transpose() * turned;
  }
  return M;
}

inline VectorXd bias_force(const PlainTree& tree, const std::vector<BodyMotion>& motions) {
  VectorXd bias = VectorXd::Zero(tree.velocities);
  for (Index i = 1; i < tree.slots(); ++i) {
    const PlainBody& body = tree.body(i);
    const BodyMotion& motion = motions[static_cast<std::size_t>(i)];
    const Vector3d c = motion.world(center_of(body));
    const Matrix3d I = turning_inertia(body, motion.R);
    bias += motion.rows_at(c).transpose() * (body.mass() * motion.acceleration_at(c)) +
            motion.turning.transpose() * (I * motion.alpha + motion.w.cross(I * motion.w));
  }
  return bias;
}

}  // namespace linden::reference
