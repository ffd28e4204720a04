#include "engine/view/file_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/view/corner_normals.hpp"
#include "layout/support/input_error.hpp"
#include "models/shapes/mesh_box.hpp"
#include "models/shapes/mesh_file.hpp"
#include "models/shapes/welded_points.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostTriangles = 2'000'000, kMostPoints = 3 * kMostTriangles, kMostColours = 256;

class Surfaces : public MeshSink {
 public:
  Surfaces(const std::string& file, const std::array<double, 3>& signs) : file_(file), signs_(signs[0], signs[1], signs[2]) {}

  void point(const Vector3d& p) override {
    if (points.size() == kMostPoints) refuse("points", kMostPoints);
    points.push_back(p.cwiseProduct(signs_));
    box.extend(points.back());
  }
  bool wants_triangles() const override { return true; }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) override {
    if (triangles.size() == kMostTriangles) refuse("triangles", kMostTriangles);
    if (signs_.prod() < 0) std::swap(b, c);
    triangles.push_back({a, b, c});
    colour_of.push_back(current_);
  }
  bool wants_colours() const override { return true; }
  void colour(const MeshColour& next) override {
    textured = textured || next.textured;
    const auto found = number_.find(next.rgba);
    if (found != number_.end()) {
      current_ = found->second;
    } else if (colours.size() < kMostColours) {
      current_ = number_[next.rgba] = static_cast<std::uint32_t>(colours.size());
      colours.push_back(next.rgba);
    }
  }

  std::vector<Vector3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> colour_of;  // of each triangle
  std::vector<std::optional<std::array<double, 4>>> colours{std::nullopt};
  MeshBox box;
  bool textured = false;

 private:
  [[noreturn]] void refuse(const char* what, std::size_t most) const {
    throw InputError(fmt::format("{}: it holds over {} {}; expected a mesh that can be drawn", file_, most, what));
  }

  const std::string& file_;
  Vector3d signs_;
  std::map<std::optional<std::array<double, 4>>, std::uint32_t> number_{{std::nullopt, 0U}};
  std::uint32_t current_ = 0;
};

/// A box about points that float can hold.
void require_float(const MeshBox& box, const std::string& file) {
  require_extent(box, file);
  if (box.min().cwiseAbs().maxCoeff() < kFarthest && box.max().cwiseAbs().maxCoeff() < kFarthest) return;
  throw InputError(fmt::format("{}: its points lie over {:g} m away; expected the mesh of a robot's part", file, kFarthest));
}

Colour colour_of(const std::array<double, 4>& rgba) {
  Colour colour;
  std::ranges::transform(rgba, colour.begin(), [](double part) { return static_cast<float>(part); });
  return colour;
}

}  // namespace

FileMesh file_mesh(const std::string& file, const std::array<double, 3>& signs) {
  Surfaces read(file, signs);
  read_mesh(file, read);
  require_float(read.box, file);
  const std::vector<std::uint32_t> number = welded(read.points, read.box);
  for (auto& triangle : read.triangles) {
    for (std::uint32_t& corner : triangle) corner = number.empty() ? 0 : number[corner];
  }
  const ShadedTriangles all = shaded(read.points, read.triangles);
  std::vector<std::vector<std::uint32_t>> of_colour(read.colours.size());
  for (std::uint32_t t = 0; t < read.triangles.size(); ++t) of_colour[read.colour_of[t]].push_back(t);
  FileMesh mesh;
  mesh.textured = read.textured;
  for (std::size_t k = 0; k < of_colour.size(); ++k) {
    FileSurface surface{mesh_of(all, of_colour[k]), std::nullopt};
    if (surface.mesh.indices.empty()) continue;
    if (read.colours[k]) surface.colour = colour_of(*read.colours[k]);
    mesh.triangles += surface.mesh.indices.size() / 3;
    mesh.surfaces.push_back(std::move(surface));
  }
  if (mesh.surfaces.empty()) throw InputError(fmt::format("{}: it holds no triangles; expected a mesh", file));
  return mesh;
}

}  // namespace linden
