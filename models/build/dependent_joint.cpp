#include "models/build/dependent_joint.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <vector>

namespace linden {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;
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

/// How far each joint is moved: amounts that few joints of a model share and that no robot is built for, of followers what follows.
std::vector<double> generic_pose(const Model& model) {
  std::vector<double> amount(static_cast<std::size_t>(model.tree.shape.slots));
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    amount[static_cast<std::size_t>(i)] = 0.7 + 0.13 * static_cast<double>(i % 7) + 0.29 * static_cast<double>(i % 5);
  }
  for (const Mimic& mimic : model.mimics) {
    amount[static_cast<std::size_t>(mimic.follower_slot)] =
        mimic.multiplier * amount[static_cast<std::size_t>(mimic.leader_slot)] + mimic.offset;
  }
  return amount;
}

/// Twists of the parent in the body's frame.
Matrix6d to_child(const Model& model, Index slot, double amount) {
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

/// The articulated inertias of a tree whose tied joints are held.
class Articulated {
 public:
  explicit Articulated(const Model& model)
      : tree_(model.tree),
        bodies_(static_cast<std::size_t>(model.tree.shape.slots)),
        share_(bodies_.size(), 0.0),
        leader_(bodies_.size(), 0) {
    for (const Mimic& mimic : model.mimics) {
      const auto follower = static_cast<std::size_t>(mimic.follower_slot), leader = static_cast<std::size_t>(mimic.leader_slot);
      if (leader_[leader] == 0) leaders_.push_back(mimic.leader_slot);
      leader_[follower] = leader_[leader] = mimic.leader_slot;
      share_[follower] = mimic.multiplier;
      share_[leader] = 1;
    }
    const std::vector<double> pose = generic_pose(model);
    for (Index i = 1; i < tree_.shape.slots; ++i) {
      Body& body = at(i);
      body.S = motions_of(model, i);
      body.yielding = body.held = inertia_of(model, i);
      body.to_child = to_child(model, i, pose[static_cast<std::size_t>(i)]);
    }
  }

  /// Leaves to root. Returns the slot of a joint that is not tied and feels nothing, or 0.
  Index eliminate() {
    for (Index i = tree_.shape.slots - 1; i > 0; --i) {
      Body& body = at(i);
      Body& parent = at(tree_.parent(i));
      Matrix6d left = body.yielding;
      if (!is_tied(i)) {
        const Eigen::MatrixXd d = body.S.transpose() * body.yielding * body.S;
        if (!(least_eigenvalue(d) > kMovesNothingOfItsOwn * (body.S.transpose() * body.held * body.S).trace())) return i;
        body.gain = d.ldlt().solve(Eigen::MatrixXd(body.S.transpose() * body.yielding));
        left -= body.yielding * body.S * body.gain;
      }
      parent.yielding += body.to_child.transpose() * left * body.to_child;
      parent.held += body.to_child.transpose() * body.held * body.to_child;
    }
    return 0;
  }

  /// After eliminate: the leader of a coordinate that feels nothing while those before it yield, or 0.
  Index dependent_coordinate() {
    const auto count = static_cast<Eigen::Index>(leaders_.size());
    Eigen::MatrixXd T(count, count);
    for (Eigen::Index c = 0; c < count; ++c) T.col(c) = felt_while_moving(leaders_[static_cast<std::size_t>(c)]);
    for (Eigen::Index c = 0; c < count; ++c) {
      const Index leader = leaders_[static_cast<std::size_t>(c)];
      if (!(T(c, c) > kMovesNothingOfItsOwn * felt_one_by_one(leader))) return leader;
      const Eigen::Index rest = count - c - 1;
      const Eigen::VectorXd column = T.col(c).tail(rest) / T(c, c);
      T.bottomRightCorner(rest, rest) -= column * T.row(c).tail(rest);
    }
    return 0;
  }

 private:
  struct Body {
    EIGEN_MAKE_ALIGNED_OPERATOR_NEW
    Motions S;
    Matrix6d yielding = Matrix6d::Zero(), held = Matrix6d::Zero();  // inertia with all below: joints that are not tied yielding, all held
    Matrix6d to_child = Matrix6d::Zero();
    Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 6, 6> gain;  // d^-1 S^T A
    Vector6d impulse = Vector6d::Zero(), motion = Vector6d::Zero();
  };

  Body& at(Index i) { return bodies_[static_cast<std::size_t>(i)]; }
  bool is_tied(Index i) const { return leader_[static_cast<std::size_t>(i)] != 0; }
  bool moves(Index i, Index leader) const { return leader_[static_cast<std::size_t>(i)] == leader; }
  double share(Index i) const { return share_[static_cast<std::size_t>(i)]; }

  /// Impulses along all coordinates while one moves at the rate one, the other coordinates held and all else yielding.
  Eigen::VectorXd felt_while_moving(Index leader) {
    for (Body& body : bodies_) body.impulse.setZero();
    for (Index i = tree_.shape.slots - 1; i > 0; --i) {
      const Body& body = at(i);
      Vector6d passed = body.impulse;
      if (moves(i, leader)) passed += body.yielding * body.S * share(i);
      if (!is_tied(i)) {
        const Eigen::VectorXd felt = body.S.transpose() * body.impulse;
        for (Eigen::Index k = 0; k < felt.size(); ++k) passed -= felt[k] * body.gain.row(k).transpose();
      }
      at(tree_.parent(i)).impulse += body.to_child.transpose() * passed;
    }
    std::vector<double> felt(bodies_.size(), 0.0);  // by leader
    for (Index i = 1; i < tree_.shape.slots; ++i) {
      Body& body = at(i);
      body.motion = body.to_child * at(tree_.parent(i)).motion;
      if (is_tied(i)) {
        if (moves(i, leader)) body.motion += body.S * share(i);
        felt[static_cast<std::size_t>(leader_[static_cast<std::size_t>(i)])] +=
            share(i) * body.S.col(0).dot(body.yielding * body.motion + body.impulse);
      } else {
        const Eigen::MatrixXd d = body.S.transpose() * body.yielding * body.S;
        body.motion -= body.S * (body.gain * body.motion + d.ldlt().solve(Eigen::MatrixXd(body.S.transpose() * body.impulse)));
      }
    }
    Eigen::VectorXd result(leaders_.size());
    for (std::size_t c = 0; c < leaders_.size(); ++c) {
      result[static_cast<Eigen::Index>(c)] = felt[static_cast<std::size_t>(leaders_[c])];
    }
    return result;
  }

  /// Sum of what the joints of a coordinate feel each by itself, all others held.
  double felt_one_by_one(Index leader) {
    double sum = 0;
    for (Index i = 1; i < tree_.shape.slots; ++i) {
      if (moves(i, leader)) sum += share(i) * share(i) * at(i).S.col(0).dot(at(i).held * at(i).S.col(0));
    }
    return sum;
  }

  const Tree& tree_;
  std::vector<Body, Eigen::aligned_allocator<Body>> bodies_;
  std::vector<double> share_;   // Z: a of each joint that is tied, of a leader 1
  std::vector<Index> leader_;   // of each joint that is tied, of a leader itself, else 0
  std::vector<Index> leaders_;  // of each coordinate
};

}  // namespace

Index dependent_joint(const Model& model) {
  if (all_resist_by_themselves(model)) return 0;
  Articulated tree(model);
  const Index joint = tree.eliminate();
  return joint != 0 ? joint : tree.dependent_coordinate();
}

}  // namespace linden
