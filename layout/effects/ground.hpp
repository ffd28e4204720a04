// layout/effects/ground.hpp
// Values of kernels/effects/ground.hpp.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "layout/contacts.hpp"
#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// Heights over the ground's plane on a grid, two triangles a cell: (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0). Beyond an edge of the map its
/// last row or column goes on for ever: the height is that of the nearest point of the map, and the ground's normal is that of these heights,
/// level across the edge; beyond a corner all is level.
struct HeightField {
  Index columns, rows;           // along x, along y of the plane; 2 or more each
  double spacing_x, spacing_y;   // [m]
  double origin_x, origin_y;     // of heights[0], in the plane's frame [m]
  std::vector<double> heights;   // [rows x columns], row by row [m]
};

struct Ground {
  std::array<double, 3> normal{0, 0, 1};  // unit length, world frame
  double height = 0;                      // of the plane along its normal [m]
  double stiffness = 1e5;                 // of one contact point [N/m]
  double damping = 0;                     // of one contact point along the normal [N s/m]
  double friction = 0.8;                  // Coulomb's coefficient
  std::optional<HeightField> terrain{};
  Contacts contacts{};

  static constexpr EffectFacts facts{.name = "ground",
                                     .owners = "points of a ground",
                                     .site = Site::body,
                                     .account = Account::taken,
                                     .stores = true,
                                     .has_states = true,
                                     .sudden = "ground"};
};

}  // namespace linden
