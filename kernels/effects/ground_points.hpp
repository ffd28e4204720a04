// kernels/effects/ground_points.hpp
// The contact points of the ground (ground.hpp): what is kept of each, and where they are over plane or terrain when a step begins.
#pragma once

#include "kernels/effects/contact_geometry.hpp"
#include "kernels/effects/ground_plan.hpp"
#include "kernels/effects/terrain.hpp"

namespace linden {

/// Gap of a point that no feature of a terrain is near [m].
inline constexpr double kNothingNear = 1e6;

/// Tilt from which on the lowest place of a disc goes by its tilt alone, and below which by where it was at k.
inline constexpr double kClearTilt = 1e-2;

#define LINDEN_GROUND_POINT_FIELDS(FIELD)                                                             \
  FIELD(Scalar, center, 3, slots, "of the sphere or circle, body frame [m]")                         \
  FIELD(Scalar, normal, 3, slots, "of the ground, body frame at k")                                   \
  FIELD(Scalar, arm, 3, slots, "o: from the centre to where the shapes touch, likewise [m]")          \
  FIELD(Scalar, gap, 1, slots, "of the shape over the ground at k, below zero inside [m]")            \
  FIELD(Scalar, clearance, 1, slots, "gap of it in any attitude, at k [m]")                           \
  FIELD(Scalar, kind, 1, slots, "FeatureKind of a terrain's feature")                                 \
  FIELD(Scalar, line, 3, slots, "direction of an edge of the terrain, body frame at k")               \
  FIELD(Scalar, foot, 3, slots, "from a point of an edge or corner to the centre, likewise [m]")      \
  FIELD(Scalar, along, 3, slots, "of a block: direction of its line, normal of its face into it")     \
  FIELD(Scalar, weight, 1, slots, "share of stiffness and damping that counts on a terrain")          \
  FIELD(Scalar, slip, 3, slots, "t of the evaluation last made, body frame at k [m]")                 \
  FIELD(Scalar, slip_before, 3, slots, "t of the evaluation before")                                  \
  FIELD(Scalar, slides, 1, slots, "1 slides, 0 sticks")                                               \
  FIELD(Scalar, closed, 1, slots, "1 where the ground pushes, in the evaluation last made")           \
  FIELD(Scalar, factored, 1, slots, "closed, as the factor has it")                                   \
  FIELD(Scalar, load, 1, slots, "force of sticking as a share of what friction can, likewise")        \
  FIELD(Scalar, push, 1, slots, "N, likewise [N]")                                                    \
  FIELD(Scalar, drag, 3, slots, "F_t, likewise, body frame at k [N]")                                 \
  FIELD(Scalar, rise, 1, slots, "of the gap, likewise: what N works along [m]")                                      \
  FIELD(Scalar, opening, 6, slots, "gradient of the gap at k+1, likewise: moment, force, body frame") \
  FIELD(Scalar, place, 3, slots, "where the shapes touch at k+1, likewise, body frame [m]")           \
  FIELD(Scalar, sunk, 1, slots, "share of stiffness x square of the depth at k+1, of the evaluation last made [m^2]") \
  FIELD(Scalar, bore, 1, slots, "the same of the last step, -1 not in the ground, 0 nothing is known")               \
  FIELD(Scalar, rise_before, 1, slots, "of the last step [m]")                                        \
  FIELD(Scalar, slip_last, 3, slots, "t of the last step [m]")

/// Rows are contact points: allocate({.slots = points}).
template <class Scalar>
struct GroundPoints {
  LINDEN_FIELDS(LINDEN_GROUND_POINT_FIELDS)
};

template <class S>
LINDEN_INLINE Vec3<S> spread3(const std::array<double, 3>& a) {
  return {as<S>(a[0]), as<S>(a[1]), as<S>(a[2])};
}

template <class S>
LINDEN_INLINE Vec3<S> select3(const auto& condition, const Vec3<S>& yes, const Vec3<S>& no) {
  return {select(condition, yes.x, no.x), select(condition, yes.y, no.y), select(condition, yes.z, no.z)};
}

/// Number l of a Scalar.
template <class S>
LINDEN_INLINE double lane_of(const S& x, std::size_t l) {
  if constexpr (std::is_arithmetic_v<S>) {
    return static_cast<double>(x);
  } else {
    using Real = typename ElementOf<S>::type;
    std::array<Real, sizeof(S) / sizeof(Real)> each;
    x.store_unaligned(each.data());
    return static_cast<double>(each[l]);
  }
}

template <class S>
LINDEN_INLINE Vec3<double> lane_of(const Vec3<S>& a, std::size_t l) {
  return {lane_of(a.x, l), lane_of(a.y, l), lane_of(a.z, l)};
}

/// A Scalar of number(l).
template <class S, class Number>
LINDEN_INLINE S of_lanes(const Number& number) {
  using Real = typename ElementOf<S>::type;
  if constexpr (std::is_arithmetic_v<S>) {
    return static_cast<Real>(number(0));
  } else {
    std::array<Real, sizeof(S) / sizeof(Real)> each;
    for (std::size_t l = 0; l < each.size(); ++l) each[l] = static_cast<Real>(number(l));
    return S::load_unaligned(each.data());
  }
}

/// From the centre of a rim to the place that a point of it stands for. `toward_highest`: of the disc, of any length.
template <class S>
LINDEN_INLINE Vec3<S> rim_arm(const GroundPoint& point, const Vec3<S>& toward_highest) {
  using std::sqrt;
  const S zero(0.0), one(1.0);
  const Vec3<S> axis = spread3<S>(point.axis);
  // upright on the plane any direction is the lowest
  const Vec3<S> helper = point.axis[0] * point.axis[0] < 0.5 ? Vec3<S>{one, zero, zero} : Vec3<S>{zero, one, zero};
  const Vec3<S> across = toward_highest + as<S>(kFlat) * (helper - dot(helper, axis) * axis);
  const Vec3<S> high = (one / sqrt(dot(across, across))) * across;
  const Vec3<S> side = point.quarter % 2 == 0 ? high : cross(axis, high);
  return as<S>(point.quarter < 2 ? -point.rim_radius : point.rim_radius) * side;
}

/// Writes a point whose normal, gap of the centre over it (`level`) and axis are known: what lies flat on one plane.
template <class S>
LINDEN_INLINE void place_on_plane(const GroundPoint& point, Index k, const Vec3<S>& n, const S& level, GroundPoints<S>& points) {
  using std::sqrt;
  store(points.normal, k, n);
  if (point.rim_radius > 0) {
    const Vec3<S> axis = spread3<S>(point.axis), up = n - dot(n, axis) * axis;
    const S tilt = sqrt(dot(up, up) + as<S>(kFlat * kFlat));
    store(points.arm, k, rim_arm(point, up));
    points.gap(k) = point.quarter % 2 == 1 ? level : level + as<S>(point.quarter == 0 ? -point.rim_radius : point.rim_radius) * tilt;
    points.clearance(k) = point.quarter % 2 == 1 ? level : level - as<S>(point.rim_radius);
  } else {
    store(points.arm, k, as<S>(-point.radius) * n);
    points.gap(k) = points.clearance(k) = level - as<S>(point.radius);
  }
}

/// Features of the terrain near a candidate, in each lane.
template <class S>
class NearFeatures {
 public:
  /// x: its centre, frame: the body's axes, both in the plane's frame.
  NearFeatures(const GroundPlan& plan, const GroundPoint& point, const Vec3<S>& x, const Mat3<S>& frame) {
    const HeightField& field = *plan.ground.terrain;
    const auto keep = [&](std::size_t l, const auto& features) {
      counts_[l] = features.count();
      for (int rank = 0; rank < features.count(); ++rank) features_[l][static_cast<std::size_t>(rank)] = features[rank];
    };
    for (std::size_t l = 0; l < kLanes; ++l) {
      counts_[l] = 0;
      const Vec3<double> center = lane_of(x, l);
      if (!(center.z - extent(plan, point) < plan.highest + kFarAbove)) continue;
      const Mat3<double> axes{lane_of(frame.x, l), lane_of(frame.y, l), lane_of(frame.z, l)};
      const auto direction = [&](const std::array<double, 3>& a) { return axes * Vec3<double>{a[0], a[1], a[2]}; };
      if (point.block < 0) {
        keep(l, TerrainFeatures(field, {center, point.radius, direction(point.axis), point.rim_radius}));
      } else {
        const ContactBlock& block = plan.ground.contacts.blocks[static_cast<std::size_t>(point.block)];
        const std::array<Vec3<double>, 3> turned{direction(block.axes[0]), direction(block.axes[1]), direction(block.axes[2])};
        keep(l, BlockFeatures(field, {center, turned, block.half, block.radius}));
      }
    }
  }

  /// Of one rank: part(feature), or what there is where none is near.
  template <class Part>
  S number(int rank, const Part& part, double none) const {
    return of_lanes<S>([&](std::size_t l) { return rank < counts_[l] ? part(features_[l][static_cast<std::size_t>(rank)]) : none; });
  }
  template <class Part>
  Vec3<S> vector(int rank, const Part& part, const Vec3<double>& none) const {
    return {number(rank, [&](const TerrainFeature& f) { return part(f).x; }, none.x),
            number(rank, [&](const TerrainFeature& f) { return part(f).y; }, none.y),
            number(rank, [&](const TerrainFeature& f) { return part(f).z; }, none.z)};
  }

 private:
  static constexpr std::size_t kLanes = sizeof(S) / sizeof(typename ElementOf<S>::type);

  static double extent(const GroundPlan& plan, const GroundPoint& point) {
    if (point.block < 0) return std::max(point.radius, point.rim_radius);
    const std::array<double, 3>& half = plan.ground.contacts.blocks[static_cast<std::size_t>(point.block)].half;
    return std::sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]) + point.radius;
  }

  std::array<std::array<TerrainFeature, std::max(kTerrainRanks, kBlockRanks)>, kLanes> features_;
  std::array<int, kLanes> counts_;
};

/// Writes a point of a candidate from its features; `to_body` takes the plane's frame to the body's.
template <class S>
void place_on_terrain(const GroundPoint& point, Index k, const NearFeatures<S>& near, const Mat3<S>& to_body, GroundPoints<S>& points) {
  const S zero(0.0);
  const Vec3<double> nowhere{0, 0, 0};
  const auto kind = [](const TerrainFeature& f) { return static_cast<double>(f.kind); };
  const Vec3<S> n = to_body * near.vector(point.rank, [](const TerrainFeature& f) { return f.normal; }, {0, 0, 1});
  const Vec3<S> foot = to_body * near.vector(point.rank, [](const TerrainFeature& f) { return f.foot; }, nowhere);
  store(points.line, k, to_body * near.vector(point.rank, [](const TerrainFeature& f) { return f.line; }, nowhere));
  store(points.foot, k, foot);
  points.kind(k) = near.number(point.rank, kind, 0);
  points.weight(k) = near.number(point.rank, [](const TerrainFeature& f) { return f.weight; }, 0);
  place_on_plane(point, k, n, dot(n, foot), points);
  const auto on_face = points.kind(k) == zero, nothing = points.weight(k) == zero;
  const S gap = near.number(point.rank, [](const TerrainFeature& f) { return f.gap; }, kNothingNear);
  // of a rim on an edge only the lowest point is there
  const S elsewhere = point.quarter == 0 ? gap : as<S>(kNothingNear);
  points.gap(k) = select(nothing, as<S>(kNothingNear), select(on_face, points.gap(k), elsewhere));
  points.clearance(k) = select(nothing || !on_face, points.gap(k), points.clearance(k));
  if (point.rim_radius > 0 && point.quarter == 0) {
    const auto pierced = points.kind(k) == as<S>(static_cast<double>(FeatureKind::pierced));
    if (any(pierced)) {
      const CircleAndLine<S> at(load<Vec3, S>(points.line, k), foot, spread3<S>(point.axis));
      const auto arm = load<Vec3, S>(points.arm, k);
      store(points.arm, k, Vec3<S>{select(pierced, at.v.x, arm.x), select(pierced, at.v.y, arm.y), select(pierced, at.v.z, arm.z)});
    }
  }
}

/// How the line or face of a block touches its feature, of each lane its own kind.
template <class S>
BlockTouch<S> touch_at(const GroundPoint& point, Index k, const GroundPoints<S>& points, const Vec3<S>& along, const Vec3<S>& foot) {
  const S zero(0.0);
  const auto line = load<Vec3, S>(points.line, k), toward = load<Vec3, S>(points.normal, k);
  BlockTouch<S> touch{as<S>(kNothingNear), toward, {zero, zero, zero}};
  for (const BlockContact contact : {BlockContact::crossing, BlockContact::corner_on_line, BlockContact::corner_on_face}) {
    const auto is = points.kind(k) == as<S>(static_cast<double>(FeatureKind::crossing) + static_cast<double>(contact));
    if (!any(is)) continue;
    const BlockTouch<S> it = touch_block(contact, along, line, foot, point.radius, toward);
    touch = {select(is, it.gap, touch.gap), select3(is, it.normal, touch.normal), select3(is, it.arm, touch.arm)};
  }
  return touch;
}

/// The same of a block, `center` that of the block.
template <class S>
void place_block(const GroundPoint& point, Index k, const Vec3<S>& center, const NearFeatures<S>& near, const Mat3<S>& to_body,
                 GroundPoints<S>& points) {
  const Vec3<double> nowhere{0, 0, 0};
  const auto vector = [&](const auto& part, const Vec3<double>& none) { return to_body * near.vector(point.rank, part, none); };
  const auto number = [&](const auto& part, double none) { return near.number(point.rank, part, none); };
  const Vec3<S> n = vector([](const TerrainFeature& f) { return f.normal; }, {0, 0, 1});
  store(points.center, k, center + vector([](const TerrainFeature& f) { return f.from; }, nowhere));
  store(points.normal, k, n);
  store(points.along, k, vector([](const TerrainFeature& f) { return f.along; }, nowhere));
  store(points.line, k, vector([](const TerrainFeature& f) { return f.line; }, nowhere));
  store(points.foot, k, vector([](const TerrainFeature& f) { return f.foot; }, nowhere));
  points.kind(k) = number([](const TerrainFeature& f) { return static_cast<double>(f.kind); }, 0);
  points.weight(k) = number([](const TerrainFeature& f) { return f.weight; }, 0);
  points.gap(k) = number([](const TerrainFeature& f) { return f.gap; }, kNothingNear);
  // what is near is looked at, however it turns
  points.clearance(k) = select(points.weight(k) > S(0.0), S(0.0), as<S>(kNothingNear));
  store(points.arm, k, touch_at(point, k, points, load<Vec3, S>(points.along, k), load<Vec3, S>(points.foot, k)).arm - as<S>(point.radius) * n);
}

/// Depth that the motion did not make must not become energy: the points of a body store no more at the beginning of a step than they did at
/// the end of the last one, and what `recovery` adds.
template <class S>
void bear_what_was_borne(double recovery, Index first, Index last, GroundPoints<S>& points) {
  using std::max;
  using std::min;
  using std::sqrt;
  const S zero(0.0), one(1.0);
  S borne = zero, found = zero;
  auto unknown = zero < one;
  for (Index k = first; k < last; ++k) {
    borne = borne + max(points.bore(k), zero);
    unknown = unknown && points.bore(k) == zero;
    const S depth = max(-points.gap(k), zero);
    found = found + points.weight(k) * depth * depth;
  }
  const S part = select(unknown || found == zero, one, min((sqrt(borne) + as<S>(recovery)) / sqrt(max(found, as<S>(1e-30))), one));
  if (!any(part < one)) return;
  for (Index k = first; k < last; ++k) points.gap(k) = select(points.gap(k) < zero, part * points.gap(k), points.gap(k));
}

/// Where the points are over the ground at the beginning of a step; potential energy of those inside [J].
template <class S>
S find_ground(const GroundPlan& plan, const Field<S, 12>& pose, GroundPoints<S>& points) {
  const Ground& ground = plan.ground;
  using std::max;
  const S zero(0.0);
  const Mat3<S> frame{spread3<S>(plan.frame[0]), spread3<S>(plan.frame[1]), spread3<S>(plan.frame[2])};
  S potential = zero;
  const auto add_potential = [&](Index k, const S& weight) {
    const S depth = max(-points.gap(k), zero);
    potential = potential + as<S>(0.5 * ground.stiffness) * weight * depth * depth;
  };
  const Index count = static_cast<Index>(plan.points.size());
  Index k = 0;
  while (k < count) {
    const GroundPoint& first = plan.points[static_cast<std::size_t>(k)];
    const auto T = load<Placement, S>(pose, first.slot);
    const Vec3<S> c = spread3<S>(first.center), x = T.R * c + T.p;
    const auto each_point = [&](const auto& place) {
      do {
        store(points.center, k, c);
        place(plan.points[static_cast<std::size_t>(k)]);
        k += 1;
      } while (k < count && !plan.points[static_cast<std::size_t>(k)].begins_candidate());
    };
    if (!ground.terrain) {
      const Vec3<S> n = transpose_times(T.R, frame.z);
      const S level = dot(x, frame.z) - as<S>(ground.height);
      each_point([&](const GroundPoint& point) {
        place_on_plane(point, k, n, level, points);
        add_potential(k, S(1.0));
      });
    } else {
      const Vec3<S> in_plane = frame * x - Vec3<S>{zero, zero, as<S>(ground.height)};
      const Mat3<S> to_body = transpose(frame * T.R);
      const NearFeatures<S> near(plan, first, in_plane, frame * T.R);
      each_point([&](const GroundPoint& point) {
        if (point.block < 0) {
          place_on_terrain(point, k, near, to_body, points);
        } else {
          place_block(point, k, c, near, to_body, points);
        }
      });
    }
  }
  if (ground.terrain) {
    for (Index first = 0, last = 0; first < count; first = last) {
      while (last < count && plan.points[static_cast<std::size_t>(last)].slot == plan.points[static_cast<std::size_t>(first)].slot) ++last;
      bear_what_was_borne(plan.recovery, first, last, points);
    }
    for (k = 0; k < count; ++k) add_potential(k, points.weight(k));
  }
  return potential;
}

}  // namespace linden
