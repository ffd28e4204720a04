#include "engine/view/ground_mesh.hpp"

#include <algorithm>

#include "engine/effects/plane_frame.hpp"
#include "engine/view/corner_normals.hpp"
#include "engine/view/solid_meshes.hpp"

namespace linden {
namespace {

constexpr std::int64_t kMostGroundPoints = 250'000;

/// A line of the map: where it lies and which of the map's it has its heights from.
struct Line {
  double place;  // [m]
  Index of_map;
};

std::vector<Line> lines_of(Index count, double origin, double spacing, Index step, double reach) {
  std::vector<Line> lines{{origin - reach, 0}};
  for (Index k = 0; k < count - 1; k += step) lines.push_back({origin + k * spacing, k});
  lines.push_back({origin + (count - 1) * spacing, count - 1});
  lines.push_back({lines.back().place + reach, count - 1});
  return lines;
}

TriangleMesh terrain_mesh(const HeightField& field, Index step, double reach) {
  const std::vector<Line> columns = lines_of(field.columns, field.origin_x, field.spacing_x, step, reach);
  const std::vector<Line> rows = lines_of(field.rows, field.origin_y, field.spacing_y, step, reach);
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const Line& row : rows) {
    for (const Line& column : columns) {
      const std::int64_t at = std::int64_t{row.of_map} * field.columns + column.of_map;
      points.emplace_back(column.place, row.place, field.heights[static_cast<std::size_t>(at)]);
    }
  }
  const auto across = static_cast<std::uint32_t>(columns.size());
  for (std::uint32_t j = 0; j + 1 < rows.size(); ++j) {
    for (std::uint32_t i = 0; i + 1 < across; ++i) {
      const std::uint32_t here = j * across + i;
      triangles.push_back({here, here + 1, here + across});
      triangles.push_back({here + across + 1, here + across, here + 1});
    }
  }
  return mesh_of(shaded(points, triangles));
}

}  // namespace

GroundMesh ground_mesh(const Ground& ground, double reach) {
  GroundMesh result;
  const std::array<std::array<double, 3>, 3> axes = plane_frame(ground.normal);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) result.pose.rotation[3 * row + column] = axes[column][row];
    result.pose.shift[row] = ground.height * ground.normal[row];
  }
  if (!ground.terrain) {
    result.mesh = unit_square();
    for (float& coordinate : result.mesh.positions) coordinate *= static_cast<float>(2 * reach);
    return result;
  }
  const HeightField& field = *ground.terrain;
  while ((std::int64_t{field.columns} / result.step) * (field.rows / result.step) > kMostGroundPoints) result.step += 1;
  result.mesh = terrain_mesh(field, result.step, reach);
  return result;
}

}  // namespace linden
