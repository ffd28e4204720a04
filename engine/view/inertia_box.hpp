// engine/view/inertia_box.hpp
// The box of even density that has the mass and inertia of a body.
//
//   I_1 = m (b^2 + c^2) / 12, ... about the principal axes through the centre of mass:   a^2 = 6 (I_2 + I_3 - I_1) / m
//
// An edge whose square comes out negative, as that of no solid does, is 0.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "layout/pose.hpp"

namespace linden {

struct InertiaBox {
  Pose pose;                      // centre of mass and principal axes, in the body's frame
  std::array<double, 3> edges{};  // [m]
};

/// inertia: m, m c, xx xy xz yy yz zz about the origin. Nothing where there is no mass, or all of it lies in a point.
std::optional<InertiaBox> inertia_box(std::span<const double, 10> inertia);

}  // namespace linden
