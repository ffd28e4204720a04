// tests/engine/solids.hpp
// Three solids to be dropped, slid and rolled on what stands in the world.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <string>

#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "tests/engine/folder.hpp"

namespace linden::solids_test {

inline constexpr double kGravity = 9.81;

/// A ball, a block and a can of 0.2 m and 1 kg.
class Solids : public Folder {
 public:
  Solids() {
    solid("ball", R"(<sphere radius="0.1"/>)", 0.004);
    solid("block", R"(<box size="0.2 0.2 0.2"/>)", 0.04 / 6);
    solid("can", R"(<cylinder radius="0.1" length="0.2"/>)", 0.04 / 6);
  }
  /// Begins as it is written, deep in the world too.
  Scene scene(const std::string& world, const std::string& models, double friction, double step) const {
    Scene scene = parse_scene(fmt::format("models:\n{}world:\n{}effects: {{gravity: [0, 0, {}], contact: {{friction: {}}}}}\n", models, world, -kGravity, friction),
                              file("scene.yaml"));
    scene.options.step = step;
    scene.start_as_given = true;
    return scene;
  }

 private:
  void solid(const std::string& name, const std::string& shape, double inertia) const {
    write(name + ".urdf", fmt::format(R"(<robot name="{0}"><link name="{0}"><inertial><mass value="1"/><inertia ixx="{1}" iyy="{1}" izz="{1}" )"
                                      R"(ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>{2}</geometry></collision></link></robot>)",
                                      name, inertia, shape));
  }
};

inline std::string body(const std::string& model, const Eigen::Vector3d& at, const std::string& more = "") {
  return fmt::format("  - {{model: {0}.urdf, name: {0}, base: floating, position: [{1:.17g}, {2:.17g}, {3:.17g}]{4}}}\n", model, at.x(), at.y(), at.z(), more);
}

inline Eigen::Vector3d place(const Simulation& simulation, std::size_t k = 0) { return Eigen::Vector3d(&simulation.positions()[7 * k]); }

inline int steps_of(double time, double step) { return static_cast<int>(std::lround(time / step)); }

}  // namespace linden::solids_test
