#include "kernels/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace linden {
namespace {

constexpr double kFarOff = 1e8;      // cells from the map's first: further off no number says which one it is
constexpr double kMostCells = 500;   // to each side of a shape that are looked at
constexpr double kOverhang = 4;      // times its gap a corner may lie beyond a face of a ridge
constexpr double kLeastWeight = 1e-6;

/// Whether two features are two, 0 to 1.
double apart(const TerrainFeature& a, const TerrainFeature& b) {
  const double turn = a.kind == FeatureKind::face && b.kind == FeatureKind::face ? kOnePlane : kApart;
  const Vec3<double> difference = a.normal - b.normal;
  const double x = std::min(dot(difference, difference) / (turn * turn), 1.0);
  return x * x * (3 - 2 * x);
}

}  // namespace

TerrainFeatures::TerrainFeatures(const HeightField& field, const TerrainShape& shape)
    : field_(field), shape_(shape), c_(shape.center) {
  const double reach = std::max(shape.radius, shape.rim_radius) + 0.5 * std::min(field.spacing_x, field.spacing_y);
  const double u = (c_.x - field.origin_x) / field.spacing_x, v = (c_.y - field.origin_y) / field.spacing_y;
  if (!(std::abs(u) < kFarOff && std::abs(v) < kFarOff)) return;
  is_inside_ = shape.radius == 0 || c_.z < height_below(c_.x, c_.y);
  const double du = std::min(reach / field.spacing_x, kMostCells), dv = std::min(reach / field.spacing_y, kMostCells);
  const auto first = [](double x) { return static_cast<Index>(std::floor(x)); };
  for (Index row = first(v - dv); row <= first(v + dv); ++row) {
    for (Index column = first(u - du); column <= first(u + du); ++column) cell(column, row);
  }
  settle();
}

Vec3<double> TerrainFeatures::vertex(Index i, Index j) const {
  const Index column = std::clamp(i, 0, field_.columns - 1), row = std::clamp(j, 0, field_.rows - 1);
  return {field_.origin_x + i * field_.spacing_x, field_.origin_y + j * field_.spacing_y,
          field_.heights[static_cast<std::size_t>(row * field_.columns + column)]};
}

void TerrainFeatures::cell(Index i, Index j) {
  const Vec3<double> v00 = vertex(i, j), v10 = vertex(i + 1, j), v01 = vertex(i, j + 1), v11 = vertex(i + 1, j + 1);
  const double lowest = c_.z - std::max(shape_.radius, shape_.rim_radius);
  if (lowest - kFarAbove > std::max({v00.z, v10.z, v01.z, v11.z})) return;
  face(v00, v10, v01, 1);
  face(v11, v01, v10, -1);
  if (is_corner()) return;
  edge(v00, v10, v01, vertex(i + 1, j - 1));
  edge(v00, v01, v10, vertex(i - 1, j + 1));
  edge(v10, v01, v00, v11);
  if (shape_.rim_radius == 0) corner(i, j, v00);
}

double TerrainFeatures::height_below(double x, double y) const {
  const double u = (x - field_.origin_x) / field_.spacing_x, v = (y - field_.origin_y) / field_.spacing_y;
  if (!(std::abs(u) < 2 * kFarOff && std::abs(v) < 2 * kFarOff)) return -std::numeric_limits<double>::infinity();
  const Index i = static_cast<Index>(std::floor(u)), j = static_cast<Index>(std::floor(v));
  const double a = u - i, b = v - j, h10 = vertex(i + 1, j).z, h01 = vertex(i, j + 1).z;
  if (a + b <= 1) return (1 - a - b) * vertex(i, j).z + a * h10 + b * h01;
  return (a + b - 1) * vertex(i + 1, j + 1).z + (1 - b) * h10 + (1 - a) * h01;
}

/// Corner a of a triangle at the right angle, b along x, c along y; `sense` +1 where they lie ahead of it, -1 behind.
void TerrainFeatures::face(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& c, double sense) {
  const double dx = field_.spacing_x, dy = field_.spacing_y;
  const double sx = sense * (b.z - a.z) / dx, sy = sense * (c.z - a.z) / dy, length = 1 / std::sqrt(1 + sx * sx + sy * sy);
  const Vec3<double> n{-sx * length, -sy * length, length};
  Vec3<double> p = c_;
  if (shape_.rim_radius > 0) {
    const Vec3<double> up = n - dot(n, shape_.axis) * shape_.axis;
    p = p - (shape_.rim_radius / std::sqrt(dot(up, up) + kFlat * kFlat)) * up;
  }
  const double height = dot(p - a, n), gap = height - shape_.radius;
  // what lies above the ground is not inside of a face that goes on over it
  if (height < 0 && !is_inside_) return;
  const Vec3<double> q = p - height * n;
  const double along_x = sense * (q.x - a.x), along_y = sense * (q.y - a.y);
  const std::array<double, 3> beyond{-along_x, -along_y, (along_x / dx + along_y / dy - 1) * dx * dy / std::sqrt(dx * dx + dy * dy)};
  const double over = std::max({beyond[0], beyond[1], beyond[2]});
  // beyond the face its plane holds what is deep in a groove, as long as it lies within the ground; a corner above a ridge meets either side
  if (over > rounding() && !(is_corner() && gap > 0 && over < kOverhang * gap) && q.z > height_below(q.x, q.y) + rounding()) return;
  add({FeatureKind::face, n, {}, c_ - a, gap, 1, (1.0 / 3) * (a + b + c)});
}

/// From a to b, the corners of its faces opposite to it `left` and `right`.
void TerrainFeatures::edge(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& left, const Vec3<double>& right) {
  const Vec3<double> whole = b - a, foot = c_ - a;
  const double length = std::sqrt(dot(whole, whole));
  const Vec3<double> line = (1 / length) * whole;
  if (shape_.rim_radius == 0) {
    const double t = dot(foot, line);
    if (t <= 0 || t >= length) return;
    const Vec3<double> e = a + t * line, y = c_ - e;
    if (y.z <= 0 || dot(left - e, y) > 0 || dot(right - e, y) > 0) return;
    const double distance = std::sqrt(dot(y, y));
    add({FeatureKind::line, (1 / distance) * y, line, foot, distance - shape_.radius, 1, {}});
    return;
  }
  if (std::abs(dot(line, shape_.axis)) < kPierces) return;
  const CircleAndLine<double> at(line, foot, shape_.axis);
  const Vec3<double> e = c_ + at.v;
  const double t = dot(e - a, line);
  if (t < 0 || t >= length) return;
  const Vec3<double>& y = at.gradient.f;
  if (y.z <= 0 || dot(left - e, y) > 0 || dot(right - e, y) > 0) return;
  const double scale = 1 / std::sqrt(dot(y, y));
  add({FeatureKind::pierced, scale * y, line, foot, scale * (at.length - shape_.rim_radius), 1, {}});
}

void TerrainFeatures::corner(Index i, Index j, const Vec3<double>& v) {
  const Vec3<double> y = c_ - v;
  if (y.z <= 0) return;
  for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}) {
    if (dot(vertex(i + di, j + dj) - v, y) > 0) return;
  }
  const double distance = std::sqrt(dot(y, y));
  add({FeatureKind::line, (1 / distance) * y, {}, y, distance - shape_.radius, 1, {}});
}

/// The kMost with the smallest gaps, sorted by them; of faces in one plane the first.
void TerrainFeatures::add(const TerrainFeature& feature) {
  for (int k = 0; k < found_count_; ++k) {
    const TerrainFeature& other = found_[static_cast<std::size_t>(k)];
    if (std::abs(other.gap - feature.gap) < rounding() && dot(other.normal, feature.normal) > 1 - 1e-14) return;
  }
  int at = found_count_;
  while (at > 0 && found_[static_cast<std::size_t>(at - 1)].gap > feature.gap) --at;
  if (at == kMost) return;
  for (int k = std::min(found_count_, kMost - 1); k > at; --k) found_[static_cast<std::size_t>(k)] = found_[static_cast<std::size_t>(k - 1)];
  found_[static_cast<std::size_t>(at)] = feature;
  found_count_ = std::min(found_count_ + 1, kMost);
}

/// Under a ridge the nearer of its faces is the surface; both hold what is above them or in a groove.
bool TerrainFeatures::is_under_ridge(const TerrainFeature& a, const TerrainFeature& b) const {
  if (a.kind != FeatureKind::face || b.kind != FeatureKind::face) return false;
  if (!is_corner() && !(dot(a.foot, a.normal) < 0 && dot(b.foot, b.normal) < 0)) return false;
  const Vec3<double> apart = b.middle - a.middle;
  const double level = 1e3 * rounding();
  return dot(apart, a.normal) < -level && -dot(apart, b.normal) < -level;
}

void TerrainFeatures::settle() {
  for (int k = 0; k < found_count_ && chosen_ < kTerrainRanks; ++k) {
    TerrainFeature feature = found_[static_cast<std::size_t>(k)];
    bool hidden = false;
    for (int l = k + 1; l < found_count_; ++l) hidden = hidden || is_under_ridge(feature, found_[static_cast<std::size_t>(l)]);
    if (hidden) continue;
    for (int l = 0; l < chosen_; ++l) feature.weight *= apart(feature, found_[static_cast<std::size_t>(l)]);
    if (feature.weight > kLeastWeight) found_[static_cast<std::size_t>(chosen_++)] = feature;
  }
  // a ball in a groove keeps each side in its place, whichever it lies deeper in
  if (shape_.rim_radius > 0) return;
  const auto before = [](const TerrainFeature& a, const TerrainFeature& b) {
    return a.normal.x + 0.6 * a.normal.y < b.normal.x + 0.6 * b.normal.y;
  };
  for (const auto& [first, second] : {std::pair{0, 1}, {1, 2}, {0, 1}}) {
    TerrainFeature &one = found_[static_cast<std::size_t>(first)], &other = found_[static_cast<std::size_t>(second)];
    if (second < chosen_ && before(other, one)) std::swap(one, other);
  }
}

}  // namespace linden
