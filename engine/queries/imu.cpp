#include "engine/queries/imu.hpp"

#include "engine/queries/link_frames.hpp"
#include "engine/queries/link_motion.hpp"

namespace linden {

ImuReading imu(const Kinematics& state, const LinkPlace& link) {
  const Vec3<double> g = transpose_times(frame_of(state, link).R, vec3_of(state.gravity()));
  const SpatialMotion a = link_acceleration(state, link, Frame::link);
  return {link_twist(state, link, Frame::link).angular, array_of(vec3_of(a.linear) - g)};
}

}  // namespace linden
