#include "engine/view/corner_normals.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace linden {
namespace {

using Eigen::Vector3d;

/// Twice the area over the square of the longest edge below which a triangle's normal is rounding.
constexpr double kNoArea = 1e-9;
/// Triangles at one edge beyond which none of them go together: no body is made so.
constexpr std::ptrdiff_t kMostAtEdge = 8;

/// An edge as one triangle runs along it, from a corner to the next.
struct HalfEdge {
  std::uint64_t ends;    // numbers of both points, the smaller one first
  std::uint32_t corner;  // that it begins at: 3 x triangle + 0, 1, 2
  bool forward;          // from the smaller number to the larger
};

class Shading {
 public:
  using Triangles = std::vector<std::array<std::uint32_t, 3>>;

  Shading(const std::vector<Vector3d>& points, const Triangles& triangles)
      : points_(points), triangles_(triangles), same_(3 * triangles.size()) {}

  ShadedTriangles run() {
    std::iota(same_.begin(), same_.end(), 0U);
    find_normals();
    collect_edges();
    for (auto first = edges_.begin(); first != edges_.end();) {
      const auto last = std::find_if(first, edges_.end(), [&](const HalfEdge& edge) { return edge.ends != first->ends; });
      const std::ptrdiff_t forward = std::count_if(first, last, [](const HalfEdge& edge) { return edge.forward; });
      closed_ = closed_ && 2 * forward == last - first;
      if (last - first <= kMostAtEdge) join_across(&*first, &*first + (last - first));
      first = last;
    }
    sum_normals();
    if (closed_ && volume() < 0) turn_round();
    return std::move(result_);
  }

 private:
  const Vector3d& place(std::uint32_t corner) const { return points_[triangles_[corner / 3][corner % 3]]; }
  static std::uint32_t next(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
  bool has_area(std::size_t triangle) const { return normals_[triangle].x() < 2; }

  void find_normals() {
    for (const auto& [a, b, c] : triangles_) {
      const Vector3d ab = points_[b] - points_[a], ac = points_[c] - points_[a];
      const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
      const Vector3d across = ab.cross(ac);
      const double size = across.norm();
      // no component of a unit vector is 2
      normals_.push_back(size > kNoArea * longest && std::isfinite(size) ? Vector3d(across / size) : Vector3d(2, 2, 2));
    }
  }

  void collect_edges() {
    edges_.reserve(3 * triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      if (!has_area(t)) continue;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint64_t from = triangles_[t][k], to = triangles_[t][(k + 1) % 3];
        edges_.push_back({std::min(from, to) << 32 | std::max(from, to), 3 * t + k, from < to});
      }
    }
    std::ranges::sort(edges_, [](const HalfEdge& a, const HalfEdge& b) {
      return a.ends != b.ends ? a.ends < b.ends : a.corner < b.corner;
    });
  }

  /// Of the triangles at one edge those that are smooth across it.
  void join_across(const HalfEdge* first, const HalfEdge* last) {
    const double crease = std::cos(kCreaseDegrees * std::numbers::pi / 180);
    for (const HalfEdge* one = first; one != last; ++one) {
      const HalfEdge* nearest = nullptr;
      double best = crease;
      for (const HalfEdge* other = first; other != last; ++other) {
        if (!one->forward || other->forward) continue;
        const double cosine = normals_[one->corner / 3].dot(normals_[other->corner / 3]);
        if (cosine > best) nearest = other, best = cosine;
      }
      if (!nearest) continue;
      join(one->corner, next(nearest->corner));
      join(next(one->corner), nearest->corner);
    }
  }

  std::uint32_t root(std::uint32_t corner) {
    while (same_[corner] != corner) corner = same_[corner] = same_[same_[corner]];
    return corner;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    same_[std::max(a, b)] = std::min(a, b);
  }

  void sum_normals() {
    constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> number(same_.size(), kNone);
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      std::array<std::uint32_t, 3> corners{};
      for (std::uint32_t k = 0; k < 3 && has_area(t); ++k) {
        const std::uint32_t corner = 3 * t + k, group = root(corner);
        if (number[group] == kNone) {
          number[group] = static_cast<std::uint32_t>(result_.places.size());
          result_.places.push_back(place(corner));
          result_.normals.push_back(Vector3d::Zero());
        }
        corners[k] = number[group];
        const Vector3d one = place(next(corner)) - place(corner), other = place(next(next(corner))) - place(corner);
        const double angle = std::atan2(one.cross(other).norm(), one.dot(other));
        result_.normals[corners[k]] += angle * normals_[t];
      }
      result_.triangles.push_back(corners);
    }
    // the normals of a group differ step by step by less than a right angle; all round a point they may still cancel
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      for (const std::uint32_t point : result_.triangles[t]) {
        if (has_area(t) && result_.normals[point].norm() < 1e-6) result_.normals[point] = normals_[t];
      }
    }
    for (Vector3d& normal : result_.normals) normal.normalize();
  }

  double volume() const {
    const Vector3d middle = points_.front();
    double sum = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const auto& [a, b, c] = triangles_[t];
      sum += (points_[a] - middle).dot((points_[b] - middle).cross(points_[c] - middle)) / 6;
    }
    return sum;
  }

  void turn_round() {
    for (auto& triangle : result_.triangles) std::swap(triangle[1], triangle[2]);
    for (Vector3d& normal : result_.normals) normal = -normal;
  }

  const std::vector<Vector3d>& points_;
  const Triangles& triangles_;
  std::vector<Vector3d> normals_;    // of each triangle
  std::vector<HalfEdge> edges_;      // sorted by the edge
  std::vector<std::uint32_t> same_;  // corners that share a normal, each with one of them
  bool closed_ = true;
  ShadedTriangles result_;
};

}  // namespace

ShadedTriangles shaded(const std::vector<Vector3d>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  return Shading(points, triangles).run();
}

TriangleMesh mesh_of(const ShadedTriangles& all, const std::vector<std::uint32_t>& which) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(all.places.size(), kNone);
  TriangleMesh mesh;
  for (const std::uint32_t triangle : which) {
    const auto& corners = all.triangles[triangle];
    if (corners[0] == corners[1]) continue;
    for (const std::uint32_t point : corners) {
      if (number[point] == kNone) {
        number[point] = static_cast<std::uint32_t>(mesh.positions.size() / 3);
        for (int k = 0; k < 3; ++k) {
          mesh.positions.push_back(static_cast<float>(all.places[point][k]));
          mesh.normals.push_back(static_cast<float>(all.normals[point][k]));
        }
      }
      mesh.indices.push_back(number[point]);
    }
  }
  return mesh;
}

TriangleMesh mesh_of(const ShadedTriangles& all) {
  std::vector<std::uint32_t> every(all.triangles.size());
  std::iota(every.begin(), every.end(), 0U);
  return mesh_of(all, every);
}

}  // namespace linden
