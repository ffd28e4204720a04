#include "layout/dependent_joint.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <vector>

namespace linden {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Motions = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;  // columns: twists (w, v) that a joint frees

/// A joint depends on others when, those yielding, it feels less than this share of what it feels while they are held. Light bodies
/// between heavy ones come to 1e-12, rounding to 1e-15.
constexpr double kMovesNothingOfItsOwn = 1e-13;

Matrix3d hat(const Vector3d& a) {
  Matrix3d result;
  result << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return result;
}

Motions motions_of(const Model& model, Index slot) {
  const JointKind kind = model.tree.kind(slot);
  if (kind == JointKind::free) return Matrix6d::Identity();
  if (kind == JointKind::ball) return Matrix6d::Identity().leftCols<3>();
  Motions screw = Motions::Zero(6, 1);
  screw(2, 0) = model.constants.screw(slot, 0);
  screw(5, 0) = model.constants.screw(slot, 1);
  return screw;
}

Matrix6d inertia_of(const Model& model, Index slot) {
  const double* const G = model.constants.inertia.row(slot);
  Matrix3d about_origin;
  about_origin << G[4], G[5], G[6], G[5], G[7], G[8], G[6], G[8], G[9];
  const Matrix3d moment = hat({G[1], G[2], G[3]});
  Matrix6d result;
  result << about_origin, moment, -moment, G[0] * Matrix3d::Identity();
  return result;
}

/// Twists of the parent in the body's frame, the joint moved by an amount that few joints of a model share and that no robot is built for.
Matrix6d to_child_in_generic_pose(const Model& model, Index slot) {
  const double amount = 0.7 + 0.13 * static_cast<double>(slot % 7) + 0.29 * static_cast<double>(slot % 5);
  const double* const X = model.constants.tree_placement.row(slot);
  Isometry3d pose;
  pose.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(X);
  pose.translation() = Eigen::Map<const Vector3d>(X + 9);
  if (model.tree.kind(slot) == JointKind::screw) {
    pose.rotate(Eigen::AngleAxisd(model.constants.screw(slot, 0) * amount, Vector3d::UnitZ()));
    pose.translate(model.constants.screw(slot, 1) * amount * Vector3d::UnitZ());
  } else {
    pose.rotate(Eigen::AngleAxisd(amount, Vector3d(1, 0.6, -0.8).normalized()));
  }
  const Matrix3d back = pose.linear().transpose();
  Matrix6d result;
  result << back, Matrix3d::Zero(), -back * hat(pose.translation()), back;
  return result;
}

double least_eigenvalue(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (matrix + matrix.transpose()), Eigen::EigenvaluesOnly).eigenvalues()[0];
}

bool all_resist_by_themselves(const Model& model) {
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const Motions S = motions_of(model, i);
    if (!(least_eigenvalue(S.transpose() * inertia_of(model, i) * S) > 0)) return false;
  }
  return true;
}

}  // namespace

Index dependent_joint(const Model& model) {
  if (all_resist_by_themselves(model)) return 0;
  const Index slots = model.tree.shape.slots;
  using Inertias = std::vector<Matrix6d, Eigen::aligned_allocator<Matrix6d>>;
  Inertias yielding(static_cast<std::size_t>(slots), Matrix6d::Zero()), held = yielding;  // what children add
  for (Index i = slots - 1; i > 0; --i) {
    const auto at = static_cast<std::size_t>(i), parent = static_cast<std::size_t>(model.tree.parent(i));
    const Motions S = motions_of(model, i);
    const Matrix6d own = inertia_of(model, i), A = yielding[at] + own, whole = held[at] + own;
    const Eigen::MatrixXd d = S.transpose() * A * S;
    if (!(least_eigenvalue(d) > kMovesNothingOfItsOwn * (S.transpose() * whole * S).trace())) return i;
    const Matrix6d left = A - A * S * d.ldlt().solve(Eigen::MatrixXd(S.transpose() * A));
    const Matrix6d to_child = to_child_in_generic_pose(model, i);
    yielding[parent] += to_child.transpose() * left * to_child;
    held[parent] += to_child.transpose() * whole * to_child;
  }
  return 0;
}

}  // namespace linden
