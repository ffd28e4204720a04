// kernels/effects/ground.hpp
// Ground: compliant in its normal direction, Coulomb friction along it. A force at each contact, body-local, hence inside the O(n) solve.
//
//   normal    N = max(0, -(P(gap^k+1) - P(gap^k)) / rise - c' (m^k+1 - m^k) / h),    m = min(gap, 0),  P = 1/2 k m^2
//   sticks    F_t = -b t                         as long as |F_t| <= friction N,    b = friction max(k depth^k, N_least) / (h creep)
//   slides    F_t = -friction N t / |t|          as long as t does not turn back
//
// Gaps are of shapes (kernels/effects/contact_geometry.hpp), rise = gap^k+1 - gap^k, and N acts along the wrench whose work is N rise. The difference
// quotient of P (a discrete gradient) then makes the work of the spring exactly -dP, also where a step begins above the ground and ends in it:
// a bounce neither gains nor loses, and what rolls is neither driven nor held back. c' = c + (s - 1/2) h k.
//
// The feature of the ground that a point meets is that of the beginning of the step (kernels/effects/terrain.hpp), the tangent plane of an edge or
// corner that of the middle of it. Where a feature takes over from another, depth is found that no motion made. It must not become energy:
// on a terrain the points of a body store no more at the beginning of a step than they did at the end of the last one (bore), and their
// depths are all reduced by one factor where they would; what is missing comes back at kRecovery (engine/effects/effect_plan.cpp). Without this
// one shape in two that tumbles over rough ground was given energy, a disc up to 89 J of 5. With it, of 200 shapes that tumbled for 3 s at 0.5
// to 2 ms, 24 rose by more than 0.02 J and none by more than 0.21 J of 2 to 22 J; the most without damping at 2 ms. At a recovery of 10 mm/s
// it was 1 % more. Energy is lost where a gap is less than it was, to the second order of the step over an edge that turns down.
//
// t = D_c + phi x o without its part along the normal: o from the centre to where the shapes touch, D_c and phi displacement and turn of the
// centre. What rolls has t = 0 exactly, however far it turns in a step; for a corner, o = 0, t is the displacement of its material.
//
// What sticks creeps by some kCreep at the limit of its friction and by less below it, the points of a foot in proportion to the load
// that each bore at the beginning of the step. That is stiff, so it is taken by backward Euler (share 1), the normal force with the
// share s that its stiffness calls for (joint_impulses.hpp). Stick and slide are an active set, as in friction.hpp: they are revised
// within the solve until they are those of the solution. Softly (creep > 0), as in friction.hpp: F_t = -friction N t / max(|t|, h creep).
//
// A rim stands as four points: the lowest of its circle, the highest, and the two between, whose gap is the centre's. Lowest and highest
// together are as stiff against a tilt of a disc that lies flat as springs all around it. What a rim loses (c') it loses by what its material
// does at the four places, so that a disc does not rattle through its flat position without loss.
//
// On a terrain each point has the feature of its rank, in each lane its own. A block meets ridges and peaks, a line or face of its own each.
//
// units   gap, D [m]; k [N/m], c [N s/m] of one point
// energy  P of points in the ground is potential; the rest of -F.D is taken
// cost    some 300 operations a point and evaluation, 600 of a rim; of a body none of whose points is near 20 a point
// source  Gonzalez, Time integration and discrete Hamiltonian systems (1996); Alart, Curnier, A mixed formulation for frictional contact
//         problems prone to Newton like solution methods (1991)
#pragma once

#include <optional>

#include "kernels/effects/body_impulses.hpp"
#include "kernels/effects/contact_geometry.hpp"
#include "kernels/effects/friction.hpp"
#include "kernels/effects/ground_plan.hpp"
#include "kernels/effects/terrain.hpp"

namespace linden {

/// Speed at which a point that sticks creeps along at the limit of its friction: 60 micrometres a minute [m/s].
inline constexpr double kCreep = 1e-6;

/// Slower points are first taken to stick [m/s]: those that do creep by some kCreep.
inline constexpr double kStickingSpeed = 20 * kCreep;

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

/// Displacement along a normal and across it of the place where two shapes touch.
template <class S>
struct Slip {
  S rise;
  Vec3<S> along;
  LINDEN_INLINE Slip(const Vec3<S>& n, const Vec3<S>& moved, const Vec3<S>& turn, const Vec3<S>& arm) {
    const Vec3<S> whole = moved + cross(turn, arm);
    rise = dot(n, whole);
    along = whole - rise * n;
  }
};

/// Which points slide at first: those that did in the last step, where it is `known` and the ground pushed; of others those that are faster
/// than kStickingSpeed.
template <class S>
void guess_ground(const GroundPlan& plan, const S& h, bool known, const Field<S, 7>& displacement, GroundPoints<S>& points) {
  const S still = as<S>(kStickingSpeed * kStickingSpeed) * h * h;
  Displacement<S> D;
  Vec3<S> turn;
  Index slot = 0;
  for (Index k = 0; k < static_cast<Index>(plan.points.size()); ++k) {
    if (const Index its = plan.points[static_cast<std::size_t>(k)].slot; its != slot) {
      slot = its;
      D = load<Displacement, S>(displacement, slot);
      turn = rotation_vector(D.r);
    }
    const Vec3<S> moved = point_displacement(D, load<Vec3, S>(points.center, k));
    const Vec3<S> t = Slip<S>(load<Vec3, S>(points.normal, k), moved, turn, load<Vec3, S>(points.arm, k)).along;
    const S guess = select(dot(t, t) > still, S(1.0), S(0.0));
    points.slides(k) = known ? select(points.closed(k) > S(0.0), points.slides(k), guess) : guess;
    store(points.slip, k, t);
  }
}

/// How a body moves over a step.
template <class S>
struct BodyMotion {
  Displacement<S> D;
  Vec3<S> turn;  // phi
  Mat3<S> R;     // of D
  explicit BodyMotion(const Displacement<S>& displacement) : D(displacement), turn(rotation_vector(D.r)), R(rotation(D.r)) {}
};

/// How one candidate meets the ground over a step: what the normal force acts along, and where friction does.
template <class S>
struct Meeting {
  GapChange<S> gap;
  Vec3<S> normal;     // unit length, at the middle of the step
  Vec3<S> arm;        // o, likewise
  Slip<S> slip;
  Mat3<S> bend_force, bend_moment;  // d gap.mean.f / d D_c, d gap.mean.n / d (turn at k+1)
};

template <class S>
LINDEN_INLINE Wrench<S> select6(const auto& condition, const Wrench<S>& yes, const Wrench<S>& no) {
  return {select3(condition, yes.n, no.n), select3(condition, yes.f, no.f)};
}

template <class S>
LINDEN_INLINE GapChange<S> select_gap(const auto& condition, const GapChange<S>& yes, const GapChange<S>& no) {
  return {select(condition, yes.rise, no.rise), select6(condition, yes.mean, no.mean), select6(condition, yes.end, no.end)};
}

template <class S>
LINDEN_INLINE Vec3<S> unit_vector(const Vec3<S>& a) {
  using std::sqrt;
  return (S(1.0) / sqrt(dot(a, a))) * a;
}

/// A sphere or corner.
template <class S>
Meeting<S> meet_sphere(const GroundPlan& plan, const GroundPoint& point, Index k, const GroundPoints<S>& points, const BodyMotion<S>& body,
                       const Vec3<S>& moved) {
  const S zero(0.0);
  Vec3<S> n = load<Vec3, S>(points.normal, k);
  GapChange<S> gap = sphere_over_plane(n, moved);
  const Mat3<S> none = diagonal(zero);
  Mat3<S> bend = none;
  if (plan.ground.terrain) {
    const auto on_line = points.kind(k) > zero;
    if (any(on_line)) {
      const GapChange<S> over = sphere_over_line(load<Vec3, S>(points.line, k), load<Vec3, S>(points.foot, k), moved, bend);
      gap = select_gap(on_line, over, gap);
      n = select3(on_line, unit_vector(gap.mean.f), n);
      bend = select(on_line, S(1.0), zero) * bend;
    }
  }
  const Vec3<S> arm = as<S>(-point.radius) * n;
  return {gap, n, arm, Slip<S>(n, moved, body.turn, arm), bend, none};
}

/// A block.
template <class S>
Meeting<S> meet_block(const GroundPoint& point, Index k, const GroundPoints<S>& points, const BodyMotion<S>& body, const Vec3<S>& moved) {
  const S half(0.5);
  const auto along = load<Vec3, S>(points.along, k), foot = load<Vec3, S>(points.foot, k);
  const BlockTouch<S> begin = touch_at(point, k, points, along, foot);
  const BlockTouch<S> end = touch_at(point, k, points, along + turned_by(body.D.r, along), foot + moved);
  const GapChange<S> gap{end.gap - begin.gap, half * (begin.gradient() + end.gradient()), end.gradient()};
  const Vec3<S> n = unit_vector(gap.mean.f), arm = half * (begin.arm + end.arm) - as<S>(point.radius) * n;
  const Mat3<S> none = diagonal(S(0.0));
  return {gap, n, arm, Slip<S>(n, moved, body.turn, arm), none, none};
}

/// One of the four points of a rim.
template <class S>
Meeting<S> meet_rim(const GroundPlan& plan, const GroundPoint& point, Index k, const GroundPoints<S>& points, const BodyMotion<S>& body,
                    const Vec3<S>& moved) {
  const S zero(0.0), one(1.0);
  const Vec3<S> axis = spread3<S>(point.axis), end_axis = axis + turned_by(body.D.r, axis);
  Vec3<S> n = load<Vec3, S>(points.normal, k);
  GapChange<S> gap = sphere_over_plane(n, moved);
  const Mat3<S> none = diagonal(zero);
  Mat3<S> bend = none;
  if (point.quarter % 2 == 0) gap = circle_over_plane(n, axis, point.rim_radius, point.quarter == 0 ? -1 : 1, body.D.r, moved, bend);
  const Vec3<S> up = n - dot(n, axis) * axis, end_up = n - dot(n, end_axis) * end_axis;
  const S tilt = dot(up, up), clear = tilt / (tilt + as<S>(kClearTilt * kClearTilt));
  Vec3<S> arm = rim_arm(point, up + clear * end_up);
  if (plan.ground.terrain && point.quarter == 0) {
    const auto pierced = points.kind(k) > zero;
    if (any(pierced)) {
      const auto line = load<Vec3, S>(points.line, k), foot = load<Vec3, S>(points.foot, k);
      gap = select_gap(pierced, circle_over_line(line, foot, axis, body.D.r, moved), gap);
      n = select3(pierced, unit_vector(gap.mean.f), n);
      const CircleAndLine<S> begin(line, foot, axis), end(line, foot + moved, end_axis);
      arm = select3(pierced, S(0.5) * (begin.v + end.v), arm);
      bend = select(pierced, zero, one) * bend;
    }
  }
  return {gap, n, arm, Slip<S>(n, moved, body.turn, arm), none, bend};
}

/// The normal force, and how it falls with the gap.
template <class S>
struct NormalForce {
  S spring, slow;      // N = spring - slow where that pushes, else all is zero
  S steep, slow_rate;  // -d spring / d gap, d slow / d (what it looks at)
  S closed;            // 1 or 0
  S push() const { return spring - slow; }
};

/// `material`: rise of the material there, which c' goes by while it is inside.
template <class S>
NormalForce<S> normal_force(const S& stiff, const S& loss, const S& gap, const S& rise, const S& material) {
  using std::min;
  const S zero(0.0), half(0.5), one(1.0), next = gap + rise;
  const S m = min(gap, zero), m_next = min(next, zero);
  // where both ends are inside the quotient is that of a parabola; elsewhere rise is not zero
  const auto inside = gap < zero && next < zero;
  const S across_surface = one / select(inside || rise == zero, one, rise);
  const S meeting = select(rise == zero, zero, half * stiff * (m * m - m_next * m_next) * across_surface);
  const S spring = select(inside, -half * stiff * (gap + next), meeting);
  const S steep = select(inside, half * stiff, select(rise == zero, zero, (stiff * m_next + meeting) * across_surface));
  const S slow = loss * select(inside, material, m_next - m);
  const auto closed = spring - slow > zero;
  return {select(closed, spring, zero), select(closed, slow, zero), select(closed, steep, zero),
          select(closed && next < zero, loss, zero), select(closed, one, zero)};
}

/// The force of friction.
template <class S>
struct FrictionForce {
  Vec3<S> drag;
  Vec3<S> direction;  // of the slip, unit length or shorter
  S b;                // |drag| / |t|
  S per_push;         // -d drag / dN along `direction`
  S turns;            // 1 where drag keeps its size while t turns
  S load;
};

/// `slides` is set where friction is smooth.
template <class S>
FrictionForce<S> friction_force(const GroundPlan& plan, const S& mu, const S& h, double creep, const S& gap, const NormalForce<S>& normal, const Vec3<S>& t,
                                S& slides) {
  using std::max;
  using std::sqrt;
  const S zero(0.0), one(1.0), N = normal.push();
  const S length = sqrt(dot(t, t));
  if (creep > 0) slides = select(length > h * as<S>(creep), one, zero);
  const auto closed = normal.closed > zero, sliding = slides > zero, by_load = sliding || as<S>(creep) > zero;
  const S per_length = creep > 0 ? one / max(length, h * as<S>(creep)) : select(length > zero, one / length, zero);
  const S stick = mu / (h * as<S>(kCreep));
  const S stuck = stick * max(as<S>(-plan.ground.stiffness) * gap, as<S>(plan.least_load));
  const S b = select(closed, select(by_load, mu * N * per_length, stuck), zero);
  return {-b * t, per_length * t, b, select(closed && by_load, mu, zero), select(sliding, one, zero),
          select(closed && !by_load, b * length / (mu * N), zero)};
}

/// w d^T
template <class S>
LINDEN_INLINE Mat6<S> outer(const Wrench<S>& w, const Wrench<S>& d) {
  return {outer(w.n, d.n), outer(w.n, d.f), outer(w.f, d.n), outer(w.f, d.f)};
}

/// Wrench about a body's origin of one about its point c.
template <class S>
LINDEN_INLINE Wrench<S> about_origin(const Vec3<S>& c, const Wrench<S>& w) {
  return {cross(c, w.f) + w.n, w.f};
}

/// What the forces of a point add to the body's K.
template <class S>
LINDEN_INLINE void add_jacobian(const GroundPoint& point, const S& scale, const S& share, const Vec3<S>& c, const BodyMotion<S>& body,
                                const Meeting<S>& meeting, const Wrench<S>& end, const NormalForce<S>& normal, const FrictionForce<S>& friction,
                                BodyImpulses<S>& sum) {
  const S one(1.0), zero(0.0), minus(-1.0);
  const Index i = point.slot;
  const bool rim = point.rim_radius > 0;
  const Vec3<S> &n = meeting.normal, &o = meeting.arm, a = c + o, &d = friction.direction;
  const Wrench<S> force = about_origin(c, meeting.gap.mean), drag{cross(a, d), d};
  const S steep = rim ? normal.steep : normal.steep + normal.slow_rate, less = scale * friction.per_push;
  // through N, and N's share of friction
  Mat6<S> K = outer((scale * share) * force - less * drag, steep * end);
  const Mat3<S>& R = body.R;
  // of a vector x that turns with the body, x.(D_c + phi x o): its gradient in the body's frame at k+1
  const auto gradient = [&](const Vec3<S>& x) {
    const Vec3<S> f = transpose_times(R, x), moment = cross(o, x);
    return Wrench<S>{cross(c, f) + transpose_times(R, moment - S(0.5) * cross(moment, body.turn)), f};
  };
  if (rim) {
    const Wrench<S> lost = gradient(n);
    K = K + outer((scale * share) * Wrench<S>{cross(a, n), n} - less * drag, normal.slow_rate * lost);
    const Mat3<S> moment = (-(scale * share * normal.spring)) * (meeting.bend_moment * R);
    const Mat3<S> none = diagonal(zero);
    K = K + Mat6<S>{moment, none, none, none};
  }
  // friction by t
  const Mat3<S> H = (scale * friction.b) * (diagonal(one) - outer(n, n) - friction.turns * outer(d, d));
  const Mat3<S> bb = H * R;
  Mat3<S> ba = minus * times_hat(bb, c);
  if (rim || point.radius > 0 || point.block >= 0) {
    const Mat3<S> Ho = times_hat(H, o);
    ba = ba - (Ho - S(0.5) * times_hat(Ho, body.turn)) * R;
  }
  K = K + Mat6<S>{hat_times(a, ba), hat_times(a, bb), ba, bb};
  (Mat6<S>::from(sum.pull.row(i)) + K).to(sum.pull.row(i));
}

/// Points first ... last - 1, all of one body. mu: Coulomb's coefficient, of each instance its own.
template <class S>
void ground_map(const GroundPlan& plan, std::size_t first, std::size_t last, const S& mu, const S& h, double creep,
                const Field<S, 7>& displacement, GroundPoints<S>& points, BodyImpulses<S>& sum, Field<S, 6>& impulse) {
  if (first == last) return;
  using std::max;
  using std::sqrt;
  const S zero(0.0), half(0.5), one(1.0), rate = one / h, scale = h * h;
  const Ground& ground = plan.ground;
  const Vec3<S> none{zero, zero, zero};
  const Index i = plan.points[first].slot;
  const auto D = load<Displacement, S>(displacement, i);
  std::optional<BodyMotion<S>> motion;
  for (std::size_t at = first; at < last; ++at) {
    const GroundPoint& point = plan.points[at];
    const Index k = static_cast<Index>(at);
    const auto c = load<Vec3, S>(points.center, k);
    const Vec3<S> moved = point_displacement(D, c);
    const S gap = points.gap(k);
    store(points.slip_before, k, load<Vec3, S>(points.slip, k));
    points.rise(k) = dot(load<Vec3, S>(points.normal, k), moved);
    // most points of a robot are far from the ground, in all lanes
    const auto far = [&](const S& lowest) {
      if (any(gap < zero || lowest < zero)) return false;
      points.closed(k) = points.load(k) = points.push(k) = points.sunk(k) = zero;
      store(points.drag, k, none);
      return true;
    };
    const S sinks = ground.terrain ? -sqrt(dot(moved, moved)) : points.rise(k);
    const S lowest = points.clearance(k) + sinks;
    if (far(lowest)) continue;
    if (!motion) motion.emplace(D);
    const BodyMotion<S>& body = *motion;
    const bool rim = point.rim_radius > 0;
    const Meeting<S> meeting = rim               ? meet_rim(plan, point, k, points, body, moved)
                               : point.block < 0 ? meet_sphere(plan, point, k, points, body, moved)
                                                 : meet_block(point, k, points, body, moved);
    points.rise(k) = meeting.gap.rise;
    if (far(gap + meeting.gap.rise)) continue;

    const S sunk = max(-(gap + meeting.gap.rise), zero);
    const S share = as<S>(plan.share[at]), weight = ground.terrain ? points.weight(k) : one;
    const S stiff = weight * as<S>(ground.stiffness), loss = weight * (rate * as<S>(ground.damping)) + (share - half) * stiff;
    const NormalForce<S> normal = normal_force(stiff, loss, gap, meeting.gap.rise, meeting.slip.rise);
    S slides = points.slides(k);
    const FrictionForce<S> friction = friction_force(plan, mu, h, creep, gap, normal, meeting.slip.along, slides);
    points.slides(k) = slides;

    const Vec3<S> a = c + meeting.arm, &n = meeting.normal;
    Wrench<S> push = normal.push() * meeting.gap.mean;
    if (rim) {
      // what is lost of a rim acts at its material, the rest along its gap
      push = normal.spring * meeting.gap.mean - normal.slow * Wrench<S>{cross(meeting.arm, n), n};
      const S work = normal.spring * meeting.gap.rise - normal.slow * meeting.slip.rise;
      points.rise(k) = select(normal.closed > zero, work / select(normal.closed > zero, normal.push(), one), meeting.gap.rise);
    }
    const Wrench<S> couple{scale * push.n, none}, drag{scale * cross(a, friction.drag), scale * friction.drag};
    add_force(sum, impulse, i, share, c, moved, scale * push.f);
    const Wrench<S> drag_at_end{scale * cross(a + moved, friction.drag), scale * friction.drag};
    add_wrenches(sum, impulse, i, share * couple + drag, couple + drag, (share - half) * couple + half * drag_at_end);
    const Wrench<S> end = [&] {
      const Vec3<S> f = transpose_times(body.R, meeting.gap.end.f);
      return Wrench<S>{cross(c, f) + transpose_times(body.R, meeting.gap.end.n), f};
    }();
    add_jacobian(point, scale, share, c, body, meeting, end, normal, friction, sum);
    if (ground.terrain) {
      const Mat3<S> bend = (-(scale * share * normal.push())) * meeting.bend_force;
      add_pull(sum, i, c, c, body.R, bend);
    }

    // in a lane that is far its own way, whatever others are, the slip stays what it was: states are judged by it
    const auto near = gap < zero || (lowest < zero && gap + meeting.gap.rise < zero);
    const auto slip = load<Vec3, S>(points.slip, k);
    const Vec3<S>& along = meeting.slip.along;
    store(points.slip, k, Vec3<S>{select(near, along.x, slip.x), select(near, along.y, slip.y), select(near, along.z, slip.z)});
    points.closed(k) = normal.closed;
    points.sunk(k) = weight * sunk * sunk;
    points.load(k) = friction.load;
    points.push(k) = normal.push();
    store(points.drag, k, friction.drag);
    store(points.opening, k, end);
    store(points.place, k, c + transpose_times(body.R, meeting.arm));
  }
}

/// Largest load of any point that sticks.
template <class S>
S ground_overload(const GroundPoints<S>& points) {
  using std::max;
  S most(0.0);
  for (Index k = 0; k < points.load.rows(); ++k) most = max(most, points.load(k));
  return most;
}

/// The states that belong to the evaluation last made. Where `settled`, points that stick with more than `least` times what friction can
/// give start to slide. Returns in which instances one changed, or where the ground starts or ceases to push.
template <class S, class Mask>
auto revise_ground(GroundPoints<S>& points, const Mask& settled, const S& least) {
  const S zero(0.0), one(1.0);
  auto changed = zero > one;
  for (Index k = 0; k < points.slides.rows(); ++k) {
    const auto closed = points.closed(k) > zero;
    const auto slides = points.slides(k) > zero;
    const auto breaks = closed && !slides && settled && points.load(k) > one && points.load(k) >= least;
    const auto turns = closed && slides && dot(load<Vec3, S>(points.slip, k), load<Vec3, S>(points.slip_before, k)) <= zero;
    changed = changed || breaks || turns || points.closed(k) != points.factored(k);
    points.slides(k) = select(breaks, one, select(turns, zero, points.slides(k)));
    points.factored(k) = points.closed(k);
  }
  return changed;
}

/// Work of the ground in the evaluation last made: each(slot, work [J]). `known`: the last step is, rise_before and slip_last.
template <class S, class Each>
void ground_work(const GroundPlan& plan, bool known, const GroundPoints<S>& points, const Each& each) {
  for (Index k = 0; k < points.push.rows(); ++k) {
    const S rise = points.rise(k), rise_before = known ? points.rise_before(k) : rise;
    const auto t = load<Vec3, S>(points.slip, k), t_before = known ? load<Vec3, S>(points.slip_last, k) : t;
    each(plan.points[static_cast<std::size_t>(k)].slot, points.push(k) * worked(plan.share[static_cast<std::size_t>(k)], rise, rise_before) +
                                                            S(0.5) * dot(load<Vec3, S>(points.drag, k), t + t_before));
  }
}

/// At the end of a step.
template <class S>
void keep_ground(GroundPoints<S>& points) {
  std::ranges::copy(points.rise.flat(), points.rise_before.flat().begin());
  for (Index k = 0; k < points.sunk.rows(); ++k) points.bore(k) = select(points.sunk(k) > S(0.0), points.sunk(k), S(-1.0));
  std::ranges::copy(points.slip.flat(), points.slip_last.flat().begin());
}

}  // namespace linden
