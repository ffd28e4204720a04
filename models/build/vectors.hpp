// models/build/vectors.hpp
// Three numbers as a vector of Eigen, and back.
#pragma once

#include <Eigen/Core>
#include <array>

namespace linden {

inline Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
inline std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace linden
