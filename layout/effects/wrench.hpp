// layout/effects/wrench.hpp
// Values of kernels/effects/wrench.hpp.
#pragma once

#include <array>
#include <limits>

#include "layout/effects/time_table.hpp"
#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// A wrench on a body.
struct BodyWrench {
  Index slot;
  std::array<double, 3> point{};   // where the force acts, body frame [m]
  std::array<double, 3> force{};   // [N]
  std::array<double, 3> moment{};  // [N m]
  bool in_world = true;            // directions of force and moment: the world's, or the body's
  double from = -std::numeric_limits<double>::infinity();  // [s]
  double to = std::numeric_limits<double>::infinity();
  TimeTable scale{{0}, {1}};          // force and moment over time, as shares of the above
  double share_at(double time) const;
  /// Mean of what acts over [begin, end], exactly; ends are as those of TimeTable::mean.
  double mean_share(double begin, double end) const;

  static constexpr EffectFacts facts{.name = "wrench", .owners = "wrenches", .site = Site::body, .account = Account::given};
};

}  // namespace linden
