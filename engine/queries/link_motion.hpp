// engine/queries/link_motion.hpp
// Where a link is, how it moves and how it accelerates. Any link of the robot's file, by place_of(model, name) (layout/effects.hpp): one
// that was merged into another body while reading has kept its place in it.
#pragma once

#include "engine/queries/kinematics.hpp"

namespace linden {

/// Of the link's frame in the world's.
Pose link_pose(const Kinematics& state, const LinkPlace& link);

/// Angular and linear velocity: of the link's origin in the directions of the world, unless another frame is asked for.
SpatialMotion link_twist(const Kinematics& state, const LinkPlace& link, Frame frame = Frame::aligned);

/// Angular acceleration, and that of the link's origin: the second derivative of its position, in the directions of the world (aligned) or
/// of the link. Frame::world is refused with InputError: there is no place of the link there to follow.
SpatialMotion link_acceleration(const Kinematics& state, const LinkPlace& link, Frame frame = Frame::aligned);

/// Spatial acceleration: the derivative of the twist as that frame sees it while it stands still. Of the link's origin it is less than the
/// acceleration by w x v.
SpatialMotion link_spatial_acceleration(const Kinematics& state, const LinkPlace& link, Frame frame = Frame::aligned);

/// Of a pose: position x y z [m] and unit quaternion x y z w, as in the q of a free joint; w is not negative.
std::array<double, 7> position_and_quaternion(const Pose& pose);

}  // namespace linden
