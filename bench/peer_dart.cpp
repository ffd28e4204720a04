#include <fmt/format.h>

#include <dart/dynamics/BallJoint.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>
#include <stdexcept>

#include "bench/peer.hpp"

namespace linden {
namespace {

using dart::dynamics::BallJoint;
using dart::dynamics::BodyNode;
using dart::dynamics::FreeJoint;
using dart::dynamics::PrismaticJoint;
using dart::dynamics::RevoluteJoint;
using dart::dynamics::SkeletonPtr;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector6d;

/// Body frame at q = 0 in the parent's.
Isometry3d placement_of(const Model& model, Index slot) {
  const double* number = model.constants.tree_placement.row(slot);
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(number);
  pose.translation() = Eigen::Map<const Vector3d>(number + 9);
  return pose;
}

/// DART's is about the centre of mass.
dart::dynamics::Inertia inertia_of(const Model& model, Index slot) {
  const double* number = model.constants.inertia.row(slot);
  const double mass = number[0];
  const Vector3d center = Eigen::Map<const Vector3d>(number + 1) / mass;
  Matrix3d about_origin;
  about_origin << number[4], number[5], number[6],  //
      number[5], number[7], number[8],              //
      number[6], number[8], number[9];
  return {mass, center, about_origin - mass * (center.squaredNorm() * Matrix3d::Identity() - center * center.transpose())};
}

template <class Joint>
BodyNode* add(const SkeletonPtr& skeleton, BodyNode* parent, const Model& model, Index slot) {
  typename Joint::Properties joint;
  joint.mName = model.names.joint[static_cast<std::size_t>(slot)];
  joint.mT_ParentBodyToJoint = placement_of(model, slot);
  if constexpr (std::is_same_v<Joint, RevoluteJoint> || std::is_same_v<Joint, PrismaticJoint>) joint.mAxis = Vector3d::UnitZ();
  const BodyNode::AspectProperties body(model.names.body[static_cast<std::size_t>(slot)], inertia_of(model, slot));
  return skeleton->createJointAndBodyNodePair<Joint>(parent, joint, BodyNode::Properties(body)).second;
}

SkeletonPtr skeleton_of(const Robot& robot) {
  const Model& model = *robot.model;
  const SkeletonPtr skeleton = dart::dynamics::Skeleton::create(model.names.model);
  std::vector<BodyNode*> body(static_cast<std::size_t>(model.tree.shape.slots), nullptr);
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) {
    BodyNode* parent = body[static_cast<std::size_t>(model.tree.parent(slot))];
    BodyNode*& made = body[static_cast<std::size_t>(slot)];
    const double turn = model.constants.screw(slot, 0), shift = model.constants.screw(slot, 1);
    if (model.tree.kind(slot) == JointKind::free) {
      made = add<FreeJoint>(skeleton, parent, model, slot);
    } else if (model.tree.kind(slot) == JointKind::ball) {
      made = add<BallJoint>(skeleton, parent, model, slot);
    } else if (turn == 1 && shift == 0) {
      made = add<RevoluteJoint>(skeleton, parent, model, slot);
    } else if (turn == 0 && shift == 1) {
      made = add<PrismaticJoint>(skeleton, parent, model, slot);
    } else {
      throw std::runtime_error("DART is compared on hinges, slides, ball and free joints only");
    }
    for (const JointSpring& spring : robot.effects.springs) {
      if (spring.row != model.tree.first_v(slot)) continue;
      made->getParentJoint()->setSpringStiffness(0, spring.stiffness);
      made->getParentJoint()->setRestPosition(0, spring.rest);
    }
    for (const JointDamping& damper : robot.effects.damping) {
      if (damper.row == model.tree.first_v(slot)) made->getParentJoint()->setDampingCoefficient(0, damper.coefficient);
    }
  }
  return skeleton;
}

class DartPeer : public Peer {
 public:
  DartPeer(const Robot& robot, const Plan& plan) : model_(robot.model), springs_(robot.effects.springs), team_(plan.threads) {
    const SkeletonPtr skeleton = skeleton_of(robot);
    const auto world = dart::simulation::World::create();
    world->setTimeStep(plan.step);
    world->setGravity({0, 0, -plan.gravity});
    world->addSkeleton(skeleton);
    worlds_.push_back(world);
    while (static_cast<std::int64_t>(worlds_.size()) < plan.instances) worlds_.push_back(world->clone());
  }

  double mass() const override { return worlds_.front()->getSkeleton(0)->getMass(); }
  Index degrees_of_freedom() const override { return static_cast<Index>(worlds_.front()->getSkeleton(0)->getNumDofs()); }

  void reset(std::int64_t i, const InitialState& start) override {
    const SkeletonPtr skeleton = skeleton_at(i);
    for (Index slot = 1; slot < model_->tree.shape.slots; ++slot) {
      dart::dynamics::Joint* joint = joint_at(skeleton, slot);
      const double* q = &start.positions[first_q(slot)];
      const double* v = &start.velocities[static_cast<std::size_t>(model_->tree.first_v(slot))];
      if (model_->tree.kind(slot) == JointKind::free) {
        // positions: rotation vector, shift; velocities: angular, linear, in the body's frame
        Isometry3d pose = Isometry3d::Identity();
        pose.linear() = Eigen::Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix();
        pose.translation() = Eigen::Map<const Vector3d>(q);
        joint->setPositions(FreeJoint::convertToPositions(pose));
        joint->setVelocities(Eigen::Map<const Vector6d>(v));
      } else if (model_->tree.kind(slot) == JointKind::ball) {
        // rotation vector; angular velocity in the body's frame
        joint->setPositions(
            BallJoint::convertToPositions(Matrix3d(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix())));
        joint->setVelocities(Eigen::Map<const Vector3d>(v));
      } else {
        joint->setPosition(0, *q);
        joint->setVelocity(0, *v);
      }
    }
  }

  void step(int n) override {
    team_.share(worlds_.size(), [&](std::size_t i) {
      for (int k = 0; k < n; ++k) worlds_[i]->step();
    });
  }

  std::vector<double> positions(std::int64_t i) override {
    const SkeletonPtr skeleton = skeleton_at(i);
    std::vector<double> rows = model_->neutral();
    for (Index slot = 1; slot < model_->tree.shape.slots; ++slot) {
      const dart::dynamics::Joint* joint = joint_at(skeleton, slot);
      double* q = &rows[first_q(slot)];
      if (model_->tree.kind(slot) == JointKind::free) {
        const Isometry3d pose = FreeJoint::convertToTransform(joint->getPositions());
        Eigen::Map<Vector3d>(q, 3) = pose.translation();
        Eigen::Map<Eigen::Vector4d>(q + 3, 4) = Eigen::Quaterniond(pose.linear()).coeffs();
      } else if (model_->tree.kind(slot) == JointKind::ball) {
        Eigen::Map<Eigen::Vector4d>(q, 4) = Eigen::Quaterniond(BallJoint::convertToRotation(joint->getPositions())).coeffs();
      } else {
        *q = joint->getPosition(0);
      }
    }
    return rows;
  }

  Energy energy(std::int64_t i) override {
    // computePotentialEnergy takes the origins of bodies for their centres of mass
    const SkeletonPtr skeleton = skeleton_at(i);
    double potential = -skeleton->getMass() * skeleton->getGravity().dot(skeleton->getCOM());
    for (const JointSpring& spring : springs_) {
      for (Index slot = 1; slot < model_->tree.shape.slots; ++slot) {
        if (model_->tree.first_v(slot) != spring.row) continue;
        const double stretch = joint_at(skeleton, slot)->getPosition(0) - spring.rest;
        potential += 0.5 * spring.stiffness * stretch * stretch;
      }
    }
    return {.kinetic = skeleton->computeKineticEnergy(), .potential = potential};
  }

  std::optional<Momentum> momentum(std::int64_t i) override {
    Vector3d angular = Vector3d::Zero(), linear = Vector3d::Zero();
    for (const BodyNode* body : skeleton_at(i)->getBodyNodes()) {
      const Vector6d own = body->getSpatialInertia() * body->getSpatialVelocity();  // angular, linear, in the body's frame
      const Vector3d carried = body->getTransform().linear() * own.tail<3>();
      linear += carried;
      angular += body->getTransform().linear() * own.head<3>() + body->getTransform().translation().cross(carried);
    }
    return Momentum{{angular.x(), angular.y(), angular.z()}, {linear.x(), linear.y(), linear.z()}};
  }

 private:
  SkeletonPtr skeleton_at(std::int64_t i) const { return worlds_[static_cast<std::size_t>(i)]->getSkeleton(0); }
  /// Bodies were added slot by slot.
  static dart::dynamics::Joint* joint_at(const SkeletonPtr& skeleton, Index slot) {
    return skeleton->getJoint(static_cast<std::size_t>(slot - 1));
  }
  std::size_t first_q(Index slot) const { return static_cast<std::size_t>(model_->tree.first_q(slot)); }

  std::shared_ptr<const Model> model_;
  std::vector<JointSpring> springs_;
  Team team_;
  std::vector<dart::simulation::WorldPtr> worlds_;
};

}  // namespace

std::vector<Contender> dart_contenders() {
  return {{"dart", fmt::format("DART {}, semi-implicit Euler", DART_VERSION), true, true, 1e-7,
           [](const Robot& robot, const Plan& plan) { return std::make_unique<DartPeer>(robot, plan); }}};
}

}  // namespace linden
