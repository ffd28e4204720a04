// models/build/isometry.hpp
// Poses for those who compute with Eigen.
#pragma once

#include <Eigen/Geometry>

#include "layout/pose.hpp"

namespace linden {

/// Rotation and shift. Unaligned: Eigen's own alignment depends on the processor that a file is compiled for, and those who link against
/// linden may compile for another than linden did.
using Isometry = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

inline Isometry isometry(const Pose& pose) {
  Isometry result = Isometry::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result.linear()(row, column) = pose.rotation[static_cast<std::size_t>(3 * row + column)];
    result.translation()[row] = pose.shift[static_cast<std::size_t>(row)];
  }
  return result;
}

template <int Options>
Pose pose_of(const Eigen::Transform<double, 3, Eigen::Isometry, Options>& isometry) {
  Pose result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result.rotation[static_cast<std::size_t>(3 * row + column)] = isometry.linear()(row, column);
    result.shift[static_cast<std::size_t>(row)] = isometry.translation()[row];
  }
  return result;
}

}  // namespace linden
