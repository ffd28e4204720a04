// layout/effects/motion.hpp
// Values of kernels/effects/given_motion.hpp.
#pragma once

#include <vector>

#include "layout/effects/time_table.hpp"
#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// Moves a joint as given, along the smooth curve through the points (layout/smooth_curve.hpp), with whatever force that takes. It has
/// neither friction nor limits of its own.
struct JointMotion {
  Index row;
  TimeTable position;                  // [rad, m]; no two times are equal
  std::vector<double> velocities{};  // at those points [rad/s, m/s]; none: the curve's own, which never overshoots

  static constexpr EffectFacts facts{.name = "motion",
                                     .owners = "given motions",
                                     .site = Site::joint,
                                     .account = Account::given,
                                     .single = true,
                                     .sudden = "motion"};
};

}  // namespace linden
