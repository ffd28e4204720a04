// engine/mass_distribution.hpp
// Where the mass of a whole system is.
#pragma once

#include <array>
#include <span>

#include "layout/model.hpp"

namespace linden {

struct MassDistribution {
  double mass = 0;                 // [kg]
  std::array<double, 3> center{};  // of mass, in the world's frame [m]
  double polar_moment = 0;         // integral of r^2 dm about the world's origin [kg m^2]
};

/// At positions q [nq].
MassDistribution mass_distribution(const Model& model, std::span<const double> q);

}  // namespace linden
