// tests/engine/drawn.hpp
// What the tests measure of meshes and drawings.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "engine/view/drawing.hpp"
#include "models/build/isometry.hpp"

namespace linden {

inline constexpr double kPi = std::numbers::pi;

inline Eigen::Vector3d vector_at(const std::vector<float>& numbers, std::uint32_t point) {
  return {numbers[3 * point], numbers[3 * point + 1], numbers[3 * point + 2]};
}

/// A mesh as a part shows it.
struct Measure {
  double volume = 0, area = 0;
  Eigen::Vector3d least = Eigen::Vector3d::Constant(1e300), most = Eigen::Vector3d::Constant(-1e300);
};

inline void add_to(Measure& measure, const TriangleMesh& mesh, const Isometry& pose = Isometry::Identity(),
                   const Eigen::Vector3d& scale = Eigen::Vector3d::Ones()) {
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    std::array<Eigen::Vector3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = pose * vector_at(mesh.positions, mesh.indices[t + k]).cwiseProduct(scale);
      measure.least = measure.least.cwiseMin(p[k]);
      measure.most = measure.most.cwiseMax(p[k]);
    }
    // int x . n dA = 3 V
    measure.volume += p[0].dot(p[1].cross(p[2])) / 6;
    measure.area += (p[1] - p[0]).cross(p[2] - p[0]).norm() / 2;
  }
}

inline Measure measured(const TriangleMesh& mesh) {
  Measure measure;
  add_to(measure, mesh);
  return measure;
}

/// All parts of a layer in the frames of their bodies.
inline Measure measured(const Drawing& drawing, Layer layer, Index slot) {
  Measure measure;
  for (const DrawnPart& part : drawing.parts) {
    if (part.layer != layer || part.slot != slot) continue;
    add_to(measure, drawing.meshes[part.mesh], isometry(part.pose), Eigen::Vector3d(part.scale[0], part.scale[1], part.scale[2]));
  }
  return measure;
}

/// What holds of every mesh: whole, finite, normals of unit length to the side that its triangles are seen from.
inline void require_sound(const TriangleMesh& mesh) {
  REQUIRE(mesh.positions.size() == mesh.normals.size());
  REQUIRE(mesh.positions.size() % 3 == 0);
  REQUIRE(!mesh.indices.empty());
  REQUIRE(mesh.indices.size() % 3 == 0);
  const std::size_t points = mesh.positions.size() / 3;
  REQUIRE(std::ranges::all_of(mesh.indices, [&](std::uint32_t index) { return index < points; }));
  REQUIRE(std::ranges::all_of(mesh.positions, [](float number) { return std::isfinite(number); }));
  for (std::uint32_t k = 0; k < points; ++k) REQUIRE(std::abs(vector_at(mesh.normals, k).norm() - 1) < 1e-5);
}

inline void require_sound(const Drawing& drawing, const Model& model) {
  for (const TriangleMesh& mesh : drawing.meshes) require_sound(mesh);
  for (const DrawnPart& part : drawing.parts) {
    REQUIRE(part.mesh < drawing.meshes.size());
    REQUIRE(part.slot >= 0);
    REQUIRE(part.slot < model.tree.shape.slots);
    REQUIRE(isometry(part.pose).matrix().allFinite());
    REQUIRE(isometry(part.pose).linear().determinant() == Approx(1));
    for (const double scale : part.scale) REQUIRE((scale > 0 && std::isfinite(scale)));
    for (const float number : part.colour) REQUIRE((number >= 0 && number <= 1));
  }
  REQUIRE(std::ranges::is_sorted(drawing.parts, {}, &DrawnPart::slot));
  REQUIRE(std::set<std::string>(drawing.warnings.begin(), drawing.warnings.end()).size() == drawing.warnings.size());
}

/// Least cosine between a triangle and the normals at its corners.
inline double least_agreement(const TriangleMesh& mesh) {
  double least = 1;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    const Eigen::Vector3d a = vector_at(mesh.positions, mesh.indices[t]), b = vector_at(mesh.positions, mesh.indices[t + 1]),
                          c = vector_at(mesh.positions, mesh.indices[t + 2]);
    const Eigen::Vector3d face = (b - a).cross(c - a).normalized();
    for (std::size_t k = 0; k < 3; ++k) least = std::min(least, face.dot(vector_at(mesh.normals, mesh.indices[t + k])));
  }
  return least;
}

inline std::size_t count(const Drawing& drawing, Layer layer) {
  return static_cast<std::size_t>(std::ranges::count(drawing.parts, layer, &DrawnPart::layer));
}

inline constexpr std::string_view kTetrahedronObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
/// Seen from outside.
inline constexpr std::string_view kFaces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

}  // namespace linden
