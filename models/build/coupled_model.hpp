// models/build/coupled_model.hpp
// Couplings between links by name, as people write them, and the model that has them.
//
//   Model legs = coupled(load_urdf("leg.urdf"), {{.kind = CouplingKind::hinge, .link_a = "rocker", .link_b = "shank",
//                                                 .at = PointAndAxis{{1, 0, 0}, {0, 1, 0}}}});
//
// Where both frames are not given they come from one point and one axis in the world while all coordinates are zero: that is how a mechanism
// is drawn. z of both frames is the axis; of a universal joint x of A is the axis and y of B the second one; those of a bushing without an
// axis are parallel to the world's.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "layout/model.hpp"
#include "models/build/cable.hpp"
#include "models/build/closing_joint.hpp"
#include "models/build/isometry.hpp"

namespace linden {

/// In the world while all coordinates are zero.
struct PointAndAxis {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();        // [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d second_axis = Eigen::Vector3d::Zero();  // of a universal joint; of others, where it is not zero, y of both frames is nearest to it
};

/// Springs and dampers in the place of rows, along or about the three axes of the first frame: one number for all of them, or three.
struct Springs {
  Compliances along{};

  Springs() = default;
  Springs(double stiffness, double damping) : along{Compliance{stiffness, damping}, {stiffness, damping}, {stiffness, damping}} {}
  Springs(const std::array<double, 3>& stiffness, const std::array<double, 3>& damping)
      : along{Compliance{stiffness[0], damping[0]}, {stiffness[1], damping[1]}, {stiffness[2], damping[2]}} {}
  bool gives_way() const { return any_gives_way(along); }
};

/// Ratio of a screw joint's coordinate in a gear.
struct GearJoint {
  std::string joint;
  double ratio = 1;
};

struct CouplingSpec {
  std::string name;  // empty: "hinge of rocker and shank"
  CouplingKind kind = CouplingKind::ball;
  std::string link_a, link_b;            // "world", or empty: the world
  std::optional<PointAndAxis> at{};      // else both frames
  Isometry frame_a = Isometry::Identity(), frame_b = Isometry::Identity();  // in the links' frames; of a rod only their origins count
  double length = 0;                     // of a rod [m]; 0: as far apart as both points are while all coordinates are zero
  std::vector<GearJoint> joints{};       // of a gear: sum of ratio q + offset = 0
  double offset = 0;
  std::vector<CablePlace> through{};     // points of a cable, from end to end
  Springs shift{}, turn{};               // of rows in m, and of those of directions, angles and gears; without, rows are rigid, of a bushing free
  std::optional<ClosingJoint> joint{};   // of a hinge or slider: it gets a coordinate; of a cable its length, called as the cable where it is not given
};

/// The model with these couplings beside those that it has. Throws InputError for a link or joint that there is not, a coupling of a body with
/// itself or of the world with itself, an axis of no length, two couplings of one name, a gear of joints that do not slide or turn, a bushing
/// without a spring or damper, springs where nothing can give way, and what with_closing_joint and with_cable_length do.
Model coupled(Model model, const std::vector<CouplingSpec>& couplings);

/// Poses of all bodies in the world while all coordinates are zero, by slot; joints that follow others are where they follow them to.
std::vector<Isometry> neutral_poses(const Model& model);

}  // namespace linden
