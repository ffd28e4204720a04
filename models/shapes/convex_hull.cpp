#include "models/shapes/convex_hull.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "models/build/vectors.hpp"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace linden {
namespace {

using Eigen::Vector3d;
using CornerLoop = std::vector<std::uint32_t>;

constexpr double kFlatOfSize = 1e-12;  // of the size

/// From faces as loops of corners, anticlockwise, all else. Points that are in no loop are left out.
ConvexHull hull_of_loops(const std::vector<Vector3d>& points, const std::vector<std::pair<Vector3d, CornerLoop>>& faces,
                         const CornerLoop& without_faces) {
  ConvexHull hull;
  std::vector<std::uint32_t> number(points.size(), ~0u);
  const auto take = [&](std::uint32_t k) {
    if (number[k] == ~0u) {
      number[k] = static_cast<std::uint32_t>(hull.points.size());
      hull.points.push_back(array_of(points[k]));
    }
    return number[k];
  };
  for (const std::uint32_t k : without_faces) take(k);
  for (const auto& [normal, loop] : faces) {
    hull.faces.push_back({array_of(normal), static_cast<std::uint32_t>(hull.corners.size()), static_cast<std::uint32_t>(loop.size())});
    for (const std::uint32_t k : loop) hull.corners.push_back(take(k));
  }
  std::vector<CornerLoop> face_of(hull.points.size()), neighbour(hull.points.size());
  const auto connect = [&](std::uint32_t from, std::uint32_t to) {
    for (const auto& [one, other] : {std::pair(from, to), std::pair(to, from)}) {
      if (std::ranges::find(neighbour[one], other) == neighbour[one].end()) neighbour[one].push_back(other);
    }
  };
  for (std::uint32_t f = 0; f < hull.faces.size(); ++f) {
    const ConvexHull::Face& face = hull.faces[f];
    for (std::uint32_t k = 0; k < face.count; ++k) {
      const std::uint32_t corner = hull.corners[face.first + k];
      face_of[corner].push_back(f);
      connect(corner, hull.corners[face.first + (k + 1) % face.count]);
    }
  }
  if (without_faces.size() == 2) connect(0, 1);
  hull.first_face.push_back(0);
  hull.first_neighbour.push_back(0);
  for (std::size_t k = 0; k < hull.points.size(); ++k) {
    hull.face_of.insert(hull.face_of.end(), face_of[k].begin(), face_of[k].end());
    hull.neighbour.insert(hull.neighbour.end(), neighbour[k].begin(), neighbour[k].end());
    hull.first_face.push_back(static_cast<std::uint32_t>(hull.face_of.size()));
    hull.first_neighbour.push_back(static_cast<std::uint32_t>(hull.neighbour.size()));
  }
  for (std::uint32_t k = 0; k < hull.points.size(); ++k) {
    const auto& p = hull.points[k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (p[axis] < hull.points[hull.extreme[2 * axis]][axis]) hull.extreme[2 * axis] = k;
      if (p[axis] > hull.points[hull.extreme[2 * axis + 1]][axis]) hull.extreme[2 * axis + 1] = k;
    }
    hull.reach = std::max(hull.reach, std::hypot(p[0], p[1], p[2]));
  }
  return hull;
}

/// The polygon about points of a plane: Andrew's chain.
CornerLoop polygon_about(const std::vector<Vector3d>& points, const Vector3d& u, const Vector3d& v, double size) {
  std::vector<std::uint32_t> order(points.size());
  std::vector<std::array<double, 2>> flat;
  for (std::uint32_t k = 0; k < points.size(); ++k) order[k] = k, flat.push_back({u.dot(points[k]), v.dot(points[k])});
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) { return flat[a] != flat[b] ? flat[a] < flat[b] : a < b; });
  CornerLoop loop;
  const auto turns_left = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const double x = flat[b][0] - flat[a][0], y = flat[b][1] - flat[a][1];
    return x * (flat[c][1] - flat[a][1]) - y * (flat[c][0] - flat[a][0]) > kFlatOfSize * size * std::hypot(x, y);
  };
  const auto run = [&](auto first, auto last) {
    const std::size_t start = loop.size();
    for (auto k = first; k != last; ++k) {
      while (loop.size() >= start + 2 && !turns_left(loop[loop.size() - 2], loop.back(), *k)) loop.pop_back();
      loop.push_back(*k);
    }
    loop.pop_back();  // the other run begins with it
  };
  run(order.begin(), order.end());
  run(order.rbegin(), order.rend());
  return loop;
}

/// Corners of a facet in the order in which they lie around it.
CornerLoop corners_around(qhT* qh, facetT* facet) {
  CornerLoop loop;
  setT* corners = qh_facet3vertex(qh, facet);
  for (int k = 0; k < qh_setsize(qh, corners); ++k) {
    const auto* vertex = static_cast<vertexT*>(SETelem_(corners, k));
    loop.push_back(static_cast<std::uint32_t>(qh_pointid(qh, vertex->point)));
  }
  qh_settempfree(qh, &corners);
  return loop;
}

/// Normal and corners of each face; empty where Qhull gives up.
std::vector<std::pair<Vector3d, CornerLoop>> faces_by_qhull(const std::vector<Vector3d>& points) {
  std::vector<std::pair<Vector3d, CornerLoop>> faces;
  std::vector<double> numbers;
  numbers.reserve(3 * points.size());
  for (const Vector3d& p : points) numbers.insert(numbers.end(), {p.x(), p.y(), p.z()});
  char* said = nullptr;
  std::size_t length = 0;
  std::FILE* aside = open_memstream(&said, &length);  // what it would tell a person
  if (aside == nullptr) return faces;
  qhT memory;
  qhT* qh = &memory;
  qh_zero(qh, aside);
  char options[] = "qhull Pp";
  if (qh_new_qhull(qh, 3, static_cast<int>(points.size()), numbers.data(), False, options, nullptr, aside) == 0) {
    for (facetT* facet = qh->facet_list; facet != nullptr && facet->next != nullptr; facet = facet->next) {
      CornerLoop loop = corners_around(qh, facet);
      const Vector3d normal(facet->normal[0], facet->normal[1], facet->normal[2]);
      Vector3d turn = Vector3d::Zero();
      for (std::size_t k = 0; k < loop.size(); ++k) {
        turn += (points[loop[k]] - points[loop[0]]).cross(points[loop[(k + 1) % loop.size()]] - points[loop[0]]);
      }
      if (turn.dot(normal) < 0) std::ranges::reverse(loop);
      faces.emplace_back(normal.normalized(), std::move(loop));
    }
  }
  qh_freeqhull(qh, qh_ALL);
  int kept = 0, total = 0;
  qh_memfreeshort(qh, &kept, &total);
  std::fclose(aside);
  std::free(said);
  return faces;
}

}  // namespace

std::shared_ptr<const ConvexHull> convex_hull(const std::vector<Vector3d>& points) {
  if (points.empty() || points.size() > 100'000'000) return nullptr;
  const auto hull = [](ConvexHull made) { return std::make_shared<const ConvexHull>(std::move(made)); };
  const auto farthest = [&](auto&& far) {
    std::uint32_t best = 0;
    for (std::uint32_t k = 1; k < points.size(); ++k) {
      if (far(points[k]) > far(points[best])) best = k;
    }
    return best;
  };
  if (!std::ranges::all_of(points, [](const Vector3d& p) { return p.allFinite() && p.squaredNorm() < 1e300; })) return nullptr;
  const std::uint32_t one = farthest([&](const Vector3d& p) { return (p - points[0]).norm(); });
  const std::uint32_t other = farthest([&](const Vector3d& p) { return (p - points[one]).norm(); });
  const double size = (points[other] - points[one]).norm();
  const double nothing = kFlatOfSize * std::max({size, points[one].norm(), points[other].norm()});  // coordinates are rounded as well
  if (size <= nothing) return hull(hull_of_loops(points, {}, {one}));
  const Vector3d line = (points[other] - points[one]) / size;
  const auto aside = [&](const Vector3d& p) { return (p - points[one] - line.dot(p - points[one]) * line).eval(); };
  const std::uint32_t third = farthest([&](const Vector3d& p) { return aside(p).norm(); });
  if (aside(points[third]).norm() <= nothing) return hull(hull_of_loops(points, {}, {one, other}));
  const Vector3d across = aside(points[third]).normalized(), normal = line.cross(across);
  const std::uint32_t fourth = farthest([&](const Vector3d& p) { return std::abs(normal.dot(p - points[one])); });
  if (std::abs(normal.dot(points[fourth] - points[one])) <= nothing) {
    const CornerLoop loop = polygon_about(points, line, across, size);
    CornerLoop back(loop.rbegin(), loop.rend());
    return hull(hull_of_loops(points, {{normal, loop}, {-normal, std::move(back)}}, {}));
  }
  const auto faces = faces_by_qhull(points);
  if (faces.empty()) return nullptr;
  return hull(hull_of_loops(points, faces, {}));
}

}  // namespace linden
