// kernels/queries/quaternion_of.hpp
// The unit quaternion of a rotation, w >= 0.
//
// Of its four numbers the largest is found first, from the diagonal; the others follow by division by it, so that none loses digits however
// the rotation lies.
//
//   4 w^2 = 1 + xx + yy + zz,   4 x^2 = 1 + xx - yy - zz,   4 w x = zy - yz,   4 x y = xy + yx,   ...
//
// cost    one root and one division; branch-free
// source  Shepperd, Quaternion from rotation matrix (1978)
#pragma once

#include <cmath>

#include "kernels/values/spatial.hpp"

namespace linden {

template <class S>
LINDEN_INLINE Quaternion<S> quaternion_of(const Mat3<S>& R) {
  using std::max;
  using std::sqrt;
  const S one(1.0), half(0.5), zero(0.0);
  const S w2 = one + R.x.x + R.y.y + R.z.z, x2 = one + R.x.x - R.y.y - R.z.z;
  const S y2 = one - R.x.x + R.y.y - R.z.z, z2 = one - R.x.x - R.y.y + R.z.z;
  const S wx = R.z.y - R.y.z, wy = R.x.z - R.z.x, wz = R.y.x - R.x.y;
  const S xy = R.x.y + R.y.x, xz = R.x.z + R.z.x, yz = R.y.z + R.z.y;
  const S most = max(max(w2, x2), max(y2, z2));
  const auto by_w = w2 == most, by_x = x2 == most, by_y = y2 == most;
  const auto choose = [&](const S& w, const S& x, const S& y, const S& z) LINDEN_INLINE_LAMBDA {
    return select(by_w, w, select(by_x, x, select(by_y, y, z)));
  };
  // 4 (largest) (x, y, z, w)
  const Quaternion<S> q{{choose(wx, x2, xy, xz), choose(wy, xy, y2, yz), choose(wz, xz, yz, z2)}, choose(w2, wx, wy, wz)};
  const S scale = select(q.w < zero, -half, half) / sqrt(most);
  return {scale * q.v, scale * q.w};
}

}  // namespace linden
