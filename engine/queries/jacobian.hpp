// engine/queries/jacobian.hpp
// Jacobians: how velocities of joints move a link or a point of it. Rows of a twist are angular (3), then linear (3).
//
// The column of a joint that leads others by <mimic> has theirs with it, and theirs are zero: J v is the twist for any v of the model.
#pragma once

#include "engine/queries/kinematics.hpp"
#include "engine/queries/matrix.hpp"

namespace linden {

/// 6 x nv: J v = link_twist(state, link, frame).
Matrix link_jacobian(const Kinematics& state, const LinkPlace& link, Frame frame = Frame::aligned);

/// 3 x nv: J v is the velocity of the point `at` of the link [m, in the link's frame], in the directions of the world.
Matrix point_jacobian(const Kinematics& state, const LinkPlace& link, const std::array<double, 3>& at = {});

/// 3 x nv: J v is the velocity of the centre of mass, world frame. cost  O(n).
Matrix centre_of_mass_jacobian(const Kinematics& state);

/// 6 x nv: A v is the momentum of the whole system, angular about the world's origin, then linear; world frame. cost  O(n).
Matrix momentum_matrix(const Kinematics& state);

}  // namespace linden
