#include "engine/view/solid_meshes.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace linden {
namespace {

using Eigen::Vector3d;

std::uint32_t add_point(TriangleMesh& mesh, const Vector3d& place, const Vector3d& normal) {
  for (int k = 0; k < 3; ++k) {
    mesh.positions.push_back(static_cast<float>(place[k]));
    mesh.normals.push_back(static_cast<float>(normal[k]));
  }
  return static_cast<std::uint32_t>(mesh.positions.size() / 3 - 1);
}

void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
}

Vector3d on_circle(int k, int around) {
  const double angle = 2 * std::numbers::pi * (k % around) / around;
  return {std::cos(angle), std::sin(angle), 0};
}

/// A face of edges 1 at `middle`, whose normal is x cross y.
void add_square(TriangleMesh& mesh, const Vector3d& middle, const Vector3d& x, const Vector3d& y) {
  const Vector3d normal = x.cross(y);
  const std::uint32_t first = add_point(mesh, middle - 0.5 * x - 0.5 * y, normal);
  add_point(mesh, middle + 0.5 * x - 0.5 * y, normal);
  add_point(mesh, middle + 0.5 * x + 0.5 * y, normal);
  add_point(mesh, middle - 0.5 * x + 0.5 * y, normal);
  add_quad(mesh, first, first + 1, first + 2, first + 3);
}

}  // namespace

TriangleMesh unit_sphere(int around, int rings) {
  TriangleMesh mesh;
  const std::uint32_t south = add_point(mesh, -Vector3d::UnitZ(), -Vector3d::UnitZ());
  for (int ring = 1; ring < rings; ++ring) {
    const double latitude = std::numbers::pi * (static_cast<double>(ring) / rings - 0.5);
    for (int k = 0; k < around; ++k) {
      const Vector3d place = std::cos(latitude) * on_circle(k, around) + std::sin(latitude) * Vector3d::UnitZ();
      add_point(mesh, place, place);
    }
  }
  const std::uint32_t north = add_point(mesh, Vector3d::UnitZ(), Vector3d::UnitZ());
  const auto point = [&](int ring, int k) { return south + 1 + static_cast<std::uint32_t>((ring - 1) * around + k % around); };
  for (int k = 0; k < around; ++k) {
    mesh.indices.insert(mesh.indices.end(), {south, point(1, k + 1), point(1, k)});
    for (int ring = 1; ring + 1 < rings; ++ring) {
      add_quad(mesh, point(ring, k), point(ring, k + 1), point(ring + 1, k + 1), point(ring + 1, k));
    }
    mesh.indices.insert(mesh.indices.end(), {north, point(rings - 1, k), point(rings - 1, k + 1)});
  }
  return mesh;
}

TriangleMesh unit_box() {
  TriangleMesh mesh;
  for (int k = 0; k < 3; ++k) {
    const Vector3d x = Vector3d::Unit((k + 1) % 3), y = Vector3d::Unit((k + 2) % 3), z = Vector3d::Unit(k);
    add_square(mesh, 0.5 * z, x, y);
    add_square(mesh, -0.5 * z, y, x);
  }
  return mesh;
}

TriangleMesh unit_cylinder(int around) {
  TriangleMesh mesh;
  const Vector3d up(0, 0, 0.5);
  for (int k = 0; k < around; ++k) {
    const Vector3d normal = on_circle(k, around);
    add_point(mesh, normal - up, normal);
    add_point(mesh, normal + up, normal);
  }
  for (int k = 0; k < around; ++k) {
    const auto here = static_cast<std::uint32_t>(2 * k), next = static_cast<std::uint32_t>(2 * ((k + 1) % around));
    add_quad(mesh, here, next, next + 1, here + 1);
  }
  for (const double side : {-1.0, 1.0}) {
    const std::uint32_t middle = add_point(mesh, side * up, side * Vector3d::UnitZ());
    for (int k = 0; k < around; ++k) add_point(mesh, on_circle(k, around) + side * up, side * Vector3d::UnitZ());
    for (int k = 0; k < around; ++k) {
      const auto one = middle + 1 + static_cast<std::uint32_t>(k), other = middle + 1 + static_cast<std::uint32_t>((k + 1) % around);
      mesh.indices.insert(mesh.indices.end(), {middle, side > 0 ? one : other, side > 0 ? other : one});
    }
  }
  return mesh;
}

TriangleMesh unit_square() {
  TriangleMesh mesh;
  add_square(mesh, Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitY());
  return mesh;
}

}  // namespace linden
