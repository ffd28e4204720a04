// tests/engine/linkage_humanoid.hpp
// The project's humanoid, its elbows, knees and ankles driven as those of many real ones are: by a crank farther up the limb and a rod.
//
//        o--- crank          the limb above the joint, its ground, 0.2 m
//        |    |rod
//        o----+              the limb below it, whose lever is the rocker
//
// Six four-bars in planes at right angles to the joints' axes: two bodies and a hinge of five rows each, and as much freedom as without. The lever
// is the shortest of the four, and it and the longest are shorter than the other two together (Grashof's rule): the joint may turn all around,
// and the four are never in one line.
#pragma once

#include <fmt/format.h>

#include <string>

#include "layout/support/text_file.hpp"
#include "models/urdf/urdf.hpp"

namespace linden {

inline constexpr int kLinkages = 6;

inline Model linkage_humanoid(Base base) {
  struct DrivenJoint {
    const char *name, *above, *below;
    double x, y, z;  // of the joint in the link above it [m]
  };
  constexpr DrivenJoint driven[] = {{"elbow", "upper_arm", "forearm", 0, 0.01, -0.3255}, {"knee", "thigh", "shank", 0, 0, -0.429},
                                    {"ankle", "shank", "ankle_pitch_link", -0.02, 0, -0.43}};
  constexpr double ground = 0.2, crank = 0.06, lever = 0.05;  // [m]
  const std::string file = std::string(LINDEN_MODELS_DIR) + "/humanoid.urdf";
  std::string urdf = read_text(file, "URDF file");
  std::string linkages;
  for (const char* side : {"left", "right"}) {
    for (const DrivenJoint& joint : driven) {
      const std::string name = fmt::format("{}_{}", side, joint.name);
      const double y = side == std::string("left") ? joint.y : -joint.y;
      linkages += fmt::format(R"(
  <link name="{0}_crank">
    <inertial><origin xyz="{1} 0 0"/><mass value="0.1"/><inertia ixx="5e-6" iyy="3.2e-5" izz="3.2e-5" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="{0}_crank_joint" type="continuous">
    <parent link="{2}"/><child link="{0}_crank"/><origin xyz="{3} {4} {5}"/><axis xyz="0 1 0"/>
  </joint>)",
                              name, -crank / 2, fmt::format("{}_{}", side, joint.above), joint.x, y, joint.z + ground);
      linkages += fmt::format(R"(
  <link name="{0}_rod">
    <inertial><origin xyz="{1} 0 {2}"/><mass value="0.1"/><inertia ixx="3.4e-4" iyy="3.4e-4" izz="5e-6" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="{0}_rod_joint" type="continuous">
    <parent link="{0}_crank"/><child link="{0}_rod"/><origin xyz="{3} 0 0"/><axis xyz="0 1 0"/>
  </joint>
  <loop_joint name="{0}_rod_end" type="revolute">
    <link1 link="{0}_rod" xyz="{4} 0 {5}"/><link2 link="{6}" xyz="{7} 0 0"/><axis xyz="0 1 0"/>
  </loop_joint>)",
                              name, (crank - lever) / 2, -ground / 2, -crank, crank - lever, -ground,
                              fmt::format("{}_{}", side, joint.below), -lever);
    }
  }
  urdf.insert(urdf.rfind("</robot>"), linkages + "\n");
  return parse_urdf(urdf, "humanoid.urdf with linkages", base);
}

}  // namespace linden
