// kernels/queries/ground_push_map.hpp
// What the law of the ground (kernels/effects/ground.hpp) gives a body normal to it, in a state: where the body is and as fast as it is.
//
//   N = sum over points in the ground of max(0, k depth - c n.(v + w x (c + o)))        k, c times the weight of the point on a terrain
//
// Over a step in which a point stays in the ground the mean of the spring's force is the mean of this at both ends.
//
// reads   points as find_ground leaves them; V of the body, body frame
// returns how many points are in the ground, and N [N]
#pragma once

#include "kernels/effects/ground.hpp"

namespace linden {

template <class S>
struct GroundPush {
  S points, force;
};

template <class S>
GroundPush<S> ground_push_map(const GroundPlan& plan, Index slot, const Twist<S>& V, const GroundPoints<S>& points) {
  using std::max;
  const S zero(0.0), one(1.0), stiffness = as<S>(plan.ground.stiffness), damping = as<S>(plan.ground.damping);
  GroundPush<S> sum{zero, zero};
  for (Index k = 0; k < points.gap.rows(); ++k) {
    if (plan.points[static_cast<std::size_t>(k)].slot != slot) continue;
    const auto place = load<Vec3, S>(points.center, k) + load<Vec3, S>(points.arm, k);
    const S rise = dot(load<Vec3, S>(points.normal, k), V.v + cross(V.w, place));
    const auto inside = points.gap(k) < zero;
    const S push = max(zero, -stiffness * points.gap(k) - damping * rise);
    const S weight = plan.ground.terrain ? points.weight(k) : one;
    sum.points = sum.points + select(inside, one, zero);
    sum.force = sum.force + select(inside, weight * push, zero);
  }
  return sum;
}

}  // namespace linden
