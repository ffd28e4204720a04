// models/build/builder.hpp
// From links and joints, in any order, to flat arrays in topological order.
//
//   links and joints as people write them           what the builder makes of them
//   fixed joint                                     merged: exact inertia, both names still found
//   planar joint                                    two sliding screws and a turning one, massless bodies between
//   any axis                                        body frame turned so that the axis is z
//   mimic                                           linear map of one coordinate, which has to move a mass, not each of its joints
//   several roots                                   several trees in one system
//   collision shapes, visuals                       placed in the body's frame; those of links fixed to the world kept apart
//
// Inertias are checked for physical sense; near misses from rounding in real files warn. No recursion: depth is bounded by
// memory only (100,000-link chains are built in tests).
//
// Source of the inertia arithmetic: Featherstone, Rigid Body Dynamics Algorithms, 2.13 (spatial inertia, change of frame).
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "layout/model.hpp"
#include "layout/shapes.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/isometry.hpp"

namespace linden {

enum class JointType : std::uint8_t { fixed, revolute, prismatic, helical, ball, free, planar };

/// Mass, centre of mass and inertia about the centre of mass, in the link's frame.
struct LinkInertia {
  double mass = 0;                                               // [kg]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();              // [m]
  Eigen::Matrix3d about_center = Eigen::Matrix3d::Zero();        // [kg m^2]
};

LinkInertia box_inertia(double mass, const Eigen::Vector3d& size, const Eigen::Vector3d& center);
LinkInertia sphere_inertia(double mass, double radius, const Eigen::Vector3d& center);

/// The collision shape that goes with box_inertia.
LinkShape box_shape(const Eigen::Vector3d& size, const Eigen::Vector3d& center);

struct JointLimits {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double velocity = std::numeric_limits<double>::infinity();
  double effort = std::numeric_limits<double>::infinity();
};

/// One link and the joint that carries it.
struct LinkSpec {
  std::string name;
  std::string parent;  // name of the parent link; empty = the world
  std::string joint;
  JointType type = JointType::revolute;
  Isometry placement = Isometry::Identity();  // joint frame (= link frame at zero) in the parent link's frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // in the joint frame; normal of the plane for planar joints
  double pitch = 0;  // [m/rad], helical only
  LinkInertia inertia;
  std::vector<LinkShape> shapes;
  std::vector<LinkVisual> visuals;
  JointLimits limits;
  double damping = 0, friction = 0;
  std::string mimic;  // joint that this one follows; empty = none
  double multiplier = 1, offset = 0;
};

class TreeBuilder {
 public:
  explicit TreeBuilder(std::string model_name) : name_(std::move(model_name)) {}

  /// Where messages say the input came from, such as a file's name.
  TreeBuilder& source(std::string source);
  TreeBuilder& add(LinkSpec link);
  TreeBuilder& warn(std::string message);
  TreeBuilder& note(std::string message);
  TreeBuilder& visual_fault(std::string message);
  /// All joints may be fixed: a model without bodies, which is for merging with others (models/build/merged_models.hpp).
  TreeBuilder& may_stand_still();

  /// Throws InputError: unknown parent, a loop, names used twice, an inertia that no body has, a shape of negative size, a
  /// coordinate that moves no mass or none that others do not move in the same way, a mimic of a joint that does not exist or is no
  /// screw.
  Model build() const;

 private:
  std::string name_;
  std::string source_;
  std::vector<LinkSpec> links_;
  std::vector<std::string> warnings_, notes_, visual_faults_;
  bool may_stand_still_ = false;
};

}  // namespace linden
