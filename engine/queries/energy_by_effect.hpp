// engine/queries/energy_by_effect.hpp
// Where the energy of a simulation is and where it went, effect by effect.
#pragma once

#include <string>
#include <vector>

#include "engine/simulation.hpp"

namespace linden {

struct EnergyShare {
  std::string name;   // kinetic, gravity, springs, ground; damping_taken, servo_given, ...
  double energy = 0;  // [J]
};

/// Energies that there are in the scene, and what each of its effects took or gave since the start, in this order. The sum of the first
/// kind, plus what was taken, less what was given, stays.
std::vector<EnergyShare> energy_by_effect(Simulation& simulation);

}  // namespace linden
