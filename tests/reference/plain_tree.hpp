// tests/reference/plain_tree.hpp
// A tree as the other plain twins see it: one struct a body, 4 x 4 poses, 6 x 6 inertias, positions as one vector.
//
// Indices are slots; body 0 is the world. A variation eps [nv] multiplies each joint's pose from the right,
// T_lambda(i),i <- T_lambda(i),i exp([S_i eps_i]): for a screw q + eps, for ball and free joints a twist in the body's
// frame.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "layout/model.hpp"
#include "tests/reference/se3_plain.hpp"

namespace linden::reference {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct PlainBody {
  Index parent = 0;
  JointKind kind = JointKind::screw;
  double turn = 0, shift = 0;                               // of a screw, per unit of q
  Matrix4<double> placement = Matrix4<double>::Identity();  // at q = 0, child -> parent
  Matrix6<double> G = Matrix6<double>::Zero();              // inertia about the frame's origin (7)
  Eigen::Matrix<double, 6, Eigen::Dynamic> S;               // joint Jacobian, body frame
  Index q = 0, v = 0;                                       // first rows

  double mass() const { return G(3, 3); }
  /// Mass times centre of mass, body frame.
  Vector3<double> moment() const { return {G(2, 4), G(0, 5), G(1, 3)}; }
  Index dofs() const { return static_cast<Index>(S.cols()); }
};

struct PlainTree {
  std::vector<PlainBody> bodies;  // [slots]
  Index positions = 0, velocities = 0;

  Index slots() const { return static_cast<Index>(bodies.size()); }
  const PlainBody& body(Index i) const { return bodies[static_cast<std::size_t>(i)]; }
};

inline PlainTree plain_tree(const Model& model) {
  PlainTree tree;
  tree.positions = model.tree.shape.positions;
  tree.velocities = model.tree.shape.velocities;
  tree.bodies.resize(static_cast<std::size_t>(model.tree.shape.slots));
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    PlainBody& body = tree.bodies[static_cast<std::size_t>(i)];
    body.parent = model.tree.parent(i);
    body.kind = model.tree.kind(i);
    body.turn = model.constants.screw(i, 0);
    body.shift = model.constants.screw(i, 1);
    body.q = model.tree.first_q(i);
    body.v = model.tree.first_v(i);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        body.placement(row, column) = model.constants.tree_placement(i, 3 * row + column);
      body.placement(row, 3) = model.constants.tree_placement(i, 9 + row);
    }
    const auto g = [&](int k) {
      return model.constants.inertia(i, k);
    };
    Matrix3<double> rotational;
    rotational << g(4), g(5), g(6), g(5), g(7), g(8), g(6), g(8), g(9);
    const Matrix3<double> C = hat<double>({g(1), g(2), g(3)});
    body.G << rotational, C, C.transpose(), g(0) * Matrix3<double>::Identity();
    if (body.kind == JointKind::screw) {
      body.S.setZero(6, 1);
      body.S(2, 0) = body.turn;
      body.S(5, 0) = body.shift;
    } else {
      body.S.setIdentity(6, velocity_count(body.kind));
    }
  }
  return tree;
}

/// T_lambda(i),i: pose of a body in its parent at q, varied by eps.
template <class T>
Matrix4<T> joint_pose(const PlainBody& body, const VectorXd& q, const VectorX<T>& eps) {
  Matrix4<double> own = Matrix4<double>::Identity();
  switch (body.kind) {
    case JointKind::screw: {
      const double angle = body.turn * q[body.q];
      own.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
      own(2, 3) = body.shift * q[body.q];
      break;
    }
    case JointKind::ball:
      own.topLeftCorner<3, 3>() = rotation_matrix<double>(q.segment<4>(body.q));
      break;
    case JointKind::free:
      own.topLeftCorner<3, 3>() = rotation_matrix<double>(q.segment<4>(body.q + 3));
      own.topRightCorner<3, 1>() = q.segment<3>(body.q);
      break;
  }
  const Vector6<T> twist = body.S.template cast<T>() * eps.segment(body.v, body.dofs());
  return (body.placement * own).template cast<T>() * exp<T>(twist);
}

/// T_i: pose of every body in the world, (18).
template <class T>
std::vector<Matrix4<T>> poses(const PlainTree& tree, const VectorXd& q, const VectorX<T>& eps) {
  std::vector<Matrix4<T>> result(tree.bodies.size(), Matrix4<T>::Identity());
  for (Index i = 1; i < tree.slots(); ++i) {
    result[static_cast<std::size_t>(i)] =
        result[static_cast<std::size_t>(tree.body(i).parent)] * joint_pose<T>(tree.body(i), q, eps);
  }
  return result;
}

inline std::vector<Matrix4<double>> poses(const PlainTree& tree, const VectorXd& q) {
  return poses<double>(tree, q, VectorXd::Zero(tree.velocities));
}

/// q (+) delta, quaternions normalised.
inline VectorXd advanced(const PlainTree& tree, const VectorXd& q, const VectorXd& delta) {
  VectorXd result = q;
  for (Index i = 1; i < tree.slots(); ++i) {
    const PlainBody& body = tree.body(i);
    if (body.kind == JointKind::screw) {
      result[body.q] += delta[body.v];
      continue;
    }
    const Index turn = body.kind == JointKind::free ? body.q + 3 : body.q;
    const Eigen::Quaterniond before(Eigen::Vector4d(q.segment<4>(turn)));
    const Eigen::Quaterniond after = before * Eigen::Quaterniond(rotation_quaternion<double>(delta.segment<3>(body.v)));
    result.segment<4>(turn) = after.normalized().coeffs();
    if (body.kind == JointKind::free) {
      const Matrix4<double> moved = exp<double>(delta.segment<6>(body.v));
      result.segment<3>(body.q) += rotation_matrix<double>(q.segment<4>(turn)) * moved.topRightCorner<3, 1>();
    }
  }
  return result;
}

/// Calls body(columns, eps) for every stretch of N directions; eps varies in direction columns.begin + k with slope k.
template <int N, class Body>
void each_direction(Index directions, Body&& body) {
  for (Index first = 0; first < directions; first += N) {
    const Index count = std::min<Index>(N, directions - first);
    VectorX<Dual<N>> eps = VectorX<Dual<N>>::Zero(directions);
    for (Index k = 0; k < count; ++k) eps[first + k] = Dual<N>(0.0, k);
    body(first, count, eps);
  }
}

/// Gradient of f(eps) at eps = 0.
template <class Function>
VectorXd gradient(Index directions, Function&& f) {
  VectorXd result(directions);
  each_direction<8>(directions, [&](Index first, Index count, const VectorX<Dual<8>>& eps) {
    const Dual<8> y = f(eps);
    for (Index k = 0; k < count; ++k) result[first + k] = y.slope[static_cast<std::size_t>(k)];
  });
  return result;
}

/// Jacobian of the vector f(eps) at eps = 0.
template <class Function>
MatrixXd jacobian(Index directions, Function&& f) {
  MatrixXd result;
  each_direction<8>(directions, [&](Index first, Index count, const VectorX<Dual<8>>& eps) {
    const VectorX<Dual<8>> y = f(eps);
    result.conservativeResize(y.size(), directions);
    for (Index k = 0; k < count; ++k) {
      for (Eigen::Index row = 0; row < y.size(); ++row)
        result(row, first + k) = y[row].slope[static_cast<std::size_t>(k)];
    }
  });
  return result;
}

}  // namespace linden::reference
