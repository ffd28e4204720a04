// models/shapes/mesh_path.hpp
// Where the file of a mesh lies that a robot's file names.
//
//   name               tried in this order
//   package://P/rest   P/rest in the folder of the robot's file, then in each folder above it; in each folder of
//                      ROS_PACKAGE_PATH, which may be P itself; in share/ of each folder of AMENT_PREFIX_PATH
//   file://path        path
//   path               as it is where it is absolute, else from the folder of the robot's file
#pragma once

#include <optional>
#include <string>

namespace linden {

/// The mesh that `source`, the robot's file, calls `name`; nothing where no such file is.
std::optional<std::string> find_mesh(const std::string& name, const std::string& source);

}  // namespace linden
