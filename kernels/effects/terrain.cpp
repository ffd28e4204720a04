#include "kernels/effects/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/effects/terrain_height.hpp"

namespace linden {
namespace {

constexpr double kFarOff = 1e8;      // cells from the map's first: further off no number says which one it is
constexpr double kMostCells = 500;   // to each side of a shape that are looked at
constexpr double kBlockReach = 0.1;  // of a block downwards [m]
constexpr double kOverhang = 4;      // times its gap a corner may lie beyond a face of a ridge
constexpr double kLeastWeight = 1e-6;
constexpr double kFromAbove = 0.7;   // cosine between a normal and a face from which on that face looks up

/// Whether two features are two, 0 to 1.
double apart(const TerrainFeature& a, const TerrainFeature& b) {
  const Vec3<double> difference = a.normal - b.normal;
  const double x = std::min(dot(difference, difference) / (kApart * kApart), 1.0);
  return x * x * (3 - 2 * x);
}

Vec3<double> vertex_of(const HeightField& field, Index i, Index j) {
  const Index column = std::clamp(i, 0, field.columns - 1), row = std::clamp(j, 0, field.rows - 1);
  return {field.origin_x + i * field.spacing_x, field.origin_y + j * field.spacing_y,
          field.heights[static_cast<std::size_t>(row * field.columns + column)]};
}

}  // namespace

double height_below(const HeightField& field, double x, double y) {
  const double u = (x - field.origin_x) / field.spacing_x, v = (y - field.origin_y) / field.spacing_y;
  if (!(std::abs(u) < 2 * kFarOff && std::abs(v) < 2 * kFarOff)) return -std::numeric_limits<double>::infinity();
  const Index i = static_cast<Index>(std::floor(u)), j = static_cast<Index>(std::floor(v));
  const double a = u - i, b = v - j, h10 = vertex_of(field, i + 1, j).z, h01 = vertex_of(field, i, j + 1).z;
  if (a + b <= 1) return (1 - a - b) * vertex_of(field, i, j).z + a * h10 + b * h01;
  return (a + b - 1) * vertex_of(field, i + 1, j + 1).z + (1 - b) * h10 + (1 - a) * h01;
}

namespace {

/// What lengths of a map are rounded by [m].
double rounding_of(const HeightField& field) { return 1e-12 * (field.spacing_x + field.spacing_y); }

/// action(i, j) for the cells within `reach` of a point, where numbers say which those are.
template <class Action>
void each_cell_near(const HeightField& field, const Vec3<double>& c, double reach, const Action& action) {
  const double u = (c.x - field.origin_x) / field.spacing_x, v = (c.y - field.origin_y) / field.spacing_y;
  if (!(std::abs(u) < kFarOff && std::abs(v) < kFarOff)) return;
  const double du = std::min(reach / field.spacing_x, kMostCells), dv = std::min(reach / field.spacing_y, kMostCells);
  const auto first = [](double x) { return static_cast<Index>(std::floor(x)); };
  for (Index row = first(v - dv); row <= first(v + dv); ++row) {
    for (Index column = first(u - du); column <= first(u + du); ++column) action(column, row);
  }
}

/// Whether y points away from all neighbours of a point of the grid.
bool is_over_corner(const HeightField& field, Index i, Index j, const Vec3<double>& y, double allowance) {
  const Vec3<double> v = vertex_of(field, i, j);
  for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}) {
    if (dot(vertex_of(field, i + di, j + dj) - v, y) > allowance) return false;
  }
  return true;
}

/// Whether a straight edge leads through a point of the grid, level along y: its ends hold what lies on it.
bool is_within_edge(const HeightField& field, Index i, Index j, const Vec3<double>& y, double allowance) {
  const Vec3<double> v = vertex_of(field, i, j);
  const auto is_level = [&](int di, int dj) { return dot(vertex_of(field, i + di, j + dj) - v, y) > -allowance; };
  for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {-1, 1}}) {
    if (is_level(di, dj) && is_level(-di, -dj)) return true;
  }
  return false;
}

}  // namespace

TerrainFeatures::TerrainFeatures(const HeightField& field, const TerrainShape& shape)
    : field_(field), shape_(shape), c_(shape.center) {
  const double reach = std::max(shape.radius, shape.rim_radius) + 0.5 * std::min(field.spacing_x, field.spacing_y);
  is_inside_ = shape.radius == 0 || c_.z < height_below(field, c_.x, c_.y);
  each_cell_near(field, c_, reach, [&](Index i, Index j) { cell(i, j); });
  settle();
}

Vec3<double> TerrainFeatures::vertex(Index i, Index j) const { return vertex_of(field_, i, j); }

double TerrainFeatures::rounding() const { return rounding_of(field_); }

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
  if (over > rounding()) {
    // what is deep in a groove lies beyond its faces, whose planes hold it as long as they lie within the ground; a corner above a ridge meets
    // either of its faces
    const bool is_in_groove = shape_.radius == 0 && q.z <= height_below(field_, q.x, q.y) + rounding();
    if (!is_in_groove && !(is_corner() && gap > 0 && over < kOverhang * gap)) return;
  }
  add({FeatureKind::face, n, {}, c_ - a, gap, 1, (1.0 / 3) * (a + b + c), {}, {}});
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
    // of the end of a capsule what lies beside its axis belongs to its block
    if (y.z <= 0 || dot(left - e, y) > 0 || dot(right - e, y) > 0 || dot(y, shape_.axis) > 0) return;
    const double distance = std::sqrt(dot(y, y));
    add({FeatureKind::line, (1 / distance) * y, line, foot, distance - shape_.radius, 1, {}, {}, {}});
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
  const double x = std::min((std::abs(dot(line, shape_.axis)) - kPierces) / (kPiercesClearly - kPierces), 1.0);
  add({FeatureKind::pierced, scale * y, line, foot, scale * (at.length - shape_.rim_radius), x * x * (3 - 2 * x), {}, {}, {}});
}

void TerrainFeatures::corner(Index i, Index j, const Vec3<double>& v) {
  const Vec3<double> y = c_ - v;
  if (y.z <= 0) return;
  if (!is_over_corner(field_, i, j, y, 0) || dot(y, shape_.axis) > 0) return;
  const double distance = std::sqrt(dot(y, y));
  add({FeatureKind::line, (1 / distance) * y, {}, y, distance - shape_.radius, 1, {}, {}, {}});
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

BlockFeatures::BlockFeatures(const HeightField& field, const TerrainBlock& block) : field_(field), block_(block) {
  const auto& [x, y, z] = block.half;
  const double reach = std::sqrt(x * x + y * y + z * z) + block.radius;
  double lowest = block.center.z - block.radius;
  deepest_ = block.radius > 0 ? block.radius : reach;
  for (std::size_t k = 0; k < 3; ++k) {
    lowest -= block.half[k] * std::abs(block.axes[k].z);
    if (block.half[k] > 0) deepest_ = std::min(deepest_, block.radius > 0 ? block.radius : block.half[k]);
  }
  each_cell_near(field, block.center, reach, [&](Index i, Index j) {
    const Vec3<double> v00 = vertex_of(field, i, j), v10 = vertex_of(field, i + 1, j), v01 = vertex_of(field, i, j + 1),
                       v11 = vertex_of(field, i + 1, j + 1);
    if (lowest - kBlockReach > std::max({v00.z, v10.z, v01.z, v11.z})) return;
    ridge(v00, v10, v01, vertex_of(field, i + 1, j - 1));
    ridge(v00, v01, v10, vertex_of(field, i - 1, j + 1));
    ridge(v10, v01, v00, v11);
    peak(i, j);
  });
}

/// An edge of the terrain that turns down, and all lines of the block.
void BlockFeatures::ridge(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& left, const Vec3<double>& right) {
  const Vec3<double> over = linden::cross(b - a, right - a);
  const double up = over.z < 0 ? -1 : 1, size = std::sqrt(dot(over, over)), width = std::sqrt(dot(left - a, left - a));
  if (up * dot(left - a, over) > -kOnePlane * size * width) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // what stands under a box's upright edges is met by its corners
    if (block_.half[axis] == 0 || (block_.radius == 0 && std::abs(block_.axes[axis].z) > kFromAbove)) continue;
    const std::size_t second = (axis + 1) % 3, third = (axis + 2) % 3;
    for (const double s : {-1.0, 1.0}) {
      if (s > 0 && block_.half[second] == 0) continue;
      for (const double t : {-1.0, 1.0}) {
        if (t > 0 && block_.half[third] == 0) continue;
        cross((s * block_.half[second]) * block_.axes[second] + (t * block_.half[third]) * block_.axes[third], axis, a, b, left, right);
      }
    }
  }
}

/// The line at `from` along an axis. A box that overlaps a ridge less along its edge than across it is pushed back along it: by the face at
/// that end, so that a ridge comes under a box and leaves it without a jump.
void BlockFeatures::cross(const Vec3<double>& from, std::size_t axis, const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& left,
                          const Vec3<double>& right) {
  const Vec3<double> whole = b - a, foot = block_.center + from - a, &along = block_.axes[axis];
  const double length = std::sqrt(dot(whole, whole)), half = block_.half[axis];
  const Vec3<double> line = (1 / length) * whole, across = linden::cross(along, line);
  const double sine = std::sqrt(dot(across, across));
  if (sine <= kCrosses) return;
  const BlockTouch<double> touch = touch_block(BlockContact::crossing, along, line, foot, block_.radius, {0, 0, 1});
  const Vec3<double>& n = touch.normal;
  const double t = dot(foot + touch.arm, line), place = dot(touch.arm, along), level = 1e3 * rounding_of(field_);
  if (touch.gap < -deepest_ || t < 0 || t >= length) return;
  const Vec3<double> e = a + t * line;
  if (dot(left - e, n) > level || dot(right - e, n) > level) return;
  for (std::size_t k = 0; k < 3; ++k) {
    // from above no edge of a box is met, from a side either of those that a face lies between
    if (k != axis && dot(from, block_.axes[k]) * dot(n, block_.axes[k]) > kFromAbove * block_.half[k]) return;
  }
  const double x = std::min((sine - kCrosses) / (kCrossesClearly - kCrosses), 1.0), weight = x * x * (3 - 2 * x);
  const double beyond = std::abs(place) - half;
  if (block_.radius == 0 && touch.gap < 0 && beyond > touch.gap) {
    if (beyond > kBlockReach) return;
    const Vec3<double> into = (place < 0 ? 1 : -1) * along, end = from - half * into;
    add({FeatureKind::corner_on_face, into, {}, block_.center + end - e, beyond, weight, {}, into, end});
  } else if (beyond <= 0) {
    add({FeatureKind::crossing, n, line, foot, touch.gap, weight, {}, along, from});
  }
}

void BlockFeatures::peak(Index i, Index j) {
  const Vec3<double> v = vertex_of(field_, i, j), foot = block_.center - v;
  if (block_.radius > 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (block_.half[axis] == 0) continue;
      const Vec3<double>& along = block_.axes[axis];
      const BlockTouch<double> touch = touch_block(BlockContact::corner_on_line, along, {0, 0, 0}, foot, block_.radius, {0, 0, 1});
      if (std::abs(dot(along, foot)) > block_.half[axis] || touch.normal.z <= 0 || touch.gap < -deepest_) continue;
      if (is_over_corner(field_, i, j, touch.normal, 0)) add({FeatureKind::corner_on_line, touch.normal, {}, foot, touch.gap, 1, {}, along, {}});
    }
    return;
  }
  // the face of the box that the peak is least deep under
  double gap = -std::numeric_limits<double>::infinity();
  Vec3<double> into{}, down{0, 0, 0};
  double most_down = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double sense : {-1.0, 1.0}) {
      const Vec3<double> inward = sense * block_.axes[axis];
      const double over = dot(inward, foot) - block_.half[axis];
      if (over > gap) {
        gap = over;
        into = inward;
      }
      if (inward.z > most_down) {
        most_down = inward.z;
        down = inward;
      }
    }
  }
  const double level = 1e3 * rounding_of(field_);
  if (gap > kBlockReach || into.z < -kFromAbove || !is_over_corner(field_, i, j, down, level) || is_within_edge(field_, i, j, down, level)) return;
  const Vec3<double> from = (gap - dot(into, foot)) * into;
  add({FeatureKind::corner_on_face, into, {}, foot + from, gap, 1, {}, into, from});
}

/// Those with the smallest gaps, sorted by them.
void BlockFeatures::add(const TerrainFeature& feature) {
  int at = count_;
  while (at > 0 && found_[static_cast<std::size_t>(at - 1)].gap > feature.gap) --at;
  if (at == kBlockRanks) return;
  for (int k = std::min(count_, kBlockRanks - 1); k > at; --k) found_[static_cast<std::size_t>(k)] = found_[static_cast<std::size_t>(k - 1)];
  found_[static_cast<std::size_t>(at)] = feature;
  count_ = std::min(count_ + 1, kBlockRanks);
}

}  // namespace linden
