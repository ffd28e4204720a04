// layout/effects/drag.hpp
// Values of kernels/effects/drag.hpp.
#pragma once

#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// -(linear + quadratic |v|) v at the centre of mass, v relative to the wind.
struct Drag {
  Index slot;
  double linear = 0;     // [N s/m]
  double quadratic = 0;  // [N s^2/m^2]

  static constexpr EffectFacts facts{.name = "drag", .owners = "drag", .site = Site::body, .account = Account::taken};
};

}  // namespace linden
