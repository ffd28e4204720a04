// layout/height_field.hpp
// Heights on a grid: of the terrain of a ground, and of a shape that stands in the world.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "layout/field.hpp"

namespace linden {

/// Heights over a plane on a grid, two triangles a cell: (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0). Beyond an edge of the map its
/// last row or column goes on for ever: the height is that of the nearest point of the map, and the normal is that of these heights,
/// level across the edge; beyond a corner all is level.
struct HeightField {
  Index columns, rows;           // along x, along y of the plane; 2 or more each
  double spacing_x, spacing_y;   // [m]
  double origin_x, origin_y;     // of heights[0], in the plane's frame [m]
  std::vector<double> heights;   // [rows x columns], row by row [m]
};

/// Whether it is as its members say, of finite numbers.
inline bool is_whole(const HeightField& field) {
  if (field.columns < 2 || field.rows < 2 || !(field.spacing_x > 0) || !(field.spacing_y > 0)) return false;
  if (field.heights.size() != static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows)) return false;
  bool whole = std::isfinite(field.spacing_x) && std::isfinite(field.spacing_y) && std::isfinite(field.origin_x) && std::isfinite(field.origin_y);
  for (const double height : field.heights) whole = whole && std::isfinite(height);
  return whole;
}

}  // namespace linden
