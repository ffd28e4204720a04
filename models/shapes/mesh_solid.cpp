#include "models/shapes/mesh_solid.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "layout/support/input_error.hpp"
#include "models/shapes/mesh_file.hpp"
#include "models/shapes/welded_points.hpp"

namespace linden {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLeastVolume = 1e-12;  // of the box about it: less is flat
constexpr std::size_t kMost = 20'000'000;

class Triangles : public MeshSink {
 public:
  Triangles(const std::string& file, const Vector3d& scale) : file_(file), scale_(scale) {}

  void point(const Vector3d& p) override {
    if (points.size() == kMost) throw InputError(fmt::format("{}: it holds over {} points; expected a smaller mesh", file_, kMost));
    points.push_back(p.cwiseProduct(scale_));
    box.extend(points.back());
  }
  bool wants_triangles() const override { return true; }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) override {
    if (triangles.size() == kMost) throw InputError(fmt::format("{}: it holds over {} triangles; expected a smaller mesh", file_, kMost));
    triangles.push_back({a, b, c});
  }

  std::vector<Vector3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  MeshBox box;

 private:
  const std::string& file_;
  Vector3d scale_;
};

bool is_closed(const Triangles& mesh) {
  if (mesh.triangles.empty()) return false;
  const std::vector<std::uint32_t> number = welded(mesh.points, mesh.box);
  if (number.empty()) return false;
  std::unordered_map<std::uint64_t, int> runs;  // of an edge: one way less the other
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t from = number[triangle[k]], to = number[triangle[(k + 1) % 3]];
      if (from != to) runs[std::min(from, to) << 32 | std::max(from, to)] += from < to ? 1 : -1;
    }
  }
  return std::ranges::all_of(runs, [](const auto& edge) { return edge.second == 0; });
}

}  // namespace

MeshSolid mesh_solid(const std::string& file, const Vector3d& scale) {
  Triangles mesh(file, scale);
  read_mesh(file, mesh);
  require_extent(mesh.box, file);
  MeshSolid solid;
  solid.box = mesh.box;
  if (!is_closed(mesh)) return solid;
  const Vector3d middle = mesh.box.center();
  double volume = 0;
  Vector3d moment = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
  for (const auto& triangle : mesh.triangles) {
    const Vector3d a = mesh.points[triangle[0]] - middle, b = mesh.points[triangle[1]] - middle, c = mesh.points[triangle[2]] - middle;
    const double d = a.dot(b.cross(c));
    const Vector3d s = a + b + c;
    volume += d / 6;
    moment += d / 24 * s;
    second += d / 120 * (s * s.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  if (volume < 0) volume = -volume, moment = -moment, second = -second;
  if (!(volume > kLeastVolume * mesh.box.volume())) return solid;
  const Vector3d center = moment / volume;
  second -= volume * center * center.transpose();
  // where surfaces run through one another it may be that of no solid
  if (!(Eigen::SelfAdjointEigenSolver<Matrix3d>(second, Eigen::EigenvaluesOnly).eigenvalues()[0] > 0)) return solid;
  if (!mesh.box.contains(middle + center)) return solid;
  solid.closed = true;
  solid.volume = volume;
  solid.center = middle + center;
  solid.about_center = second.trace() * Matrix3d::Identity() - second;
  return solid;
}

}  // namespace linden
