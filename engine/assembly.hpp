// engine/assembly.hpp
// How far a mechanism had to be moved so that its couplings are closed, or what is left open.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

/// Of the coupling that is farthest open.
struct Assembly {
  std::string coupling;
  double gap = 0;       // its largest [m, or cosine of an angle]
  double relative = 0;  // over the size of its mechanism
  bool closed = true;   // all are, but for rounding
};

/// A start that is farther open than this share of its mechanism's size is not closed by itself.
inline constexpr double kOpenStart = 1e-3;

enum class Assembled : std::uint8_t { if_nearly_closed, from_anywhere };

/// Moves positions [nq] to where the couplings of the model are closed, as near as the mass matrix measures, or least open.
/// Joints whose motion is given stay where it begins.
Assembly assemble(const Model& model, std::vector<double>& positions, Assembled how, const std::vector<JointMotion>& motions = {});

/// Throws InputError where a coupling is open, as a start of steps must not be.
void require_closed(const Assembly& start);

}  // namespace linden
