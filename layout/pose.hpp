// layout/pose.hpp
// Where one frame lies in another: x_there = R x_here + p. A plain value; those who work with Eigen convert it (models/build/isometry.hpp).
#pragma once

#include <array>
#include <cstddef>

namespace linden {

struct Pose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  // R, row by row
  std::array<double, 3> shift{};                              // p [m]
  bool operator==(const Pose&) const = default;
};

/// R^T v: a direction from there, in this frame.
inline std::array<double, 3> turned_back(const Pose& pose, const std::array<double, 3>& v) {
  const std::array<double, 9>& R = pose.rotation;
  std::array<double, 3> result{};
  for (std::size_t k = 0; k < 3; ++k) result[k] = R[k] * v[0] + (R[3 + k] * v[1] + R[6 + k] * v[2]);
  return result;
}

}  // namespace linden
