#include "kernels/collision/height_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kernels/collision/convex_pair.hpp"
#include "kernels/collision/directions.hpp"
#include "kernels/collision/patch_points.hpp"
#include "kernels/collision/separation.hpp"

namespace linden {
namespace {

constexpr double kFarthestCell = 1e8;       // cells from the map's first
constexpr double kSamePlane = 1e-9;    // sine between two faces from which on they are two
constexpr double kGoesOn = 0.25;      // of a cell: farther than this no face goes on over an edge
constexpr double kSlack = 1e-8;       // of shape and cell: what lies on an edge to this is on both of its sides
constexpr double kSameNormal = 1e-5;   // places with normals that differ by less are one
constexpr double kSamePlace = 1e-9;    // of the shape: and that are no farther apart
constexpr std::size_t kMostFound = 128;

/// Kinds of features of a field in the upper bits of their numbers; cells in the lower, 14 bits along x and y.
constexpr std::uint32_t kKindAt = 28, kCellBits = 14;
constexpr std::uint32_t kOfCorner = 0, kVertex = 1, kFirstEdge = 2;  // of the latter three a cell with two ends each

std::uint32_t name_of(std::uint32_t kind, Index i, Index j) {
  constexpr std::uint32_t kCell = (1u << kCellBits) - 1;
  return kind << kKindAt | (static_cast<std::uint32_t>(i) & kCell) << kCellBits | (static_cast<std::uint32_t>(j) & kCell);
}

/// What an id of a convex shape's feature is (placed_convex.cpp).
bool is_corner_id(std::uint32_t id) { return id >> 28 == 0; }
bool is_flat_id(std::uint32_t id) { return id >> 28 == 2 || id >> 28 == 4; }

struct Found {
  Vec3<double> normal, place;  // in the field's axes, from the shape's origin
  double gap;
  std::uint32_t of_field, of_shape;
  bool on_face = false;
};

class Meeting {
 public:
  /// The shape as seen from its own origin along the field's axes; where the field's first height lies from there.
  Meeting(const HeightField& field, const Vec3<double>& first, const ConvexShape& shape, const Mat3<double>& R, double margin)
      : field_(field), first_(first), shape_(shape), convex_{shape, R, {0, 0, 0}}, margin_(margin) {
    R.to(pose_.rotation.data());
    const Bounds bounds = bounds_of(shape, pose_);
    low_ = Vec3<double>::from(bounds.low.data());
    high_ = Vec3<double>::from(bounds.high.data());
    const double reach = core_reach(shape) + shape.radius;
    goes_on_ = std::min(margin, kGoesOn * std::min(field.spacing_x, field.spacing_y));
    slack_ = kSlack * (reach + field.spacing_x + field.spacing_y);
    size_ = reach + length_of(first);
    nothing_ = std::max(kSamePlace * reach, 4e-15 * size_);
  }

  void run() {
    const auto cell_of = [](double x, double spacing) { return std::floor(x / spacing); };
    const double i0 = cell_of(low_.x - margin_ - first_.x, field_.spacing_x), i1 = cell_of(high_.x + margin_ - first_.x, field_.spacing_x);
    const double j0 = cell_of(low_.y - margin_ - first_.y, field_.spacing_y), j1 = cell_of(high_.y + margin_ - first_.y, field_.spacing_y);
    if (!(std::abs(i0) < kFarthestCell && std::abs(i1) < kFarthestCell && std::abs(j0) < kFarthestCell && std::abs(j1) < kFarthestCell)) return;
    for (Index j = static_cast<Index>(j0); j <= static_cast<Index>(j1); ++j) {
      for (Index i = static_cast<Index>(i0); i <= static_cast<Index>(i1); ++i) cell(i, j);
    }
  }

  void finish(const Mat3<double>& field_R, const Vec3<double>& origin, HeightContacts& found) {
    reduce();
    name_corners();
    found.count = count_;
    for (std::size_t k = 0; k < count_; ++k) {
      const Found& one = found_[k];
      const std::uint64_t feature = static_cast<std::uint64_t>(one.of_field) << 32 | one.of_shape;
      found.at[k] = {field_R * one.normal, {origin + field_R * one.place, one.gap, feature}, one.on_face};
    }
    std::sort(found.at.begin(), found.at.begin() + static_cast<std::ptrdiff_t>(count_),
              [](const HeightContact& x, const HeightContact& y) { return x.point.feature < y.point.feature; });
  }

  std::size_t count() const { return count_; }

 private:
  double height(Index i, Index j) const {
    const auto column = static_cast<std::size_t>(std::clamp(i, Index{0}, field_.columns - 1));
    const auto row = static_cast<std::size_t>(std::clamp(j, Index{0}, field_.rows - 1));
    return field_.heights[row * static_cast<std::size_t>(field_.columns) + column];
  }
  Vec3<double> vertex(Index i, Index j) const { return {first_.x + i * field_.spacing_x, first_.y + j * field_.spacing_y, first_.z + height(i, j)}; }

  /// Of the surface, at a place.
  double height_below(const Vec3<double>& x) const {
    const double u = (x.x - first_.x) / field_.spacing_x, v = (x.y - first_.y) / field_.spacing_y;
    const Index i = static_cast<Index>(std::floor(u)), j = static_cast<Index>(std::floor(v));
    const double a = u - i, b = v - j, h10 = height(i + 1, j), h01 = height(i, j + 1);
    if (a + b <= 1) return first_.z + (1 - a - b) * height(i, j) + a * h10 + b * h01;
    return first_.z + (a + b - 1) * height(i + 1, j + 1) + (1 - b) * h10 + (1 - a) * h01;
  }

  /// Of the lower or upper triangle of a cell.
  Vec3<double> normal(Index i, Index j, bool upper) const {
    const double corner = upper ? height(i + 1, j + 1) : height(i, j), sense = upper ? -1 : 1;
    const double x = sense * ((upper ? height(i, j + 1) : height(i + 1, j)) - corner) / field_.spacing_x;
    const double y = sense * ((upper ? height(i + 1, j) : height(i, j + 1)) - corner) / field_.spacing_y;
    const double length = std::sqrt(1 + x * x + y * y);
    return {-x / length, -y / length, 1 / length};
  }

  void cell(Index i, Index j) {
    const Vec3<double> v00 = vertex(i, j), v10 = vertex(i + 1, j), v01 = vertex(i, j + 1), v11 = vertex(i + 1, j + 1);
    if (low_.z - margin_ > std::max({v00.z, v10.z, v01.z, v11.z})) return;
    const Vec3<double> lower = normal(i, j, false), upper = normal(i, j, true);
    face({v00, v10, v01}, {vertex(i + 1, j - 1), v11, vertex(i - 1, j + 1)}, lower);
    face({v11, v01, v10}, {vertex(i, j + 2), v00, vertex(i + 2, j)}, upper);
    edge(v00, v10, lower, normal(i, j - 1, true), vertex(i + 1, j - 1), i, j, 0);
    edge(v00, v01, lower, normal(i - 1, j, true), vertex(i - 1, j + 1), i, j, 1);
    edge(v10, v01, lower, upper, v11, i, j, 2);
    peak(v00, i, j);
  }

  /// Distance of the shape along a normal from a plane through a point.
  double distance_over(const Vec3<double>& n, const Vec3<double>& at) const { return dot(n, support(convex_, -n) - at) - shape_.radius; }

  /// Whether x lies straight over a triangle, or below it.
  bool is_over(const Vec3<double>& x, const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& c) const {
    const auto left = [&](const Vec3<double>& from, const Vec3<double>& to) {
      const Vec3<double> d = x - from, along = to - from;
      return along.x * d.y - along.y * d.x >= -slack_ * std::hypot(along.x, along.y);
    };
    return left(a, b) && left(b, c) && left(c, a);
  }

  /// Whether the place of a triangle's plane that is nearest to x is one of the triangle; of what is below it whether it is straight below.
  bool faces(const Vec3<double>& x, const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& c) const {
    const Vec3<double> n = unit(cross(b - a, c - a));
    return is_over(x - std::max(0.0, dot(n, x - a)) * n, a, b, c);
  }

  /// Corners anticlockwise; `beyond`, the third of the neighbour across the edge from each to the next.
  void face(const std::array<Vec3<double>, 3>& corner, const std::array<Vec3<double>, 3>& beyond, const Vec3<double>& n) {
    if (!(n.x == last_.x && n.y == last_.y && n.z == last_.z)) {
      last_ = n;
      last_reach_ = dot(n, support(convex_, -n)) - shape_.radius;
      has_feature_ = false;
    }
    if (last_reach_ - dot(n, corner[0]) > margin_) return;
    if (!has_feature_) feature_along(convex_, -n, feature_);
    has_feature_ = true;
    std::array<Vec3<double>, 3> inward;
    std::array<bool, 3> goes_on;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3<double> along = corner[(k + 1) % 3] - corner[k];
      inward[k] = cross(n, along);
      inward[k] = inward[k] / length_of(inward[k]);
      const Vec3<double> over = beyond[k] - corner[k];
      goes_on[k] = dot(n, over) > kSamePlane * length_of(over);
    }
    const bool is_disc = feature_.kind == Feature::Kind::disc;
    const std::size_t count = is_disc ? 4 : feature_.count;
    for (std::size_t c = 0; c < count; ++c) {
      const Vec3<double> rim = (c < 2 ? feature_.radius : -feature_.radius) * (c % 2 == 0 ? feature_.low : feature_.aside);
      const Vec3<double> x = is_disc ? feature_.center + rim : feature_.corner[c];
      const double core = dot(n, x - corner[0]), gap = core - shape_.radius;
      if (gap > margin_) continue;
      // what lies above the surface is not inside of a face that goes on over it
      if (core < 0 && x.z > height_below(x)) continue;
      bool over = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const double inside = dot(x - corner[k], inward[k]);
        const bool may_go_on = goes_on[k] && inside >= -goes_on_ && inside < 0 && faces(x, corner[(k + 1) % 3], corner[k], beyond[k]);
        over = over && (inside >= -slack_ || may_go_on);
      }
      const bool above = is_over(x, corner[0], corner[1], corner[2]);
      if (!over && !(above && (shape_.radius == 0 || core <= 0))) continue;
      add({n, x - (shape_.radius + 0.5 * gap) * n, gap, kOfCorner << kKindAt, feature_.corner_id[c], true});
    }
  }

  /// From p to q, between a face with normal n and one with normal m and the vertex `beyond`.
  void edge(const Vec3<double>& p, const Vec3<double>& q, const Vec3<double>& n, const Vec3<double>& m, const Vec3<double>& beyond, Index i, Index j,
            std::uint32_t which) {
    const Vec3<double> over = beyond - p;
    if (!(dot(n, over) < -kSamePlane * length_of(over))) return;
    if (distance_over(n, p) > margin_ || distance_over(m, p) > margin_) return;
    const Vec3<double> d = q - p;
    const double length = length_of(d);
    const Vec3<double> along = d / length, middle = 0.5 * (p + q), axis = unit(cross(n, m));
    // a segment along z of its own
    ConvexShape line{.kind = ConvexKind::segment, .half = {0, 0, 0.5 * length}};
    Vec3<double> s, t;
    directions_across(along, s, t);
    Pose pose;
    for (std::size_t row = 0; row < 3; ++row) {
      const auto of = [row](const Vec3<double>& v) { return row == 0 ? v.x : row == 1 ? v.y : v.z; };
      pose.rotation[3 * row] = of(s), pose.rotation[3 * row + 1] = of(t), pose.rotation[3 * row + 2] = of(along);
      pose.shift[row] = of(middle);
    }
    ContactPatch patch = contact_patch(line, pose, shape_, pose_, margin_);
    if (patch.count == 0) return;
    Vec3<double> to = patch.normal - dot(patch.normal, along) * along;
    const bool fits = dot(to, to) > 1 - kFacing * kFacing;
    to = fits ? unit(to) : to;
    // sines by which it lies beyond one of both
    const double before = fits ? -dot(cross(n, to), axis) : 1, after = fits ? -dot(cross(to, m), axis) : 1;
    const double apart = patch.distance;
    const bool deep = apart + shape_.radius <= 0, turned_in = fits && std::max(before, after) > 0;
    if (fits && dot(to, n + m) > 0 && std::max(before, after) <= kFacing) {
      if (before > 0) to = n;
      else if (after > 0) to = m;
    } else if (deep) {
      to = best_between(n, m, p);
    } else {
      return;
    }
    const PlacedConvex segment{line, Mat3<double>::from(pose.rotation.data()), middle};
    patch.normal = to;
    patch.distance = distance_along(segment, convex_, to) - shape_.radius;
    if (patch.distance > margin_) return;
    patch.count = 0;
    patch_points(segment, convex_, length_of(middle) + 0.5 * length + core_reach(shape_), margin_, patch);
    // two places of lines that are nearly parallel lie beside them both
    const double round = shape_.radius + (shape_.kind == ConvexKind::cylinder ? shape_.half[0] : 0);
    const double off = std::max(1e2 * slack_, turned_in ? 0 : kLinesApart * round);
    std::uint32_t end = 0;
    std::array<double, 2> share{};
    std::array<std::size_t, 2> chosen{};
    for (std::size_t k = 0; k < static_cast<std::size_t>(patch.count) && end < 2; ++k) {
      const Vec3<double> from = patch.points[k].place - (0.5 * patch.points[k].gap) * to - p;
      const double at = dot(from, along);
      const Vec3<double> aside = from - at * along;
      if (at < -slack_ || at > length + slack_ || dot(aside, aside) > off * off) continue;  // not of this edge
      if (apart > 0 && patch.points[k].gap < std::sqrt(1 - kFacing * kFacing) * apart) continue;  // nor of what is nearest to it
      share[end] = at;
      chosen[end++] = k;
    }
    const bool turned = end == 2 && share[1] < share[0];
    for (std::uint32_t k = 0; k < end; ++k) {
      const PatchPoint& point = patch.points[chosen[k]];
      const auto of_shape = static_cast<std::uint32_t>(point.feature);
      const std::uint32_t kind = kFirstEdge + 2 * which + ((k == 1) != turned ? 1 : 0);
      if (is_corner_id(of_shape)) add({to, point.place, point.gap, kOfCorner << kKindAt, of_shape});
      else add({to, point.place, point.gap, name_of(kind, i, j), 0});
    }
  }

  /// The normal between two along which the shape is the least deep over an edge through p.
  Vec3<double> best_between(const Vec3<double>& n, const Vec3<double>& m, const Vec3<double>& p) const {
    const auto at = [&](double share) { return unit((1 - share) * n + share * m); };
    const auto value = [&](double share) { return distance_over(at(share), p); };
    constexpr int kTried = 16;
    double best = 0, most = value(0);
    for (int k = 1; k <= kTried; ++k) {
      const double v = value(k / double(kTried));
      if (v > most) most = v, best = k / double(kTried);
    }
    for (double step = 0.5 / kTried; step > 1e-12; step *= 0.5) {
      for (const double share : {best - step, best + step}) {
        if (share < 0 || share > 1) continue;
        const double v = value(share);
        if (v > most) most = v, best = share;
      }
    }
    return at(best);
  }

  void peak(const Vec3<double>& v, Index i, Index j) {
    const std::array<Vec3<double>, 6> normals{normal(i, j, false), normal(i - 1, j, true), normal(i - 1, j, false),
                                              normal(i - 1, j - 1, true), normal(i, j - 1, false), normal(i, j - 1, true)};
    std::array<Vec3<double>, 6> out{vertex(i + 1, j) - v, vertex(i, j + 1) - v, vertex(i - 1, j + 1) - v, vertex(i - 1, j) - v, vertex(i, j - 1) - v,
                                    vertex(i + 1, j - 1) - v};
    for (Vec3<double>& d : out) d = unit(d);
    Vec3<double> up;
    if (!is_peak(out, up)) return;
    for (const Vec3<double>& n : normals) {
      if (distance_over(n, v) > margin_) return;
    }
    const auto outside = [&](const Vec3<double>& n) {
      double most = -1;
      for (const Vec3<double>& d : out) most = std::max(most, dot(n, d));
      return most;
    };
    const Pose at{.shift = {v.x, v.y, v.z}};
    const ContactPatch patch = contact_patch(ConvexShape{}, at, shape_, pose_, margin_);
    if (patch.count == 0) return;
    const PatchPoint& point = patch.points[0];
    auto of_shape = static_cast<std::uint32_t>(point.feature);
    Vec3<double> to = patch.normal;
    double gap = patch.distance;
    if (outside(to) > (is_flat_id(of_shape) && to.z > 0 ? kFacing : kSamePlane)) {
      if (gap + shape_.radius > 0) return;
      // deep beside a side of the shape: what of it faces the peak
      Feature facing;
      feature_along(convex_, -up, facing);
      const bool flat = facing.kind == Feature::Kind::face || facing.kind == Feature::Kind::disc;
      to = flat && outside(-facing.normal) <= kFacing ? -facing.normal : up;
      gap = distance_over(to, v);
      of_shape = facing.id;
      if (gap > margin_) return;
    }
    const Vec3<double> place = v + (0.5 * gap) * to;
    if (is_corner_id(of_shape)) add({to, place, gap, kOfCorner << kKindAt, of_shape});
    else add({to, place, gap, name_of(kVertex, i, j), 0});
  }

  /// Whether there are normals along which all of these directions lead down, and not along one line or in one plane alone; one of them.
  static bool is_peak(const std::array<Vec3<double>, 6>& out, Vec3<double>& up) {
    // of normals (x, y, 1) the corners of what all allow: where two of them are level
    Vec3<double> sum{0, 0, 0};
    bool any = false;
    for (std::size_t a = 0; a < 6; ++a) {
      for (std::size_t b = a + 1; b < 6; ++b) {
        const double area = out[a].x * out[b].y - out[a].y * out[b].x;
        if (std::abs(area) < 1e-12) continue;
        const double level_a = -kSamePlane - out[a].z, level_b = -kSamePlane - out[b].z;
        const Vec3<double> n{(level_a * out[b].y - level_b * out[a].y) / area, (level_b * out[a].x - level_a * out[b].x) / area, 1};
        bool down = true;
        for (const Vec3<double>& d : out) down = down && dot(n, d) <= -0.5 * kSamePlane;
        if (down) sum += unit(n), any = true;
      }
    }
    if (any) up = unit(sum);
    return any;
  }

  static Vec3<double> unit(const Vec3<double>& a) { return a / length_of(a); }
  static double square(const Vec3<double>& a) { return dot(a, a); }

  void add(const Found& one) {
    for (std::size_t k = 0; k < count_; ++k) {
      Found& other = found_[k];
      if (square(one.normal - other.normal) > kSameNormal * kSameNormal || square(one.place - other.place) > nothing_ * nothing_) continue;
      const bool on_face = one.on_face || other.on_face;
      if (one.gap < other.gap - nothing_) other = one;
      other.on_face = on_face;
      return;
    }
    if (count_ < kMostFound) {
      found_[count_++] = one;
      return;
    }
    const auto shallowest = std::max_element(found_.begin(), found_.end(), [](const Found& x, const Found& y) { return x.gap < y.gap; });
    if (one.gap < shallowest->gap) *shallowest = one;
  }

  /// The deepest, and then each time that which is farthest from all before, in place beside the shape and in normal.
  void reduce() {
    if (count_ <= kMostHeightContacts) return;
    const double reach = core_reach(shape_) + shape_.radius;
    std::array<double, kMostFound> apart;
    std::fill_n(apart.begin(), count_, std::numeric_limits<double>::infinity());
    std::size_t next = 0;
    for (std::size_t k = 1; k < count_; ++k) {
      if (found_[k].gap < found_[next].gap - nothing_) next = k;
    }
    for (std::size_t kept = 0; kept < kMostHeightContacts; ++kept) {
      std::swap(found_[kept], found_[next]);
      std::swap(apart[kept], apart[next]);
      next = kept + 1;
      for (std::size_t k = kept + 1; k < count_; ++k) {
        apart[k] = std::min(apart[k], square(found_[k].place - found_[kept].place) / (reach * reach) + square(found_[k].normal - found_[kept].normal));
        if (apart[k] > 1.000001 * apart[next]) next = k;
      }
    }
    count_ = kMostHeightContacts;
  }

  /// Those that one corner has are counted in the order of their normals.
  void name_corners() {
    const auto end = found_.begin() + static_cast<std::ptrdiff_t>(count_);
    std::sort(found_.begin(), end, [](const Found& x, const Found& y) {
      if (x.of_field >> kKindAt != y.of_field >> kKindAt) return x.of_field >> kKindAt < y.of_field >> kKindAt;
      if (x.of_shape != y.of_shape) return x.of_shape < y.of_shape;
      if (x.normal.x != y.normal.x) return x.normal.x < y.normal.x;
      return x.normal.y < y.normal.y;
    });
    for (std::size_t k = 1; k < count_; ++k) {
      Found& one = found_[k];
      const Found& before = found_[k - 1];
      if (one.of_field >> kKindAt == kOfCorner && before.of_field >> kKindAt == kOfCorner && one.of_shape == before.of_shape) one.of_field = before.of_field + 1;
    }
  }

  const HeightField& field_;
  const Vec3<double> first_;
  const ConvexShape& shape_;
  const PlacedConvex convex_;
  const double margin_;
  Pose pose_{};
  Vec3<double> low_{}, high_{};
  double goes_on_, slack_, size_, nothing_;
  Vec3<double> last_{0, 0, 0};  // normal of the face before, and what was found along it
  double last_reach_ = 0;
  bool has_feature_ = false;
  Feature feature_;
  std::array<Found, kMostFound> found_;
  std::size_t count_ = 0;
};

Meeting meeting_of(const HeightField& field, const Pose& pose, const ConvexShape& shape, const Pose& pose_of_shape, double margin) {
  const Mat3<double> R = Mat3<double>::from(pose.rotation.data());
  const Vec3<double> origin{field.origin_x, field.origin_y, 0};
  const Vec3<double> apart = Vec3<double>::from(pose.shift.data()) - Vec3<double>::from(pose_of_shape.shift.data());
  Meeting meeting(field, origin + transpose_times(R, apart), shape, transpose(R) * Mat3<double>::from(pose_of_shape.rotation.data()), margin);
  meeting.run();
  return meeting;
}

}  // namespace

void height_contacts(const HeightField& field, const Pose& pose, const ConvexShape& shape, const Pose& pose_of_shape, double margin, HeightContacts& found) {
  Meeting meeting = meeting_of(field, pose, shape, pose_of_shape, margin);
  meeting.finish(Mat3<double>::from(pose.rotation.data()), Vec3<double>::from(pose_of_shape.shift.data()), found);
}

bool are_near(const ConvexShape& a, const Pose& pose_a, const ConvexShape& b, const Pose& pose_b, double margin) {
  if (a.heights) return meeting_of(*a.heights, pose_a, b, pose_b, margin).count() > 0;
  if (b.heights) return meeting_of(*b.heights, pose_b, a, pose_a, margin).count() > 0;
  return contact_patch(a, pose_a, b, pose_b, margin).count > 0;
}

}  // namespace linden
