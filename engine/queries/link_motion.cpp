#include "engine/queries/link_motion.hpp"

#include <algorithm>
#include <cmath>

#include "engine/queries/link_frames.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

Pose link_pose(const Kinematics& state, const LinkPlace& link) {
  const Placement<double> T = frame_of(state, link);
  Pose pose;
  T.R.to(pose.rotation.data());
  T.p.to(pose.shift.data());
  return pose;
}

SpatialMotion link_twist(const Kinematics& state, const LinkPlace& link, Frame frame) {
  const auto T = load<Placement, double>(state.bodies().pose, link.slot);
  return motion_of(to_child(seen_frame(frame, T, link), load<Twist, double>(state.bodies().twist, link.slot)));
}

SpatialMotion link_spatial_acceleration(const Kinematics& state, const LinkPlace& link, Frame frame) {
  const auto T = load<Placement, double>(state.bodies().pose, link.slot);
  return motion_of(to_child(seen_frame(frame, T, link), load<Twist, double>(state.bodies().acceleration, link.slot)));
}

SpatialMotion link_acceleration(const Kinematics& state, const LinkPlace& link, Frame frame) {
  if (frame == Frame::world) {
    throw InputError("the acceleration of a link was asked for in the frame \"world\"; expected \"aligned\" or \"link\"; its spatial "
                     "acceleration there says link_spatial_acceleration");
  }
  const SpatialMotion V = link_twist(state, link, frame);
  SpatialMotion A = link_spatial_acceleration(state, link, frame);
  A.linear = array_of(vec3_of(A.linear) + cross(vec3_of(V.angular), vec3_of(V.linear)));
  return A;
}

std::array<double, 7> position_and_quaternion(const Pose& pose) {
  const Quaternion<double> r = quaternion_of(Mat3<double>::from(pose.rotation.data()));
  return {pose.shift[0], pose.shift[1], pose.shift[2], r.v.x, r.v.y, r.v.z, r.w};
}

}  // namespace linden
