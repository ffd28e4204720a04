// tests/layout/robots.hpp
// Robots that the tests of the folder read: files at hand, and URDF text written on the spot.
#pragma once

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "layout/model.hpp"
#include "layout/support/input_error.hpp"
#include "models/urdf/urdf.hpp"

#ifndef LINDEN_ROBOTS_DIR
#define LINDEN_ROBOTS_DIR "../shared/robots"
#endif
#ifndef LINDEN_MODELS_DIR
#define LINDEN_MODELS_DIR "models"
#endif

namespace linden {

/// Every URDF file at hand: real robots and linden's own.
inline std::vector<std::string> robot_files() {
  std::vector<std::string> files;
  for (const char* folder : {LINDEN_ROBOTS_DIR, LINDEN_MODELS_DIR}) {
    if (!std::filesystem::is_directory(folder)) {
      WARN("no folder " << folder << ": its robots are not tested");
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".urdf") files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Path of a real robot's file; empty, with a warning, where it is absent.
inline std::string real_robot(const std::string& name) {
  const std::string file = std::string(LINDEN_ROBOTS_DIR) + "/" + name;
  if (std::filesystem::exists(file)) return file;
  WARN("no file " << file << ": not tested");
  return "";
}

/// Pose of a body at zero: tree placements multiplied up to the world.
inline Eigen::Matrix4d body_pose(const Model& model, Index slot) {
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  for (; slot != 0; slot = model.tree.parent(slot)) {
    Eigen::Matrix4d step = Eigen::Matrix4d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        step(row, column) = model.constants.tree_placement(slot, 3 * row + column);
      step(row, 3) = model.constants.tree_placement(slot, 9 + row);
    }
    pose = step * pose;
  }
  return pose;
}

inline std::string robot(const std::string& content) { return "<robot name=\"r\">" + content + "</robot>"; }

inline const std::string kInertial =
    "<inertial><mass value=\"2\"/><inertia ixx=\"3\" iyy=\"4\" izz=\"5\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";

inline std::string link(const std::string& name, const std::string& more = "") {
  return "<link name=\"" + name + "\">" + kInertial + more + "</link>";
}

inline std::string joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                         const std::string& more = "") {
  return fmt::format(R"(<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/>{}</joint>)", name, type,
                     parent, child, more);
}

/// What reading says: the warnings, or "error: " and the message.
inline std::vector<std::string> told_of(const std::string& xml) {
  try {
    return parse_urdf(xml, "test.urdf").warnings;
  } catch (const InputError& error) {
    return {fmt::format("error: {}", error.what())};
  }
}

}  // namespace linden
