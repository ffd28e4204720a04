#include "models/shapes/convex_hull.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "models/build/random.hpp"
#include "models/build/vectors.hpp"

namespace linden::convex_hull_test {
namespace {

using Eigen::Vector3d;

/// Euler's formula, loops that run anticlockwise in the planes of their faces with no point beyond, neighbours and faces of points as the loops say.
void check_sound(const ConvexHull& hull, const std::vector<Vector3d>& points) {
  double size = 0;
  for (const Vector3d& p : points) size = std::max(size, p.norm());
  std::set<std::pair<std::uint32_t, std::uint32_t>> sides, neighbours;
  std::set<std::pair<std::uint32_t, std::uint32_t>> corners, faces_of_points;
  for (std::uint32_t f = 0; f < hull.faces.size(); ++f) {
    const auto& face = hull.faces[f];
    const Vector3d normal = vector_of(face.normal), first = vector_of(hull.points[hull.corners[face.first]]);
    CHECK(std::abs(normal.norm() - 1) < 1e-14);
    for (const Vector3d& p : points) CHECK(normal.dot(p - first) < 1e-13 * size);
    for (std::uint32_t k = 0; k < face.count; ++k) {
      const std::uint32_t from = hull.corners[face.first + k], to = hull.corners[face.first + (k + 1) % face.count];
      CHECK(sides.emplace(from, to).second);
      corners.emplace(from, f);
      const Vector3d p = vector_of(hull.points[from]), along = vector_of(hull.points[to]) - p;
      CHECK(std::abs(normal.dot(p - first)) < 1e-13 * size);
      const Vector3d middle = [&] {
        Vector3d sum = Vector3d::Zero();
        for (std::uint32_t j = 0; j < face.count; ++j) sum += vector_of(hull.points[hull.corners[face.first + j]]);
        return (sum / face.count).eval();
      }();
      CHECK(normal.dot(along.cross(middle - p)) > 0);
    }
  }
  for (std::uint32_t k = 0; k < hull.points.size(); ++k) {
    for (std::uint32_t j = hull.first_neighbour[k]; j < hull.first_neighbour[k + 1]; ++j) neighbours.emplace(k, hull.neighbour[j]);
    for (std::uint32_t j = hull.first_face[k]; j < hull.first_face[k + 1]; ++j) faces_of_points.emplace(k, hull.face_of[j]);
  }
  CHECK(neighbours == sides);  // each edge is run along both ways
  CHECK(faces_of_points == corners);
  CHECK(hull.points.size() + hull.faces.size() == sides.size() / 2 + 2);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const auto& p : hull.points) {
      CHECK(p[axis] >= hull.points[hull.extreme[2 * axis]][axis]);
      CHECK(p[axis] <= hull.points[hull.extreme[2 * axis + 1]][axis]);
    }
  }
}

TEST_CASE("the hull of points is the faces that all of them lie behind") {
  Random random(1);
  for (const double scale : {1e-6, 1.0, 1e4}) {
    for (int k = 0; k < 10; ++k) {
      std::vector<Vector3d> points;
      for (int p = 0; p < 60; ++p) points.push_back(scale * Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
      const auto hull = convex_hull(points);
      REQUIRE(hull);
      check_sound(*hull, points);
      CHECK(hull->points.size() < 50);
    }
  }
}

TEST_CASE("a box with points within its faces and edges has six faces of four corners") {
  std::vector<Vector3d> points;
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) {
      for (int z = 0; z < 4; ++z) points.emplace_back(0.1 * x, 0.2 * y, 0.3 * z);
    }
  }
  const auto hull = convex_hull(points);
  REQUIRE(hull);
  check_sound(*hull, points);
  CHECK(hull->points.size() == 8);
  REQUIRE(hull->faces.size() == 6);
  for (const auto& face : hull->faces) CHECK(face.count == 4);
  CHECK(std::abs(hull->reach - std::hypot(0.3, 0.6, 0.9)) < 1e-15);
}

TEST_CASE("points of a plane have a face a side, points of a line two ends, one place one point, none no hull") {
  std::vector<Vector3d> square;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) square.emplace_back(x, y, 2 * x + y);
  }
  const auto flat = convex_hull(square);
  REQUIRE(flat);
  CHECK(flat->points.size() == 4);
  REQUIRE(flat->faces.size() == 2);
  CHECK((vector_of(flat->faces[0].normal) + vector_of(flat->faces[1].normal)).norm() == 0);
  check_sound(*flat, square);
  const auto line = convex_hull({{0, 0, 0}, {1, 2, 3}, {0.5, 1, 1.5}, {-1, -2, -3}});
  REQUIRE(line);
  CHECK(line->points.size() == 2);
  CHECK(line->faces.empty());
  CHECK(line->neighbour == std::vector<std::uint32_t>{1, 0});
  const auto point = convex_hull({{1, 1, 1}, {1, 1, 1}});
  REQUIRE(point);
  CHECK(point->points.size() == 1);
  CHECK(convex_hull({}) == nullptr);
  CHECK(convex_hull({{0, 0, 0}, {std::numeric_limits<double>::quiet_NaN(), 0, 0}}) == nullptr);
}

}  // namespace
}  // namespace linden::convex_hull_test
