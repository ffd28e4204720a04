#include "engine/effects/plane_frame.hpp"

#include <cmath>

#include "kernels/values/se3.hpp"

namespace linden {

std::array<std::array<double, 3>, 3> plane_frame(const std::array<double, 3>& normal) {
  const Vec3<double> z{normal[0], normal[1], normal[2]};
  // the plane's x lies in the world's x-z plane where that is possible
  const Vec3<double> helper = std::abs(z.x) < 0.9 ? Vec3<double>{1, 0, 0} : Vec3<double>{0, 1, 0};
  const Vec3<double> across = helper - dot(helper, z) * z;
  const Vec3<double> x = (1 / std::sqrt(dot(across, across))) * across;
  const Vec3<double> y = cross(z, x);
  return {{{x.x, x.y, x.z}, {y.x, y.y, y.z}, normal}};
}

}  // namespace linden
