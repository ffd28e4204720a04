// engine/queries/imu.hpp
// What an inertial measurement unit on a link reads.
//
//   gyroscope      w in the link's frame [rad/s]
//   accelerometer  R^T (a - g): specific force at the link's origin, in the link's frame [m/s^2]. At rest it is -g: 9.81 upward
#pragma once

#include "engine/queries/kinematics.hpp"

namespace linden {

struct ImuReading {
  std::array<double, 3> angular_velocity{};  // [rad/s]
  std::array<double, 3> specific_force{};    // [m/s^2]
};

ImuReading imu(const Kinematics& state, const LinkPlace& link);

}  // namespace linden
