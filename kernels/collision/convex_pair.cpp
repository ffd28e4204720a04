#include "kernels/collision/convex_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/collision/directions.hpp"
#include "kernels/collision/patch_points.hpp"
#include "kernels/collision/separation.hpp"

namespace linden {
namespace {

bool is_thin(const ConvexShape& shape) { return shape.kind == ConvexKind::point || shape.kind == ConvexKind::segment; }
bool is_box_of_any_kind(const ConvexShape& shape) { return is_thin(shape) || shape.kind == ConvexKind::box; }

Vec3<double> line_of(const PlacedConvex& c) { return {c.R.x.z, c.R.y.z, c.R.z.z}; }

/// Points and segments: nearest points of both. Where they meet the normal is across both.
Separation between_lines(const PlacedConvex& a, const PlacedConvex& b, double size) {
  const Vec3<double> u = line_of(a), v = line_of(b), d = b.p - a.p;
  const double half_a = a.shape.half[2], half_b = b.shape.half[2];
  const double c = dot(u, v), du = dot(d, u), dv = dot(d, v);
  const Vec3<double> turned = cross(u, v);
  const double sine_square = dot(turned, turned);
  const auto within = [](double x, double half) { return std::clamp(x, -half, half); };
  // |d + t v - s u| least: s - c t = du, c s - t = dv
  const auto nearest_t = [&](double s) { return within(c * s - dv, half_b); };
  const auto nearest_s = [&](double t) { return within(du + c * t, half_a); };
  // d.(v x (u x v)) = du - c dv without its cancellation
  double s = sine_square > 0 ? within(dot(d, cross(v, turned)) / sine_square, half_a) : 0;
  if (!std::isfinite(s)) s = 0;
  const double t = nearest_t(s);
  s = nearest_s(t);
  const Vec3<double> between = d + t * v - s * u;
  const double distance = length_of(between);
  if (distance > 1e-12 * size) {
    // where lines nearly touch rounding turns what is between them: an end of theirs would stand out by as much of their lengths
    Vec3<double> n = between / distance;
    const bool along_a = std::abs(s) < half_a, along_b = std::abs(t) < half_b;
    if (along_a) n = n - dot(n, u) * u;
    if (along_b) {
      const Vec3<double> w = along_a ? cross(turned, u) : v;  // of v what is across u
      const double ww = dot(w, w);
      if (ww > 0) n = n - (dot(n, w) / ww) * w;
    }
    return {n / length_of(n), distance, false};
  }
  Vec3<double> n = sine_square > 1e-24 && half_a > 0 && half_b > 0 ? turned / std::sqrt(sine_square) : Vec3<double>{0, 0, 0};
  if (dot(n, n) == 0) {
    const Vec3<double> line = half_a > 0 ? u : half_b > 0 ? v : Vec3<double>{1, 0, 0};
    Vec3<double> other;
    directions_across(line, n, other);
  }
  // whatever side their middles are on
  if (dot(n, d) < 0) n = -n;
  return {n, distance_along(a, b, n), false};
}

double square_beyond(double x) { return x > 0 ? x * x : 0; }

/// From a point to a box, in its axes, where n is from the box.
Separation point_from_box(const std::array<double, 3>& half, const Vec3<double>& p) {
  const double at[3] = {p.x, p.y, p.z};
  double out[3];  // beyond each pair of faces
  for (std::size_t k = 0; k < 3; ++k) out[k] = std::abs(at[k]) - half[k];
  const auto side = [&](std::size_t k) { return std::copysign(1.0, at[k]); };
  if (out[0] > 0 || out[1] > 0 || out[2] > 0) {
    const double distance = std::sqrt(square_beyond(out[0]) + square_beyond(out[1]) + square_beyond(out[2]));
    const auto share = [&](std::size_t k) { return out[k] > 0 ? side(k) * (out[k] / distance) : 0; };
    return {{share(0), share(1), share(2)}, distance, false};
  }
  const std::size_t nearest = out[0] >= out[1] && out[0] >= out[2] ? 0 : out[1] >= out[2] ? 1 : 2;
  const double s = side(nearest);
  return {{nearest == 0 ? s : 0, nearest == 1 ? s : 0, nearest == 2 ? s : 0}, out[nearest], false};
}

Separation point_from_cylinder(const std::array<double, 3>& half, const Vec3<double>& p) {
  const double rho = std::sqrt(p.x * p.x + p.y * p.y), out = rho - half[0], above = std::abs(p.z) - half[2];
  const Vec3<double> radial = rho > 0 ? Vec3<double>{p.x / rho, p.y / rho, 0} : Vec3<double>{1, 0, 0}, axial{0, 0, std::copysign(1.0, p.z)};
  if (out > 0 && above > 0) {
    const double distance = std::sqrt(out * out + above * above);
    return {(out / distance) * radial + (above / distance) * axial, distance, false};
  }
  return out > above ? Separation{radial, out, false} : Separation{axial, above, false};
}

/// By the closed form of a point at `point` and the core of `other`; n from `other`.
template <class Form>
Separation from_surface(const PlacedConvex& other, const Vec3<double>& point, Form form) {
  Separation s = form(other.shape.half, transpose_times(other.R, point - other.p));
  s.n = other.R * s.n;
  return s;
}

Separation reversed(Separation s) {
  s.n = -s.n;
  return s;
}

Separation between_cores(const PlacedConvex& a, const PlacedConvex& b, double size, double margin) {
  const ConvexKind kind_a = a.shape.kind, kind_b = b.shape.kind;
  if (is_thin(a.shape) && is_thin(b.shape)) return between_lines(a, b, size);
  if (kind_a == ConvexKind::point) {
    if (kind_b == ConvexKind::box) return reversed(from_surface(b, a.p, point_from_box));
    if (kind_b == ConvexKind::cylinder) return reversed(from_surface(b, a.p, point_from_cylinder));
  }
  if (kind_b == ConvexKind::point) {
    if (kind_a == ConvexKind::box) return from_surface(a, b.p, point_from_box);
    if (kind_a == ConvexKind::cylinder) return from_surface(a, b.p, point_from_cylinder);
  }
  if (is_box_of_any_kind(a.shape) && is_box_of_any_kind(b.shape)) {
    Separation s = box_separation(a, b, size);
    if (s.distance <= 0) return s;
    if (s.distance > margin) {
      s.beyond = true;
      return s;
    }
    // a face or a crossing of edges may part them by less than their distance; near as nothing it is that
    const Separation apart = separation(a, b, size, margin);
    return apart.distance > s.distance ? apart : s;
  }
  return separation(a, b, size, margin);
}

/// The half space n.x <= offset, seen from the shape's origin, as A.
ContactPatch half_space_patch(const Vec3<double>& n, double offset, const ConvexShape& b, const Pose& pose_b, double margin) {
  const PlacedConvex on_b{b, Mat3<double>::from(pose_b.rotation.data()), {0, 0, 0}};
  ContactPatch patch;
  patch.normal = n;
  patch.distance = dot(n, support(on_b, -n)) - b.radius - offset;
  if (patch.distance > margin) return patch;
  plane_points(offset, on_b, core_reach(b) + std::abs(offset), margin, patch);
  const Vec3<double> origin = Vec3<double>::from(pose_b.shift.data());
  for (int k = 0; k < patch.count; ++k) patch.points[static_cast<std::size_t>(k)].place += origin;
  return patch;
}

/// A shape of that kind as A.
ContactPatch patch_of_plane(const Pose& pose, const ConvexShape& b, const Pose& pose_b, double margin) {
  const Vec3<double> n{pose.rotation[2], pose.rotation[5], pose.rotation[8]};
  return half_space_patch(n, dot(n, Vec3<double>::from(pose.shift.data()) - Vec3<double>::from(pose_b.shift.data())), b, pose_b, margin);
}

/// With both shapes in each other's place.
ContactPatch swapped(ContactPatch patch) {
  patch.normal = -patch.normal;
  const auto end = patch.points.begin() + patch.count;
  for (auto point = patch.points.begin(); point != end; ++point) point->feature = point->feature << 32 | point->feature >> 32;
  std::sort(patch.points.begin(), end, [](const PatchPoint& x, const PatchPoint& y) { return x.feature < y.feature; });
  return patch;
}

}  // namespace

ContactPatch contact_patch(const ConvexShape& a, const Pose& pose_a, const ConvexShape& b, const Pose& pose_b, double margin) {
  if (a.kind == ConvexKind::plane) return patch_of_plane(pose_a, b, pose_b, margin);
  if (b.kind == ConvexKind::plane) return swapped(patch_of_plane(pose_b, a, pose_a, margin));
  const Vec3<double> origin = Vec3<double>::from(pose_a.shift.data());
  const PlacedConvex on_a{a, Mat3<double>::from(pose_a.rotation.data()), {0, 0, 0}};
  const PlacedConvex on_b{b, Mat3<double>::from(pose_b.rotation.data()), Vec3<double>::from(pose_b.shift.data()) - origin};
  ContactPatch patch;
  const double radii = a.radius + b.radius, reach_a = core_reach(a), reach_b = core_reach(b);
  const double apart = length_of(on_b.p), size = apart + reach_a + reach_b;
  if (apart - reach_a - reach_b - radii > margin) {
    patch.distance = apart - reach_a - reach_b - radii;
    patch.normal = on_b.p / apart;
    return patch;
  }
  const Separation cores = between_cores(on_a, on_b, size, margin + radii);
  patch.normal = cores.n;
  patch.distance = cores.distance - radii;
  if (cores.beyond || patch.distance > margin) return patch;
  patch_points(on_a, on_b, size, margin, patch);
  for (int k = 0; k < patch.count; ++k) patch.points[static_cast<std::size_t>(k)].place += origin;
  return patch;
}

ContactPatch plane_patch(const Vec3<double>& n, double offset, const ConvexShape& b, const Pose& pose_b, double margin) {
  return half_space_patch(n, offset - dot(n, Vec3<double>::from(pose_b.shift.data())), b, pose_b, margin);
}

}  // namespace linden
