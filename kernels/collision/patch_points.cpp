#include "kernels/collision/patch_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/collision/directions.hpp"

namespace linden {
namespace {

constexpr double kOnePlace = 1e-9;  // of the smaller shape: nearer than this is the same place, and on an edge is inside

/// A place where they meet: x, and how far from it along n both surfaces are.
struct MeetingPlace {
  Vec3<double> x;
  double height_a, height_b;
  std::uint64_t feature;
};

std::uint64_t feature_pair(std::uint32_t a, std::uint32_t b) { return static_cast<std::uint64_t>(a) << 32 | b; }

/// A place of two points of a line: which of both it is.
constexpr std::uint32_t kUpperEnd = 1u << 31;

class MeetingPlaces {
 public:
  static constexpr std::size_t kMost = 256;

  /// smaller: size of the smaller shape; size: of the pair, which rounds places off.
  MeetingPlaces(const Vec3<double>& n, double smaller, double size) : n_(n), nothing_(std::max(kOnePlace * smaller, 4e-15 * size)) {
    directions_across(n, s_, t_);
  }

  /// What was there first stays: it has the simpler feature.
  void add(const Vec3<double>& x, double height_a, double height_b, std::uint64_t feature) {
    if (count == kMost) return;
    for (std::size_t k = 0; k < count; ++k) {
      if (flat_square(x - at[k].x) <= nothing_ * nothing_) return;
    }
    at[count++] = {x, height_a, height_b, feature};
  }

  double flat_square(const Vec3<double>& d) const {
    const double s = dot(d, s_), t = dot(d, t_);
    return s * s + t * t;
  }

  /// Four of them that hold as much as all.
  void reduce() {
    if (count <= 4) return;
    // a later one must be better than by rounding: places that lie as far stay the same from step to step
    const auto most = [&](auto&& value, double least) {
      std::size_t best = kMost;
      double largest = least;
      for (std::size_t k = 0; k < count; ++k) {
        const double v = value(at[k]);
        if (v > largest + 1e-6 * std::abs(largest)) largest = v, best = k;
      }
      return best;
    };
    std::array<std::size_t, 5> kept{};
    std::size_t kept_count = 0;
    const Vec3<double> middle = at[0].x;
    const auto offset = [&](const MeetingPlace& c, const Vec3<double>& from) { return c.x - from; };
    std::size_t first = 0;
    double farthest = 0;
    for (std::size_t k = 1; k < count; ++k) {
      const double far = dot(offset(at[k], middle), s_ + 0.37 * t_);  // along no side of what lies square
      if (far > farthest + nothing_) farthest = far, first = k;
    }
    kept[kept_count++] = first;
    const Vec3<double> from = at[first].x;
    const std::size_t second = most([&](const MeetingPlace& c) { return flat_square(offset(c, from)); }, nothing_ * nothing_);
    if (second < kMost) {
      kept[kept_count++] = second;
      const Vec3<double> along = at[second].x - from;
      const auto side = [&](const MeetingPlace& c) {
        const Vec3<double> d = offset(c, from);
        return dot(along, s_) * dot(d, t_) - dot(along, t_) * dot(d, s_);
      };
      const double least = nothing_ * std::sqrt(flat_square(along));
      const std::size_t left = most(side, least), right = most([&](const MeetingPlace& c) { return -side(c); }, least);
      if (left < kMost) kept[kept_count++] = left;
      if (right < kMost) kept[kept_count++] = right;
    }
    // the deepest stays, in the place of the one that is nearest to it
    std::size_t deepest = 0;
    for (std::size_t k = 1; k < count; ++k) {
      if (gap(at[k]) < gap(at[deepest])) deepest = k;
    }
    double shallowest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < kept_count; ++k) shallowest = std::min(shallowest, gap(at[kept[k]]));
    if (gap(at[deepest]) < shallowest - nothing_) {
      if (kept_count < 4) {
        kept[kept_count++] = deepest;
      } else {
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < 4; ++k) {
          if (flat_square(at[kept[k]].x - at[deepest].x) < flat_square(at[kept[nearest]].x - at[deepest].x)) nearest = k;
        }
        kept[nearest] = deepest;
      }
    }
    std::sort(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(kept_count));
    for (std::size_t k = 0; k < kept_count; ++k) at[k] = at[kept[k]];
    count = kept_count;
  }

  static double gap(const MeetingPlace& c) { return c.height_b - c.height_a; }

  std::array<MeetingPlace, kMost> at;
  std::size_t count = 0;
  Vec3<double> n_, s_, t_;
  double nothing_;
};

/// From x along n to the plane of a face or disc.
double height_of(const Feature& f, const Vec3<double>& n, const Vec3<double>& x) {
  const Vec3<double> on = f.kind == Feature::Kind::face ? f.corner[0] : f.center;
  return dot(on - x, f.normal) / dot(n, f.normal);
}

/// Whether a place lies over a face or disc, seen along n.
bool lies_over(const Feature& f, const Vec3<double>& n, const Vec3<double>& x, double slack) {
  if (f.kind == Feature::Kind::disc) {
    const Vec3<double> d = x + height_of(f, n, x) * n - f.center;
    return dot(d, d) <= (f.radius + slack) * (f.radius + slack);
  }
  const double turn = dot(n, f.normal) > 0 ? 1.0 : -1.0;
  for (std::size_t k = 0; k < f.count; ++k) {
    const Vec3<double> from = f.corner[k], side = f.corner[k + 1 < f.count ? k + 1 : 0] - from;
    const Vec3<double> inward = turn * cross(n, side);
    const double length = length_of(inward);
    if (dot(x - from, inward) < -slack * length) return false;
  }
  return true;
}

/// The part [low, high] of from + s along, s in [0, 1], that lies over a face or disc; which sides cut it off.
struct LineCut {
  double low = 0, high = 1;
  std::uint32_t low_id, high_id;
  bool empty() const { return !(low <= high); }
};

LineCut cut_line(const Feature& line, const Feature& f, const Vec3<double>& n, double slack) {
  LineCut cut{.low_id = line.corner_id[0], .high_id = line.corner_id[1]};
  const Vec3<double> from = line.corner[0], along = line.corner[1] - from;
  if (f.kind == Feature::Kind::disc) {
    const Vec3<double> start = from + height_of(f, n, from) * n - f.center;
    const Vec3<double> end = line.corner[1] + height_of(f, n, line.corner[1]) * n - f.center;
    const Vec3<double> d = end - start;
    const double dd = dot(d, d), half = -dot(start, d), outside = dot(start, start) - f.radius * f.radius;
    if (dd == 0) {
      if (outside > 2 * slack * f.radius) cut.high = -1;
      return cut;
    }
    const double root = half * half - dd * outside;
    if (root < 0) {
      // a rim that a line touches is met at one place
      const double at = half / dd;
      const Vec3<double> nearest = start + at * d;
      if (length_of(nearest) > f.radius + slack || at < 0 || at > 1) {
        cut.high = -1;
        return cut;
      }
      cut.low = cut.high = at;
      cut.low_id = cut.high_id = line.id;
      return cut;
    }
    const double low = (half - std::sqrt(root)) / dd, high = (half + std::sqrt(root)) / dd;
    const double spare = slack / std::sqrt(dd);
    if (low > spare) cut.low = low, cut.low_id = line.id;
    if (high < 1 - spare) cut.high = high, cut.high_id = line.id | kUpperEnd;
    return cut;
  }
  const double turn = dot(n, f.normal) > 0 ? 1.0 : -1.0;
  for (std::size_t k = 0; k < f.count; ++k) {
    const Vec3<double> corner = f.corner[k], side = f.corner[k + 1 < f.count ? k + 1 : 0] - corner;
    Vec3<double> inward = turn * cross(n, side);
    const double length = length_of(inward);
    if (length == 0) continue;
    inward = inward / length;
    const double at = dot(from - corner, inward), rise = dot(along, inward);
    if (at >= -slack && at + rise >= -slack) continue;  // all of it is inside
    if (at < -slack && at + rise < -slack) {
      cut.high = -1;
      return cut;
    }
    const double s = -at / rise;
    if (rise > 0 && s > cut.low) cut.low = s, cut.low_id = f.side_id[k] | kUpperEnd;
    if (rise < 0 && s < cut.high) cut.high = s, cut.high_id = f.side_id[k] | kUpperEnd;
  }
  // a corner that the line passes through
  if (cut.low > cut.high && (cut.low - cut.high) * length_of(along) <= slack) cut.low = cut.high = 0.5 * (cut.low + cut.high);
  return cut;
}

/// Seen along n from lines a to b: the shares of both where they are nearest, and of a how far they run side by side.
void line_line(const Feature& a, const Feature& b, double radius, MeetingPlaces& corners) {
  const Vec3<double> n = corners.n_;
  const Vec3<double> from_a = a.corner[0], from_b = b.corner[0];
  const Vec3<double> along_a = a.corner[1] - from_a, along_b = b.corner[1] - from_b;
  const auto flat = [&](const Vec3<double>& x) { return x - dot(x, n) * n; };
  const Vec3<double> u = flat(along_a), v = flat(along_b), d = flat(from_b - from_a);
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ud = dot(u, d), vd = dot(v, d);
  const Vec3<double> turned = cross(u, v);
  const double area = dot(turned, turned);  // uu vv sin^2
  const double sine = std::sqrt(area / (uu * vv));
  // nearest places of both lines in the plane
  const auto within = [](double x) { return std::clamp(x, 0.0, 1.0); };
  const double ends[2] = {ud / uu, (ud + uv) / uu};  // shares of a at the ends of b
  double s = area > 1e-24 * uu * vv ? within((ud * vv - vd * uv) / area)
                                    : 0.5 * (within(std::min(ends[0], ends[1])) + within(std::max(ends[0], ends[1])));
  double t = (s * uv - vd) / vv;
  if (t < 0 || t > 1) {
    t = within(t);
    s = within((ud + t * uv) / uu);
  }
  const auto add = [&](double share, std::uint32_t which) {
    const Vec3<double> on_a = from_a + share * along_a;
    const double other = within((share * uv - vd) / vv);
    const Vec3<double> on_b = from_b + other * along_b;
    const Vec3<double> x = 0.5 * (on_a + on_b);
    corners.add(x, dot(on_a - x, n), dot(on_b - x, n), feature_pair(a.id | which, b.id));
  };
  if (sine < kLinesParallel) {
    const double delta = kLinesApart * radius * (1 / sine - 1 / kLinesParallel) / std::sqrt(uu);  // infinite where they are parallel
    const double low = std::max(within(std::min(ends[0], ends[1])), std::isnan(delta) ? 0.0 : s - delta);
    const double high = std::min(within(std::max(ends[0], ends[1])), std::isnan(delta) ? 1.0 : s + delta);
    if ((high - low) * std::sqrt(uu) > corners.nothing_) {
      add(low, 0);
      add(high, kUpperEnd);
      return;
    }
  }
  add(s, 0);
}

void line_flat(const Feature& line, const Feature& f, bool line_is_a, MeetingPlaces& corners) {
  const Vec3<double> n = corners.n_;
  const LineCut cut = cut_line(line, f, n, corners.nothing_);
  if (cut.empty()) return;
  const auto add = [&](double share, std::uint32_t id) {
    const Vec3<double> x = line.corner[0] + share * (line.corner[1] - line.corner[0]);
    const double height = height_of(f, n, x);
    const bool on_side = id & kUpperEnd && f.kind == Feature::Kind::face;
    const std::uint32_t flat_id = on_side ? id : f.id, line_id = on_side ? line.id : id;
    if (line_is_a) corners.add(x, 0, height, feature_pair(line_id, flat_id));
    else corners.add(x, height, 0, feature_pair(flat_id, line_id));
  };
  add(cut.low, cut.low_id);
  add(cut.high, cut.high_id);
}

/// MeetingPlaces of one that lie over the other.
void corners_over(const Feature& f, const Feature& other, bool f_is_a, MeetingPlaces& corners) {
  const Vec3<double> n = corners.n_;
  const std::size_t count = f.kind == Feature::Kind::disc ? 4 : f.count;
  for (std::size_t k = 0; k < count; ++k) {
    Vec3<double> x;
    if (f.kind == Feature::Kind::disc) {
      const Vec3<double> out = k % 2 == 0 ? f.low : f.aside;
      x = f.center + (k < 2 ? f.radius : -f.radius) * out;
    } else {
      x = f.corner[k];
    }
    if (!lies_over(other, n, x, corners.nothing_)) continue;
    const double height = height_of(other, n, x);
    if (f_is_a) corners.add(x, 0, height, feature_pair(f.corner_id[k], other.id));
    else corners.add(x, height, 0, feature_pair(other.id, f.corner_id[k]));
  }
}

/// Where sides of faces cross.
void sides_cross(const Feature& a, const Feature& b, MeetingPlaces& corners) {
  const Vec3<double> n = corners.n_;
  for (std::size_t i = 0; i < a.count; ++i) {
    const Vec3<double> from = a.corner[i], along = a.corner[i + 1 < a.count ? i + 1 : 0] - from;
    for (std::size_t j = 0; j < b.count; ++j) {
      const Vec3<double> start = b.corner[j], side = b.corner[j + 1 < b.count ? j + 1 : 0] - start;
      const double area = dot(n, cross(along, side));
      if (std::abs(area) <= 1e-12 * length_of(along) * length_of(side)) continue;
      const Vec3<double> d = start - from;
      const double s = dot(n, cross(d, side)) / area, t = dot(n, cross(d, along)) / area;
      if (s < 0 || s > 1 || t < 0 || t > 1) continue;
      const Vec3<double> x = from + s * along;
      corners.add(x, 0, dot(start + t * side - x, n), feature_pair(a.side_id[i], b.side_id[j]));
    }
  }
}

/// Where the sides of a face cross the rim of a disc.
void sides_and_rim(const Feature& face, const Feature& disc, bool face_is_a, MeetingPlaces& corners) {
  const Vec3<double> n = corners.n_;
  Feature side;
  side.kind = Feature::Kind::line;
  for (std::size_t k = 0; k < face.count; ++k) {
    side.id = face.side_id[k];
    side.corner[0] = face.corner[k];
    side.corner[1] = face.corner[k + 1 < face.count ? k + 1 : 0];
    side.corner_id[0] = side.corner_id[1] = kUpperEnd;  // ends of the side are corners of the face: corners_over has them
    const LineCut cut = cut_line(side, disc, n, corners.nothing_);
    if (cut.empty()) continue;
    for (const bool high : {false, true}) {
      const std::uint32_t id = high ? cut.high_id : cut.low_id;
      if (id == kUpperEnd) continue;
      const double share = high ? cut.high : cut.low;
      const Vec3<double> x = side.corner[0] + share * (side.corner[1] - side.corner[0]);
      const double height = height_of(disc, n, x);
      if (face_is_a) corners.add(x, 0, height, feature_pair(id, disc.side_id[0]));
      else corners.add(x, height, 0, feature_pair(disc.side_id[0], id));
    }
  }
}

/// Where two rims cross, by Newton from where the circles would that they nearly are.
void rims_cross(const Feature& a, const Feature& b, MeetingPlaces& corners) {
  const Vec3<double> n = corners.n_;
  Vec3<double> d = b.center - a.center;
  d = d - dot(d, a.normal) * a.normal;
  const double apart = length_of(d);
  if (apart <= corners.nothing_ || apart >= a.radius + b.radius || apart <= std::abs(a.radius - b.radius)) return;
  const Vec3<double> e = d / apart, f = cross(a.normal, e);
  const double cosine = (apart * apart + a.radius * a.radius - b.radius * b.radius) / (2 * apart * a.radius);
  const double turn = std::acos(std::clamp(cosine, -1.0, 1.0));
  for (const double side : {-1.0, 1.0}) {
    double phi = side * turn;
    Vec3<double> x{};
    double miss = 0;
    for (int step = 0; step < 6; ++step) {
      const Vec3<double> out = std::cos(phi) * e + std::sin(phi) * f, along = a.radius * (std::cos(phi) * f - std::sin(phi) * e);
      x = a.center + a.radius * out;
      const Vec3<double> r = x + height_of(b, n, x) * n - b.center;
      const Vec3<double> moves = along - (dot(along, b.normal) / dot(n, b.normal)) * n;
      miss = dot(r, r) - b.radius * b.radius;
      const double slope = 2 * dot(r, moves);
      if (slope == 0 || std::abs(miss) <= 1e-14 * b.radius * b.radius) break;
      phi -= std::clamp(miss / slope, -0.2, 0.2);
    }
    if (std::abs(miss) > 1e-9 * b.radius * b.radius) continue;
    corners.add(x, 0, height_of(b, n, x), feature_pair(a.side_id[0] | (side > 0 ? kUpperEnd : 0), b.side_id[0]));
  }
}

void features_meet(const Feature& a, const Feature& b, double radius, MeetingPlaces& corners) {
  if (a.kind == Feature::Kind::line && b.kind == Feature::Kind::line) {
    line_line(a, b, radius, corners);
  } else if (a.kind == Feature::Kind::line) {
    line_flat(a, b, true, corners);
  } else if (b.kind == Feature::Kind::line) {
    line_flat(b, a, false, corners);
  } else {
    corners_over(a, b, true, corners);
    corners_over(b, a, false, corners);
    if (a.kind == Feature::Kind::face && b.kind == Feature::Kind::face) sides_cross(a, b, corners);
    else if (a.kind == Feature::Kind::face) sides_and_rim(a, b, true, corners);
    else if (b.kind == Feature::Kind::face) sides_and_rim(b, a, false, corners);
    else rims_cross(a, b, corners);
  }
}

/// From places of cores to points of the patch.
void finish_patch(MeetingPlaces& corners, double radius_a, double radius_b, double margin, ContactPatch& patch) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < corners.count; ++k) least = std::min(least, MeetingPlaces::gap(corners.at[k]));
  const double most = std::max(least, margin + radius_a + radius_b);  // the nearest stays, whatever rounding says of it
  std::size_t count = 0;
  for (std::size_t k = 0; k < corners.count; ++k) {
    if (MeetingPlaces::gap(corners.at[k]) <= most) corners.at[count++] = corners.at[k];
  }
  corners.count = count;
  corners.reduce();
  patch.count = static_cast<int>(corners.count);
  for (std::size_t k = 0; k < corners.count; ++k) {
    const MeetingPlace& c = corners.at[k];
    const double middle = 0.5 * (c.height_a + radius_a + c.height_b - radius_b);
    // none is nearer than the shapes are, but for what lies on an edge to rounding and is taken as inside
    patch.points[k] = {c.x + middle * patch.normal, std::max(MeetingPlaces::gap(c) - radius_a - radius_b, patch.distance), c.feature};
  }
  std::sort(patch.points.begin(), patch.points.begin() + patch.count,
            [](const PatchPoint& x, const PatchPoint& y) { return x.feature < y.feature; });
}

}  // namespace

void patch_points(const PlacedConvex& a, const PlacedConvex& b, double size, double margin, ContactPatch& patch) {
  const Vec3<double> n = patch.normal;
  const double radius_a = a.shape.radius, radius_b = b.shape.radius, distance = patch.distance + radius_a + radius_b;  // of the cores
  Feature on_a, on_b;
  feature_along(a, n, on_a);
  feature_along(b, -n, on_b);
  MeetingPlaces corners(n, std::min(core_reach(a.shape), core_reach(b.shape)), size);
  if (on_a.kind == Feature::Kind::point) {
    corners.add(on_a.corner[0], 0, distance, feature_pair(on_a.id, on_b.id));
  } else if (on_b.kind == Feature::Kind::point) {
    corners.add(on_b.corner[0], -distance, 0, feature_pair(on_a.id, on_b.id));
  } else {
    features_meet(on_a, on_b, (on_a.kind == Feature::Kind::line ? on_a.radius : 0) + (on_b.kind == Feature::Kind::line ? on_b.radius : 0), corners);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < corners.count; ++k) least = std::min(least, MeetingPlaces::gap(corners.at[k]));
    if (!(least <= distance + 1e-11 * size)) {
      // features that only graze each other: the support points, whose features these are
      const Vec3<double> x = 0.5 * (support(a, n) + support(b, -n));
      corners.add(x, -0.5 * distance, 0.5 * distance, feature_pair(on_a.id, on_b.id));
    }
  }
  finish_patch(corners, radius_a, radius_b, margin, patch);
}

void plane_points(double offset, const PlacedConvex& b, double size, double margin, ContactPatch& patch) {
  const Vec3<double> n = patch.normal;
  Feature on_b;
  feature_along(b, -n, on_b);
  MeetingPlaces corners(n, core_reach(b.shape), size);
  const std::size_t count = on_b.kind == Feature::Kind::disc ? 4 : on_b.count;
  for (std::size_t k = 0; k < count; ++k) {
    Vec3<double> x;
    if (on_b.kind == Feature::Kind::disc) {
      x = on_b.center + (k < 2 ? on_b.radius : -on_b.radius) * (k % 2 == 0 ? on_b.low : on_b.aside);
    } else {
      x = on_b.corner[k];
    }
    corners.add(x, offset - dot(n, x), 0, feature_pair(0, on_b.corner_id[k]));
  }
  finish_patch(corners, 0, b.shape.radius, margin, patch);
}

}  // namespace linden
