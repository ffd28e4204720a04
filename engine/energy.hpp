// engine/energy.hpp
// What a whole system has of the two quantities that a step keeps.
#pragma once

#include <array>

namespace linden {

struct Energy {
  double kinetic = 0;    // 1/2 p.M^-1 p [J]
  double potential = 0;  // of gravity (zero where the centre of mass is at the height of the world's origin), springs, ground and contact [J]
  double springs = 0, ground = 0, contact = 0;  // their shares of it
  double total() const { return kinetic + potential; }
  double gravity() const { return potential - springs - ground - contact; }
};

/// Of the whole system, about the world's origin and in the world's frame.
struct Momentum {
  std::array<double, 3> angular{};  // [kg m^2/s]
  std::array<double, 3> linear{};   // [kg m/s]
};

}  // namespace linden
