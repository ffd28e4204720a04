// layout/effects/dead_zone_spring.hpp
// Values of kernels/effects/dead_zone_spring.hpp.
#pragma once

#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// A spring with play: nothing while the joint is within half_width of rest, and beyond it a spring that is relaxed at the zone's edge.
struct DeadZoneSpring {
  Index row;
  double stiffness;   // [N m/rad, N/m]
  double half_width;  // [rad, m]
  double rest = 0;    // middle of the zone [rad, m]

  static constexpr EffectFacts facts{
      .name = "dead_zone_spring", .owners = "springs with a dead zone", .site = Site::joint, .stores = true, .has_states = true};
  static constexpr NumberField<DeadZoneSpring> fields[] = {
      {"stiffness", &DeadZoneSpring::stiffness, kStiffnessUnits, Allowed::not_negative},
      {"half_width", &DeadZoneSpring::half_width, kPositionUnits, Allowed::not_negative},
      {"rest", &DeadZoneSpring::rest, kPositionUnits, Allowed::finite, Given::perhaps}};
};

}  // namespace linden
