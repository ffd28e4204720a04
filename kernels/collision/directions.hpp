// kernels/collision/directions.hpp
// Lengths of three-vectors, and directions at right angles.
#pragma once

#include <cmath>

#include "kernels/values/spatial.hpp"

namespace linden {

inline double length_of(const Vec3<double>& a) { return std::sqrt(dot(a, a)); }

/// Two directions at right angles with n, of unit length, and each other.
inline void directions_across(const Vec3<double>& n, Vec3<double>& s, Vec3<double>& t) {
  const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  const Vec3<double> least = x <= y && x <= z ? Vec3<double>{1, 0, 0} : y <= z ? Vec3<double>{0, 1, 0} : Vec3<double>{0, 0, 1};
  s = cross(n, least);
  s = s / length_of(s);
  t = cross(n, s);
}

}  // namespace linden
