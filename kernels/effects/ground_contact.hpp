// kernels/effects/ground_contact.hpp
// How one contact point meets the ground over a step (ground.hpp): its gap and slip, the force along the normal, the force of friction, and
// what both add to the body's K.
#pragma once

#include "kernels/effects/body_impulses.hpp"
#include "kernels/effects/ground_points.hpp"

namespace linden {

/// Speed at which a point that sticks creeps along at the limit of its friction: 60 micrometres a minute [m/s].
inline constexpr double kCreep = 1e-6;

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

/// What friction goes by that is each instance's own.
template <class S>
struct OwnFriction {
  S mu;          // Coulomb's coefficient
  S least_load;  // N_least [N], which goes by gravity
};

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
FrictionForce<S> friction_force(const GroundPlan& plan, const OwnFriction<S>& own, const S& h, double stiction_speed, const S& gap,
                                const NormalForce<S>& normal, const Vec3<S>& t, S& slides) {
  using std::max;
  using std::sqrt;
  const S zero(0.0), one(1.0), mu = own.mu, N = normal.push();
  const S length = sqrt(dot(t, t));
  if (stiction_speed > 0) slides = select(length > h * as<S>(stiction_speed), one, zero);
  const auto closed = normal.closed > zero, sliding = slides > zero, by_load = sliding || as<S>(stiction_speed) > zero;
  const S per_length = stiction_speed > 0 ? one / max(length, h * as<S>(stiction_speed)) : select(length > zero, one / length, zero);
  const S stick = mu / (h * as<S>(kCreep));
  const S stuck = stick * max(as<S>(-plan.ground.stiffness) * gap, own.least_load);
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
  (Mat6<S>::from(sum.body_stiffness.row(i)) + K).to(sum.body_stiffness.row(i));
}

}  // namespace linden
