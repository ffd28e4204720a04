// engine/queries/link_frames.hpp
// Links of a state as the kernels see them. For the code of questions alone.
#pragma once

#include "engine/queries/kinematics.hpp"
#include "kernels/queries/body_motion_down.hpp"
#include "kernels/queries/quaternion_of.hpp"

namespace linden {

inline std::array<double, 3> array_of(const Vec3<double>& a) { return {a.x, a.y, a.z}; }
inline Vec3<double> vec3_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
inline SpatialMotion motion_of(const Twist<double>& V) { return {array_of(V.w), array_of(V.v)}; }
inline SpatialForce force_of(const Wrench<double>& F) { return {array_of(F.n), array_of(F.f)}; }

inline Placement<double> placement_of(const Pose& pose) {
  return {Mat3<double>::from(pose.rotation.data()), Vec3<double>::from(pose.shift.data())};
}

/// The link's frame in the world's.
inline Placement<double> frame_of(const Kinematics& state, const LinkPlace& link) {
  const auto T = load<Placement, double>(state.bodies().pose, link.slot);
  const Placement<double> L = placement_of(link.in_body);
  return {T.R * L.R, T.p + T.R * L.p};
}

/// What a link's twist is seen from: placement in its body's frame. `pose` is the body's.
inline Placement<double> seen_frame(Frame frame, const Placement<double>& pose, const LinkPlace& link) {
  const Placement<double> L = placement_of(link.in_body);
  const Mat3<double> back = transpose(pose.R);
  switch (frame) {
    case Frame::aligned: return {back, L.p};
    case Frame::link: return L;
    case Frame::world: return {back, -(back * pose.p)};
  }
  return L;
}

}  // namespace linden
