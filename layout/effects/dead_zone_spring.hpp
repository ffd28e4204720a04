// layout/effects/dead_zone_spring.hpp
// Values of kernels/effects/dead_zone_spring.hpp.
#pragma once

#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// A spring with play: nothing while the joint is within half_width of rest, and beyond it a spring that is relaxed at the zone's edge, and a
/// damper, which together only push back towards the zone.
struct DeadZoneSpring {
  Index row;
  double stiffness;    // [N m/rad, N/m]
  double half_width;   // [rad, m]
  double rest = 0;     // middle of the zone [rad, m]
  double damping = 0;  // beyond the zone [N m s/rad, N s/m]

  bool one_way() const { return damping > 0; }
  bool jumps() const { return damping > 0; }

  static constexpr EffectFacts facts{.name = "dead_zone_spring",
                                     .owners = "springs with a dead zone",
                                     .site = Site::joint,
                                     .account = Account::taken,
                                     .stores = true,
                                     .has_states = true,
                                     .sudden = "damping beyond a dead zone"};
  static constexpr NumberField<DeadZoneSpring> fields[] = {
      {"stiffness", &DeadZoneSpring::stiffness, kStiffnessUnits, Allowed::not_negative},
      {"half_width", &DeadZoneSpring::half_width, kPositionUnits, Allowed::not_negative},
      {"rest", &DeadZoneSpring::rest, kPositionUnits, Allowed::finite, Given::perhaps},
      {"damping", &DeadZoneSpring::damping, kDampingUnits, Allowed::not_negative, Given::perhaps}};
};

}  // namespace linden
