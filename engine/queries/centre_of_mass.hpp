// engine/queries/centre_of_mass.hpp
// Of the whole system, what moves of it: links that are fixed to the world are not counted.
#pragma once

#include "engine/energy.hpp"
#include "engine/queries/kinematics.hpp"

namespace linden {

struct CentreOfMass {
  double mass = 0;                   // [kg]
  std::array<double, 3> position{};  // world frame [m]
  std::array<double, 3> velocity{};  // [m/s]
};

/// Zero where nothing has mass.
CentreOfMass centre_of_mass(const Kinematics& state);

/// Angular momentum about the world's origin and linear momentum, world frame: what Simulation::momentum says of its state, but for the
/// momenta of armature, which belong to no body.
Momentum total_momentum(const Kinematics& state);

/// The same about the centre of mass.
Momentum centroidal_momentum(const Kinematics& state);

}  // namespace linden
