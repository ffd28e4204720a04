// kernels/effects/ground.hpp
// Ground: compliant in its normal direction, Coulomb friction along it. A force at each contact point, body-local, hence inside the O(n)
// solve.
//
//   normal    N = max(0, -(P(gap^k+1) - P(gap^k)) / rise - c' (m^k+1 - m^k) / h),    m = min(gap, 0),  P = 1/2 k m^2
//   sticks    F_t = -b t                         as long as |F_t| <= friction N,    b = friction max(k depth^k, N_least) / (h creep)
//   slides    F_t = -friction N t / |t|          as long as t does not turn back
//
// rise = n.D_c, D_c the displacement of the sphere's centre, gap^k+1 = gap^k + rise; t is the displacement along the ground of its lowest
// point a = c - r n. The plane under a point is that below it at the beginning of the step. The difference quotient of P (a discrete
// gradient) makes the work of the spring exactly -dP, also where a step begins above the ground and ends in it: a bounce neither
// gains nor loses. c' = c + (s - 1/2) h k.
//
// What sticks creeps by some kCreep at the limit of its friction and by less below it, the points of a foot in proportion to the load
// that each bore at the beginning of the step. That is stiff, so it is taken by backward Euler (share 1), the normal force with the
// share s that its stiffness calls for (joint_impulses.hpp). Stick and slide are an active set, as in friction.hpp: they are revised
// within the solve until they are those of the solution. Softly (creep > 0), as in friction.hpp: F_t = -friction N t / max(|t|, h creep).
//
// A rim of a cylinder stands as four points: the lowest of its circle, the highest, and the two between, found anew each step.
//
// units   gap, D [m]; k [N/m], c [N s/m] of one point
// energy  P of points in the ground is potential; the rest of -F.D is taken
// cost    some 200 operations a point and evaluation, one product of rotations a body and step
// source  Gonzalez, Time integration and discrete Hamiltonian systems (1996); Alart, Curnier, A mixed formulation for frictional contact
//         problems prone to Newton like solution methods (1991)
#pragma once

#include <vector>

#include "kernels/effects/body_impulses.hpp"
#include "kernels/effects/friction.hpp"
#include "layout/effects.hpp"

namespace linden {

/// Speed at which a point that sticks creeps along at the limit of its friction: 60 micrometres a minute [m/s].
inline constexpr double kCreep = 1e-6;

/// Slower points are first taken to stick [m/s]: those that do creep by some kCreep.
inline constexpr double kStickingSpeed = 20 * kCreep;

#define LINDEN_GROUND_POINT_FIELDS(FIELD)                                                             \
  FIELD(Scalar, center, 3, slots, "of the sphere, body frame [m]")                                    \
  FIELD(Scalar, normal, 3, slots, "of the ground below it, body frame at k")                          \
  FIELD(Scalar, gap, 1, slots, "over the ground at k, below zero inside [m]")                         \
  FIELD(Scalar, slip, 3, slots, "t of the evaluation last made, body frame at k [m]")                 \
  FIELD(Scalar, slip_before, 3, slots, "t of the evaluation before")                                  \
  FIELD(Scalar, slides, 1, slots, "1 slides, 0 sticks")                                               \
  FIELD(Scalar, closed, 1, slots, "1 where the ground pushes, in the evaluation last made")           \
  FIELD(Scalar, factored, 1, slots, "closed, as the factor has it")                                   \
  FIELD(Scalar, load, 1, slots, "force of sticking as a share of what friction can, likewise")        \
  FIELD(Scalar, push, 1, slots, "N, likewise [N]")                                                    \
  FIELD(Scalar, drag, 3, slots, "F_t, likewise, body frame at k [N]")                                 \
  FIELD(Scalar, rise, 1, slots, "n.D_c, likewise [m]")                                                \
  FIELD(Scalar, rise_before, 1, slots, "of the last step [m]")                                        \
  FIELD(Scalar, slip_last, 3, slots, "t of the last step [m]")

/// Rows are contact points: allocate({.slots = points}).
template <class Scalar>
struct GroundPoints {
  LINDEN_FIELDS(LINDEN_GROUND_POINT_FIELDS)
};

/// A contact point: a sphere, or one of the four of a rim.
struct GroundPoint {
  Index slot;
  std::array<double, 3> center;
  double radius;
  std::array<double, 3> axis{};  // of the rim
  double rim_radius = 0;         // 0: a sphere
  int quarter = 0;               // 0 the lowest, 2 the highest, 1 and 3 between
};

/// The ground as its sweeps read it.
struct GroundPlan {
  Ground ground;
  Mat3<double> frame{};   // rows: x, y and normal of the plane, world frame
  double least_load = 0;  // N_least [N]
  std::vector<GroundPoint> points;  // sorted by slot
  std::vector<double> share;        // s of the normal force, one number a point
};

template <class S>
LINDEN_INLINE Vec3<S> spread3(const Vec3<double>& a) {
  return {as<S>(a.x), as<S>(a.y), as<S>(a.z)};
}

template <class S>
struct GroundBelow {
  S height;         // over the plane, along its normal [m]
  Vec3<S> normal;   // in the plane's frame
};

LINDEN_INLINE GroundBelow<double> ground_below(const HeightField& field, double x, double y) {
  const double u = std::clamp((x - field.origin_x) / field.spacing_x, 0.0, field.columns - 1.0);
  const double v = std::clamp((y - field.origin_y) / field.spacing_y, 0.0, field.rows - 1.0);
  const Index column = std::min(static_cast<Index>(u), field.columns - 2), row = std::min(static_cast<Index>(v), field.rows - 2);
  const auto at = [&](Index c, Index r) { return field.heights[static_cast<std::size_t>(r * field.columns + c)]; };
  const double a = u - column, b = v - row;
  const double h00 = at(column, row), h10 = at(column + 1, row), h01 = at(column, row + 1), h11 = at(column + 1, row + 1);
  // two triangles a cell
  const double du = a + b <= 1 ? h10 - h00 : h11 - h01, dv = a + b <= 1 ? h01 - h00 : h11 - h10;
  const double height = a + b <= 1 ? h00 + a * du + b * dv : h11 - (1 - a) * du - (1 - b) * dv;
  const double sx = du / field.spacing_x, sy = dv / field.spacing_y, length = 1 / std::sqrt(1 + sx * sx + sy * sy);
  return {height, {-sx * length, -sy * length, length}};
}

/// The same in every lane.
template <class S>
GroundBelow<S> ground_below(const HeightField& field, const S& x, const S& y) {
  using Real = typename ElementOf<S>::type;
  if constexpr (std::is_arithmetic_v<S>) {
    const GroundBelow<double> below = ground_below(field, static_cast<double>(x), static_cast<double>(y));
    return {as<S>(below.height), spread3<S>(below.normal)};
  } else {
    constexpr std::size_t W = sizeof(S) / sizeof(Real);
    std::array<Real, W> xs, ys, h, nx, ny, nz;
    x.store_unaligned(xs.data());
    y.store_unaligned(ys.data());
    for (std::size_t l = 0; l < W; ++l) {
      const GroundBelow<double> below = ground_below(field, static_cast<double>(xs[l]), static_cast<double>(ys[l]));
      h[l] = static_cast<Real>(below.height);
      nx[l] = static_cast<Real>(below.normal.x);
      ny[l] = static_cast<Real>(below.normal.y);
      nz[l] = static_cast<Real>(below.normal.z);
    }
    return {S::load_unaligned(h.data()), {S::load_unaligned(nx.data()), S::load_unaligned(ny.data()), S::load_unaligned(nz.data())}};
  }
}

/// Where the points are over the ground at the beginning of a step; potential energy of those inside [J].
template <class S>
S find_ground(const GroundPlan& plan, const Field<S, 12>& pose, GroundPoints<S>& points) {
  const Ground& ground = plan.ground;
  using std::max;
  using std::min;
  using std::sqrt;
  const S zero(0.0), one(1.0);
  const Vec3<S> ex = spread3<S>(plan.frame.x), ey = spread3<S>(plan.frame.y), ez = spread3<S>(plan.frame.z);
  S potential = zero;
  for (Index k = 0; k < static_cast<Index>(plan.points.size()); ++k) {
    const GroundPoint& point = plan.points[static_cast<std::size_t>(k)];
    const auto T = load<Placement, S>(pose, point.slot);
    Vec3<S> c = spread3<S>({point.center[0], point.center[1], point.center[2]});
    if (point.rim_radius > 0) {
      const Vec3<S> axis = spread3<S>({point.axis[0], point.axis[1], point.axis[2]}), up = transpose_times(T.R, ez);
      // upright on the plane any direction is the lowest
      const Vec3<S> helper = point.axis[0] * point.axis[0] < 0.5 ? Vec3<S>{one, zero, zero} : Vec3<S>{zero, one, zero};
      const Vec3<S> across = up - dot(up, axis) * axis + as<S>(1e-9) * (helper - dot(helper, axis) * axis);
      const Vec3<S> high = (one / sqrt(dot(across, across))) * across;
      const Vec3<S> side = point.quarter % 2 == 0 ? high : cross(axis, high);
      c = c + as<S>(point.quarter < 2 ? -point.rim_radius : point.rim_radius) * side;
    }
    const Vec3<S> x = T.R * c + T.p;
    const S height = dot(x, ez) - as<S>(ground.height);
    Vec3<S> n = ez;
    S gap = height;
    if (ground.terrain) {
      const GroundBelow<S> below = ground_below(*ground.terrain, dot(x, ex), dot(x, ey));
      n = below.normal.x * ex + below.normal.y * ey + below.normal.z * ez;
      gap = (height - below.height) * below.normal.z;
    }
    gap = gap - as<S>(point.radius);
    store(points.center, k, c);
    store(points.normal, k, transpose_times(T.R, n));
    points.gap(k) = gap;
    const S depth = max(-gap, zero);
    potential = potential + as<S>(0.5 * ground.stiffness) * depth * depth;
  }
  return potential;
}

/// Which points slide at first: those that did in the last step, where it is `known` and the ground pushed; of others those that are faster
/// than kStickingSpeed.
template <class S>
void guess_ground(const GroundPlan& plan, const S& h, bool known, const Field<S, 7>& displacement, GroundPoints<S>& points) {
  const S still = as<S>(kStickingSpeed * kStickingSpeed) * h * h;
  for (Index k = 0; k < static_cast<Index>(plan.points.size()); ++k) {
    const GroundPoint& point = plan.points[static_cast<std::size_t>(k)];
    const auto n = load<Vec3, S>(points.normal, k);
    const Vec3<S> a = load<Vec3, S>(points.center, k) - as<S>(point.radius) * n;
    const Vec3<S> moved = point_displacement(load<Displacement, S>(displacement, point.slot), a), t = moved - dot(n, moved) * n;
    const S guess = select(dot(t, t) > still, S(1.0), S(0.0));
    points.slides(k) = known ? select(points.closed(k) > S(0.0), points.slides(k), guess) : guess;
    store(points.slip, k, t);
  }
}

/// Points first ... last - 1.
template <class S>
void ground_map(const GroundPlan& plan, std::size_t first, std::size_t last, const S& h, double creep, const Field<S, 7>& displacement,
                GroundPoints<S>& points, BodyImpulses<S>& sum, Field<S, 6>& impulse) {
  using std::max;
  using std::min;
  using std::sqrt;
  const S zero(0.0), half(0.5), one(1.0), rate = one / h, scale = h * h;
  const Ground& ground = plan.ground;
  const S stiff = as<S>(ground.stiffness), damp = rate * as<S>(ground.damping), mu = as<S>(ground.friction);
  const S stick = mu / (h * as<S>(kCreep));
  const Vec3<S> none{zero, zero, zero};
  for (std::size_t at = first; at < last; ++at) {
    const Index k = static_cast<Index>(at), i = plan.points[at].slot;
    const auto c = load<Vec3, S>(points.center, k), n = load<Vec3, S>(points.normal, k);
    const auto D = load<Displacement, S>(displacement, i);
    const Vec3<S> center_moved = point_displacement(D, c);
    const S rise = dot(n, center_moved);
    const S gap = points.gap(k), next = gap + rise;
    store(points.slip_before, k, load<Vec3, S>(points.slip, k));
    points.rise(k) = rise;
    if (!any(gap < zero || next < zero)) {
      // most points of a robot are far from the ground, in all lanes
      points.closed(k) = points.load(k) = points.push(k) = zero;
      store(points.drag, k, none);
      continue;
    }
    const Vec3<S> a = c - as<S>(plan.points[at].radius) * n;
    const Vec3<S> moved = point_displacement(D, a);
    const S share = as<S>(plan.share[at]);
    const S m = min(gap, zero), m_next = min(next, zero);
    // where both ends are inside the quotient is that of a parabola; elsewhere rise is not zero
    const auto inside = gap < zero && next < zero;
    const S across_surface = one / select(inside || rise == zero, one, rise);
    const S meeting = select(rise == zero, zero, half * stiff * (m * m - m_next * m_next) * across_surface);
    const S spring = select(inside, -half * stiff * (gap + next), meeting);
    const S steep = select(inside, half * stiff, select(rise == zero, zero, (stiff * m_next + meeting) * across_surface));
    const S loss = damp + (share - half) * stiff;
    const S pressed = spring - loss * (m_next - m);
    const auto closed = pressed > zero;
    const S N = select(closed, pressed, zero), dN = select(closed, steep + select(next < zero, loss, zero), zero);

    const Vec3<S> t = moved - dot(n, moved) * n;
    const S length = sqrt(dot(t, t));
    if (creep > 0) points.slides(k) = select(length > h * as<S>(creep), one, zero);
    const auto slides = points.slides(k) > zero;
    const S per_length = creep > 0 ? one / max(length, h * as<S>(creep)) : select(length > zero, one / length, zero);
    const Vec3<S> direction = per_length * t;
    const auto by_load = slides || as<S>(creep) > zero;
    const S b = select(closed, select(by_load, mu * N * per_length, stick * max(-stiff * gap, as<S>(plan.least_load))), zero);
    const Vec3<S> drag = -b * t, push = N * n;

    const Mat3<S> R = rotation(D.r);
    add_force(sum, impulse, i, share, c, center_moved, scale * push);
    add_force(sum, impulse, i, one, a, moved, scale * drag);
    // -d(N n)/dD_c, -dF_t/dD_c through N, -dF_t/dD_a
    add_pull(sum, i, c, c, R, outer((scale * share * dN) * n, n));
    add_pull(sum, i, a, c, R, outer(select(by_load, -(scale * mu * dN), zero) * direction, n));
    const Mat3<S> across = diagonal(one) - outer(n, n) - select(slides, one, zero) * outer(direction, direction);
    add_pull(sum, i, a, a, R, (scale * b) * across);

    store(points.slip, k, t);
    points.closed(k) = select(closed, one, zero);
    points.load(k) = select(closed && !by_load, b * length / (mu * N), zero);
    points.push(k) = N;
    store(points.drag, k, drag);
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

/// Work of the ground in the evaluation last made [J]. `known`: the last step is, rise_before and slip_last.
template <class S>
S ground_work(const GroundPlan& plan, bool known, const GroundPoints<S>& points) {
  S sum(0.0);
  for (Index k = 0; k < points.push.rows(); ++k) {
    const S rise = points.rise(k), rise_before = known ? points.rise_before(k) : rise;
    const auto t = load<Vec3, S>(points.slip, k), t_before = known ? load<Vec3, S>(points.slip_last, k) : t;
    sum = sum + points.push(k) * worked(plan.share[static_cast<std::size_t>(k)], rise, rise_before) +
          S(0.5) * dot(load<Vec3, S>(points.drag, k), t + t_before);
  }
  return sum;
}

/// At the end of a step.
template <class S>
void keep_ground(GroundPoints<S>& points) {
  std::ranges::copy(points.rise.flat(), points.rise_before.flat().begin());
  std::ranges::copy(points.slip.flat(), points.slip_last.flat().begin());
}

}  // namespace linden
