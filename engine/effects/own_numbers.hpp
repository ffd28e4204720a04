// engine/effects/own_numbers.hpp
// Of numbers of effects that may be set from outside: what they are where nobody set them, and what their rows are called.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

/// Not a number where the servo's table says.
inline double own_target(const Servo& servo) {
  return servo.target_moves() ? std::numeric_limits<double>::quiet_NaN() : servo.target;
}

/// The joint of each entry, as velocities are called (Names::velocity).
template <class Entry>
std::vector<std::string> joints_of(const Model& model, const std::vector<Entry>& entries) {
  std::vector<std::string> names;
  for (const Entry& entry : entries) names.push_back(model.names.velocity[static_cast<std::size_t>(entry.row)]);
  return names;
}

}  // namespace linden
