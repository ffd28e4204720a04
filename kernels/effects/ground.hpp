// kernels/effects/ground.hpp
// Ground: compliant in its normal direction, Coulomb friction along it. A force at each contact, body-local, hence inside the O(n) solve.
//
//   normal    N = max(0, -(P(gap^k+1) - P(gap^k)) / rise - c' (m^k+1 - m^k) / h),    m = min(gap, 0),  P = 1/2 k m^2
//   sticks    F_t = -b t                         as long as |F_t| <= friction N,    b = friction max(k depth^k, N_least) / (h kCreep)
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
// share s that its stiffness calls for (joint_impulses.hpp). Stick and slide are an active set, as in friction.hpp: they are updated
// within the solve until they are those of the solution. Regularised (stiction_speed v > 0), as in friction.hpp: F_t = -friction N t / max(|t|, h v).
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
#include "kernels/effects/friction.hpp"
#include "kernels/effects/ground_contact.hpp"
#include "kernels/effects/ground_points.hpp"

namespace linden {

/// Slower points are first taken to stick [m/s]: those that do creep by some kCreep.
inline constexpr double kStickingSpeed = 20 * kCreep;

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

/// Points first ... last - 1, all of one body.
template <class S>
void ground_map(const GroundPlan& plan, std::size_t first, std::size_t last, const OwnFriction<S>& own, const S& h, double stiction_speed,
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
    const FrictionForce<S> friction = friction_force(plan, own, h, stiction_speed, gap, normal, meeting.slip.along, slides);
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
auto update_ground(GroundPoints<S>& points, const Mask& settled, const S& least) {
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
    const S along_normal = work_displacement(plan.share[static_cast<std::size_t>(k)], rise, rise_before);
    each(plan.points[static_cast<std::size_t>(k)].slot,
         points.push(k) * along_normal + S(0.5) * dot(load<Vec3, S>(points.drag, k), t + t_before));
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
