// models/urdf/urdf_loops.hpp
// What URDF files say of closed loops: a tree, and joints and springs between links that it does not know of. URDF itself has no word for them;
// these are what programs write.
//
//   <loop_joint name type>                          two ends, each with its own frame in its link; <axis xyz>, 1 0 0 where it is not given
//     <link1 link xyz rpy/> <link2 link xyz rpy/>     Isaac Sim, of type spherical (its documentation writes <link1> twice, read as well), and
//                                                     Drake until 2018, where it was a hinge of any type: no type is a hinge
//     <parent link/> <child link/>
//       <parent_origin xyz/> <child_origin xyz/>      exporters of CAD programs, with <axis frame="parent">; what turns is as it lies at zero
//       <origin xyz rpy/>                             the joint in the parent's frame, as in a <joint>, where both ends meet at zero
//     <limit lower upper effort velocity/> <dynamics damping friction/>    of all of these, as in a <joint>
//   <loop name type>                                URDF+ (Chignoli et al., arXiv 2411.19753)
//     <predecessor link> <origin/>, <successor link> <origin/>; or <predecessor_origin/>, <successor_origin/> beside them
//   <drake:ball_constraint>                         Drake, MultibodyPlant::AddBallConstraint
//     <drake:ball_constraint_body_A name/>, _body_B; <drake:ball_constraint_p_AP value="x y z"/>, _p_BQ
//   <drake:linear_spring_damper>                    Drake, a spring and damper between two points; likewise, and
//     <drake:linear_spring_damper_free_length value/>, _stiffness, _damping
//   <drake:linear_bushing_rpy>                      Drake, LinearBushingRollPitchYaw, a bushing between two frames (kernels/couplings/gap_map.hpp)
//     <drake:bushing_frameA name/>, _frameC           each a <frame name link xyz rpy> of the robot, or a link
//     <drake:bushing_torque_stiffness value="x y z"/>, _torque_damping, _force_stiffness, _force_damping    what is 0 0 0 may be left out
//   Drake's forces, and where _force_ numbers are alike its torques, are those of the bushing here. Where they differ, its damper takes the frame
//   half-way to turn by half of what the link does, which it does not after a turn by theta: torques are tan(theta/4)/2 |d x f| apart at most.
//   <gazebo> <joint name type>                      Gazebo: a joint of SDFormat inside <gazebo>
//     <parent>, <child>, <pose relative_to> in the child's frame where nothing else is said, <axis> <xyz expressed_in> <limit> <dynamics>, <axis2>;
//     both ends meet where all coordinates are zero
//
// Types: revolute, continuous, hinge; prismatic, slider; spherical, ball; fixed, weld; universal; cylindrical. Each loop becomes a coupling.
// With a frame for each end a loop may be open at zero: it is closed by the start, see engine/assembly.hpp. One that turns or slides and has limits,
// damping or friction gets a coordinate of its own (models/build/closing_joint.hpp), so that a scene can ask for them as it does of any joint.
// What is not understood is told as a warning and left out.
//
// source  robots and programs as above; http://sdformat.org/spec for joints; RigidBodyLoop of Drake 1.0 for its axis, equal in both frames
#pragma once

#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "models/build/coupled_model.hpp"
#include "models/urdf/urdf_structure.hpp"

namespace linden {

/// A frame in a link; without a name in the world, where the root's frame lies at zero.
struct UrdfFrame {
  std::string link;
  Isometry pose = Isometry::Identity();
};

struct UrdfLoop {
  std::string owner;  // in messages: <loop_joint> "ankle"
  int line = 0;
  std::string name;
  CouplingKind kind = CouplingKind::hinge;
  std::string link_a, link_b;
  std::optional<UrdfFrame> meeting{};           // of both ends, as they lie at zero; else
  Isometry in_a = Isometry::Identity(), in_b = Isometry::Identity();
  bool turned_as_at_zero = false;               // in_b says where the end is, not how it is turned
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX(), second_axis = Eigen::Vector3d::UnitY();  // of length 1; the second of a universal joint
  std::optional<std::string> axis_in{};         // a link in whose frame they are given, empty: the world; else in the joint's
  double length = 0;                            // of a spring [m]
  Springs shift{}, turn{};                      // of a spring and a bushing
  std::optional<ClosingJoint> joint{};          // with limits, damping or friction
};

/// False for a ball, a weld, a rod and a bushing.
inline bool has_axis(CouplingKind kind) {
  return kind != CouplingKind::ball && kind != CouplingKind::weld && kind != CouplingKind::rod && kind != CouplingKind::bushing;
}

/// All loops of the file that are understood, in its order; names that are there already are lengthened. What is not is a warning.
std::vector<UrdfLoop> loops_of(const UrdfStructure& robot, UrdfReport& report);

/// True for a <gazebo> that holds nothing but joints.
bool holds_joints_only(const tinyxml2::XMLElement& gazebo);
/// Each <frame> that a bushing of a robot names.
std::unordered_set<const tinyxml2::XMLElement*> frames_of_bushings(const tinyxml2::XMLElement& robot);

/// The model with these loops as couplings, but for those between two parts of one body, which are warnings.
Model with_loops(Model model, const std::vector<UrdfLoop>& loops, const std::string& source_name);

}  // namespace linden
