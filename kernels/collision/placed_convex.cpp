#include "kernels/collision/placed_convex.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linden {
namespace {

/// From this many points on support climbs: some 100 products cost as much as a climb.
constexpr std::size_t kClimbFrom = 100;
/// Tilt of an edge against the plane of n from which on both of its ends lie as far along it.
constexpr double kLevel = 1e-8;

double component_of(const Vec3<double>& a, int k) { return k == 0 ? a.x : k == 1 ? a.y : a.z; }
Vec3<double> axis_direction(int k) { return {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0}; }
Vec3<double> column_of(const Mat3<double>& R, int k) { return {component_of(R.x, k), component_of(R.y, k), component_of(R.z, k)}; }

std::uint32_t best_of_all(const ConvexHull& hull, const Vec3<double>& n) {
  std::uint32_t best = 0;
  double farthest = dot(n, Vec3<double>::from(hull.points[0].data()));
  for (std::uint32_t k = 1; k < hull.points.size(); ++k) {
    const double far = dot(n, Vec3<double>::from(hull.points[k].data()));
    if (far > farthest) farthest = far, best = k;
  }
  return best;
}

std::uint32_t farthest_by_edges(const ConvexHull& hull, const Vec3<double>& n) {
  const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  const std::size_t start = x >= y && x >= z ? (n.x > 0 ? 1 : 0) : y >= z ? (n.y > 0 ? 3 : 2) : (n.z > 0 ? 5 : 4);
  std::uint32_t best = hull.extreme[start];
  double farthest = dot(n, Vec3<double>::from(hull.points[best].data()));
  for (bool higher = true; higher;) {
    higher = false;
    const std::uint32_t from = best;
    for (std::uint32_t k = hull.first_neighbour[from]; k < hull.first_neighbour[from + 1]; ++k) {
      const std::uint32_t next = hull.neighbour[k];
      const double far = dot(n, Vec3<double>::from(hull.points[next].data()));
      if (far > farthest) farthest = far, best = next, higher = true;
    }
  }
  return best;
}

std::uint32_t farthest_point(const ConvexHull& hull, const Vec3<double>& n) {
  return hull.points.size() > kClimbFrom && !hull.faces.empty() ? farthest_by_edges(hull, n) : best_of_all(hull, n);
}

Vec3<double> local_support(const ConvexShape& shape, const Vec3<double>& n) {
  const auto& half = shape.half;
  switch (shape.kind) {
    case ConvexKind::point: return {0, 0, 0};
    case ConvexKind::segment: return {0, 0, std::copysign(half[2], n.z)};
    case ConvexKind::box: return {std::copysign(half[0], n.x), std::copysign(half[1], n.y), std::copysign(half[2], n.z)};
    case ConvexKind::cylinder: {
      const double rho = std::sqrt(n.x * n.x + n.y * n.y), z = std::copysign(half[2], n.z);
      if (rho == 0) return {0, 0, z};
      return {half[0] * (n.x / rho), half[0] * (n.y / rho), z};
    }
    case ConvexKind::ellipsoid: {
      const Vec3<double> a{half[0] * n.x, half[1] * n.y, half[2] * n.z};
      const double h = std::sqrt(dot(a, a));
      if (h == 0) return {0, 0, 0};
      return {half[0] * (a.x / h), half[1] * (a.y / h), half[2] * (a.z / h)};
    }
    case ConvexKind::hull: return Vec3<double>::from(shape.hull->points[farthest_point(*shape.hull, n)].data());
    case ConvexKind::plane:
    case ConvexKind::heights: break;
  }
  return {0, 0, 0};
}

// Numbers of what a feature is, for ids: its kind in the upper bits, its place among those below.
constexpr std::uint32_t kCornerId = 0u << 28, kEdgeId = 1u << 28, kFaceId = 2u << 28, kSideId = 3u << 28, kDiscId = 4u << 28, kLineId = 5u << 28;

void set_point(Feature& feature, const Vec3<double>& at, std::uint32_t id) {
  feature.kind = Feature::Kind::point;
  feature.id = id;
  feature.count = 1;
  feature.corner[0] = at;
  feature.corner_id[0] = id;
}

void set_line(Feature& feature, const Vec3<double>& from, const Vec3<double>& to, std::uint32_t id, std::uint32_t from_id, std::uint32_t to_id,
              double radius) {
  feature.kind = Feature::Kind::line;
  feature.id = id;
  feature.count = 2;
  feature.corner[0] = from;
  feature.corner[1] = to;
  feature.corner_id[0] = from_id;
  feature.corner_id[1] = to_id;
  feature.side_id[0] = feature.side_id[1] = id;
  feature.radius = radius;
}

/// Of a box whose halves may be 0; a point and a segment are such boxes.
void box_feature(const PlacedConvex& convex, const Vec3<double>& n, Feature& feature) {
  const auto& half = convex.shape.half;
  const std::array<double, 3> local{n.x, n.y, n.z};
  // signs of the corner that lies farthest along n; bit k: positive along axis k
  std::uint32_t corner = 0;
  for (std::uint32_t k = 0; k < 3; ++k) corner |= (local[k] >= 0 ? 1u : 0u) << k;
  const auto at = [&](std::uint32_t signs) {
    const Vec3<double> x{signs & 1 ? half[0] : -half[0], signs & 2 ? half[1] : -half[1], signs & 4 ? half[2] : -half[2]};
    return convex.p + convex.R * x;
  };
  std::uint32_t face = 3;
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (std::abs(local[k]) > std::sqrt(1 - kFacing * kFacing)) face = k;
  }
  std::uint32_t line = 3;
  double least = kFacing;
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (half[k] > 0 && std::abs(local[k]) <= least) least = std::abs(local[k]), line = k;
  }
  if (face < 3 && half[(face + 1) % 3] > 0 && half[(face + 2) % 3] > 0) {
    const std::uint32_t i = (face + 1) % 3, j = (face + 2) % 3;
    const bool up = corner >> face & 1;
    const std::uint32_t base = corner & (1u << face);
    // anticlockwise about +axis, the other way about -axis
    const std::uint32_t first = up ? i : j, second = up ? j : i;
    const std::array<std::uint32_t, 4> round{base, base | 1u << first, base | 1u << first | 1u << second, base | 1u << second};
    feature.kind = Feature::Kind::face;
    feature.id = kFaceId | face << 1 | (up ? 1u : 0u);
    feature.count = 4;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t next = round[(k + 1) % 4];
      feature.corner[k] = at(round[k]);
      feature.corner_id[k] = kCornerId | round[k];
      feature.side_id[k] = kEdgeId | (round[k] ^ next) << 3 | (round[k] & next);  // the axis it runs along, and the signs of the others
    }
    feature.normal = (up ? 1.0 : -1.0) * column_of(convex.R, static_cast<int>(face));
    return;
  }
  if (line < 3) {
    const std::uint32_t from = corner & ~(1u << line), to = from | 1u << line;
    set_line(feature, at(from), at(to), kEdgeId | (1u << line) << 3 | from, kCornerId | from, kCornerId | to, 0);
    return;
  }
  // of a half that is 0 both corners are one
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (half[k] == 0) corner &= ~(1u << k);
  }
  set_point(feature, at(corner), kCornerId | corner);
}

void cylinder_feature(const PlacedConvex& convex, const Vec3<double>& n, Feature& feature) {
  const double radius = convex.shape.half[0], half = convex.shape.half[2];
  const Vec3<double> axis = column_of(convex.R, 2);
  const double rho = std::sqrt(n.x * n.x + n.y * n.y);
  const Vec3<double> out = rho > 1e-9 ? convex.R * Vec3<double>{n.x / rho, n.y / rho, 0} : column_of(convex.R, 0);
  const bool up = n.z >= 0;
  const Vec3<double> end = convex.p + (up ? half : -half) * axis;
  if (rho <= kFacing && radius > 0) {
    feature.kind = Feature::Kind::disc;
    feature.id = kDiscId | (up ? 1u : 0u);
    feature.count = 0;
    feature.normal = up ? axis : -axis;
    feature.center = end;
    feature.low = out;
    feature.aside = cross(axis, out);
    feature.radius = radius;
    for (std::uint32_t k = 0; k < 4; ++k) feature.corner_id[k] = kCornerId | (up ? 1u : 0u) | k << 1;
    feature.side_id[0] = kSideId | (up ? 1u : 0u);
    return;
  }
  if (std::abs(n.z) <= kFacing && half > 0) {
    const Vec3<double> middle = convex.p + radius * out;
    set_line(feature, middle - half * axis, middle + half * axis, kLineId, kCornerId | 0, kCornerId | 1, radius);
    return;
  }
  set_point(feature, end + radius * out, kCornerId | (up ? 1u : 0u));
}

void hull_feature(const PlacedConvex& convex, const Vec3<double>& n, Feature& feature) {
  const ConvexHull& hull = *convex.shape.hull;
  const std::uint32_t top = farthest_point(hull, n);
  const auto at = [&](std::uint32_t k) { return convex.p + convex.R * Vec3<double>::from(hull.points[k].data()); };
  // an edge that lies as far along n: a face must have it
  std::uint32_t beside = top;
  for (std::uint32_t k = hull.first_neighbour[top]; k < hull.first_neighbour[top + 1] && beside == top; ++k) {
    const Vec3<double> along = Vec3<double>::from(hull.points[hull.neighbour[k]].data()) - Vec3<double>::from(hull.points[top].data());
    if (std::abs(dot(n, along)) <= kLevel * std::sqrt(dot(along, along))) beside = hull.neighbour[k];
  }
  std::uint32_t best_face = 0;
  double best = std::sqrt(1 - kFacing * kFacing);
  bool found = false;
  for (std::uint32_t k = hull.first_face[top]; k < hull.first_face[top + 1]; ++k) {
    const std::uint32_t* faces = hull.face_of.data();
    const std::uint32_t *first = faces + hull.first_face[beside], *last = faces + hull.first_face[beside + 1];
    if (std::find(first, last, faces[k]) == last) continue;
    const double along = dot(n, Vec3<double>::from(hull.faces[hull.face_of[k]].normal.data()));
    if (along > best) best = along, best_face = hull.face_of[k], found = true;
  }
  if (found) {
    const ConvexHull::Face& face = hull.faces[best_face];
    const std::uint32_t count = std::min<std::uint32_t>(face.count, Feature::kMost);
    feature.kind = Feature::Kind::face;
    feature.id = kFaceId | best_face;
    feature.count = count;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t place = face.first + static_cast<std::uint32_t>(static_cast<std::uint64_t>(k) * face.count / count);
      feature.corner[k] = at(hull.corners[place]);
      feature.corner_id[k] = kCornerId | hull.corners[place];
      feature.side_id[k] = kSideId | place;
    }
    feature.normal = convex.R * Vec3<double>::from(face.normal.data());
    return;
  }
  double least = kFacing;
  std::uint32_t other = top, place = 0;
  for (std::uint32_t k = hull.first_neighbour[top]; k < hull.first_neighbour[top + 1]; ++k) {
    const Vec3<double> along = Vec3<double>::from(hull.points[hull.neighbour[k]].data()) - Vec3<double>::from(hull.points[top].data());
    const double tilt = std::abs(dot(n, along)) / std::sqrt(dot(along, along));
    if (tilt < least) least = tilt, other = hull.neighbour[k], place = k;
  }
  if (other != top) {
    // seen from either end it is one edge
    const std::uint32_t from = std::min(top, other), to = std::max(top, other);
    for (std::uint32_t k = hull.first_neighbour[from]; k < hull.first_neighbour[from + 1]; ++k) {
      if (hull.neighbour[k] == to) place = k;
    }
    set_line(feature, at(from), at(to), kEdgeId | place, kCornerId | from, kCornerId | to, 0);
    return;
  }
  set_point(feature, at(top), kCornerId | top);
}

}  // namespace

Vec3<double> support(const PlacedConvex& convex, const Vec3<double>& n) {
  return convex.p + convex.R * local_support(convex.shape, transpose_times(convex.R, n));
}

Vec3<double> bend(const PlacedConvex& convex, const Vec3<double>& n, const Vec3<double>& t) {
  const auto& half = convex.shape.half;
  if (convex.shape.kind == ConvexKind::cylinder) {
    const Vec3<double> m = transpose_times(convex.R, n), u = transpose_times(convex.R, t);
    const double rho = std::sqrt(m.x * m.x + m.y * m.y);
    if (rho < 1e-100) return {0, 0, 0};
    const Vec3<double> across{-m.y / rho, m.x / rho, 0};
    return convex.R * ((half[0] / rho * dot(across, u)) * across);
  }
  if (convex.shape.kind == ConvexKind::ellipsoid) {
    const Vec3<double> m = transpose_times(convex.R, n), u = transpose_times(convex.R, t);
    const Vec3<double> a{half[0] * m.x, half[1] * m.y, half[2] * m.z};
    const double h = std::sqrt(dot(a, a));
    if (h == 0) return {0, 0, 0};
    const Vec3<double> x{half[0] * a.x / h, half[1] * a.y / h, half[2] * a.z / h};
    const Vec3<double> stretched{half[0] * half[0] * u.x, half[1] * half[1] * u.y, half[2] * half[2] * u.z};
    return convex.R * ((stretched - dot(x, u) * x) / h);
  }
  return {0, 0, 0};
}

double core_reach(const ConvexShape& shape) {
  const auto& half = shape.half;
  switch (shape.kind) {
    case ConvexKind::point: return 0;
    case ConvexKind::segment: return half[2];
    case ConvexKind::box: return std::sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]);  // no hypot: it is asked of every pair at every step
    case ConvexKind::cylinder: return std::sqrt(half[0] * half[0] + half[2] * half[2]);
    case ConvexKind::ellipsoid: return std::max({half[0], half[1], half[2]});
    case ConvexKind::hull: return shape.hull->reach;
    case ConvexKind::plane:
    case ConvexKind::heights: return std::numeric_limits<double>::infinity();
  }
  return 0;
}

void kinks_near(const PlacedConvex& convex, const Vec3<double>& n, Kinks& kinks) {
  const Vec3<double> m = transpose_times(convex.R, n);
  const auto& half = convex.shape.half;
  const auto add_edge = [&](const Vec3<double>& along) {
    if (kinks.edge_count < Kinks::kMost) kinks.edges[kinks.edge_count++] = along;
  };
  const auto add_face = [&](const Vec3<double>& normal) {
    if (kinks.face_count < Kinks::kMost) kinks.faces[kinks.face_count++] = normal;
  };
  constexpr double facing = 1 - 0.5 * kNear * kNear;
  switch (convex.shape.kind) {
    case ConvexKind::point:
    case ConvexKind::ellipsoid:
    case ConvexKind::plane:
    case ConvexKind::heights: return;
    case ConvexKind::segment:
      if (std::abs(m.z) < kNear) add_edge(column_of(convex.R, 2));
      return;
    case ConvexKind::box:
    case ConvexKind::cylinder:
      for (int k = 0; k < 3; ++k) {
        if (convex.shape.kind == ConvexKind::cylinder && k != 2) continue;
        const double along = component_of(m, k);
        if (std::abs(along) < kNear && half[static_cast<std::size_t>(k)] > 0) add_edge(column_of(convex.R, k));
        if (std::abs(along) > facing) add_face(std::copysign(1.0, along) * column_of(convex.R, k));
      }
      return;
    case ConvexKind::hull: {
      const ConvexHull& hull = *convex.shape.hull;
      const std::uint32_t top = farthest_point(hull, m);
      for (std::uint32_t k = hull.first_face[top]; k < hull.first_face[top + 1]; ++k) {
        const Vec3<double> normal = Vec3<double>::from(hull.faces[hull.face_of[k]].normal.data());
        if (dot(m, normal) > facing) add_face(convex.R * normal);
      }
      for (std::uint32_t k = hull.first_neighbour[top]; k < hull.first_neighbour[top + 1]; ++k) {
        const Vec3<double> along = Vec3<double>::from(hull.points[hull.neighbour[k]].data()) - Vec3<double>::from(hull.points[top].data());
        const double length = std::sqrt(dot(along, along));
        if (std::abs(dot(m, along)) < kNear * length) add_edge(convex.R * (along / length));
      }
      return;
    }
  }
}

void feature_along(const PlacedConvex& convex, const Vec3<double>& n, Feature& feature) {
  const Vec3<double> m = transpose_times(convex.R, n);
  switch (convex.shape.kind) {
    case ConvexKind::point:
      set_point(feature, convex.p, kCornerId);
      return;
    case ConvexKind::segment:
    case ConvexKind::box:
      box_feature(convex, m, feature);
      // two capsules roll on each other as cylinders do
      feature.radius = convex.shape.radius;
      return;
    case ConvexKind::cylinder:
      cylinder_feature(convex, m, feature);
      if (feature.kind == Feature::Kind::line) feature.radius += convex.shape.radius;
      return;
    case ConvexKind::ellipsoid: set_point(feature, support(convex, n), kCornerId); return;
    case ConvexKind::plane:
    case ConvexKind::heights: return;
    case ConvexKind::hull:
      hull_feature(convex, m, feature);
      feature.radius = convex.shape.radius;
      return;
  }
}

Bounds bounds_of(const ConvexShape& shape, const Pose& pose) {
  const PlacedConvex convex{shape, Mat3<double>::from(pose.rotation.data()), Vec3<double>::from(pose.shift.data())};
  Bounds bounds;
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (is_endless(shape.kind)) {
      constexpr double endless = std::numeric_limits<double>::infinity();
      const double along = shape.kind == ConvexKind::plane ? component_of(column_of(convex.R, 2), k) : 0;  // the others are 0 where it is 1
      bounds.low[at] = along == -1 ? pose.shift[at] : -endless;
      bounds.high[at] = along == 1 ? pose.shift[at] : endless;
      continue;
    }
    bounds.low[at] = component_of(support(convex, -axis_direction(k)), k) - shape.radius;
    bounds.high[at] = component_of(support(convex, axis_direction(k)), k) + shape.radius;
  }
  return bounds;
}

}  // namespace linden
