// Rows of couplings where bodies are: gaps, and how joints change them.
//
//   place       q^k: gaps, and G on the paths
//   find_gaps   q^k+1: gaps, and J on the paths where it is asked for: a factor is made of it
//
// Bodies of a coupling are placed from the body that both hang on, joint by joint: what is rounded on the way from the world is of no account to
// a gap, at the end of a rope of a thousand cells as at its beginning.
//
// A row is scaled by how far it would move were its bodies free: metres and radians are alike then, and so are rows that others hold already.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "engine/sweeps/coupling_paths.hpp"
#include "kernels/block/evaluate_down.hpp"
#include "kernels/couplings/gap_map.hpp"
#include "kernels/couplings/row_lanes.hpp"
#include "layout/model.hpp"

namespace linden {

/// What is asked of the end of a step.
enum class Asked : std::uint8_t { gaps, rows };

/// Side: of rows in memory.
template <class S, class Side = RowLanes<S, RowPack<S>>>
class CouplingRows {
 public:
  /// contacts: see CouplingPaths.
  CouplingRows(const Model& model, Closing closing, std::span<const Coupling> contacts = {})
      : model_(model), paths_(model, closing, Side::count, contacts) {
    if (empty()) return;
    std::size_t longest = 0;
    for (const CouplingPath& path : paths_.all()) longest = std::max(longest, path.joints.size());
    pose_.allocate(static_cast<Index>(longest));
    pull_.allocate(static_cast<Index>(longest));
    for (std::vector<S>* each : {&gap_, &size_, &scale_}) each->assign(count(), S(0.0));
    steepness_.assign(count(), S(1.0));
    for (std::vector<S>* each : {&begin_, &end_}) each->assign(paths_.velocities(), S(0.0));
    for (const CouplingPath& path : paths_.all()) {
      for (const auto& term : path.coupling->terms) at_start_.push_back(as<S>(term.ratio));
      for (std::size_t row = 0; row < path.rows(); ++row) {
        const GapKind kind = rows_of(*path.coupling)[row].kind;
        const bool shifts = kind == GapKind::shift || kind == GapKind::halfway || kind == GapKind::length;
        size_[path.first_row + row] = as<S>(shifts ? path.length : kind == GapKind::turn ? path.coupling->length : 1.0);
        if (kind == GapKind::angle) angles_.push_back({path.first_row + row, S(0.0)});
      }
    }
  }

  bool empty() const { return paths_.empty(); }
  std::size_t count() const { return paths_.rows(); }
  const CouplingPaths& paths() const { return paths_; }
  bool is_rigid(std::size_t row) const { return paths_.is_rigid(row); }

  /// At q^k, where the tree's placements are.
  void place(const Field<S, 12>& placement, const Field<S>& q) {
    for (std::size_t term = 0; const CouplingPath& path : paths_.all()) {
      for (const GearTerm& of : path.coupling->terms) at_start_[term++] = q(of.q_row);
    }
    look([&](auto, Index slot) { return load<Placement, S>(placement, slot); }, [](Index) { return S(0.0); }, &begin_, !keeps_scales_);
    for (Angle& angle : angles_) angle.begin = gap_[angle.row];
  }
  /// Rows keep the scales of where they were placed last, so that gaps at several places can be compared.
  void keep_scales(bool keep) { keeps_scales_ = keep; }

  /// Gaps at the end of motions of the joints and, where rows are asked for, how joints change them there.
  void find_gaps(const Field<S, 12>& placement, const Field<S, 7>& motion, const Field<S>& delta, Asked asked) {
    look([&](auto joint, Index slot) { return after_motion(joint, load<Placement, S>(placement, slot), load_motion(joint, motion, slot)); },
         [&](Index row) { return delta(row); }, asked == Asked::rows ? &end_ : nullptr, false);
    for (const Angle& angle : angles_) gap_[angle.row] = near(gap_[angle.row], angle.begin);
  }

  /// The gaps of contacts there, of bodies in the world at q^k that are displaced so. What is rigid would push by 1e-7 of its load for what is rounded
  /// of where bodies are, at every evaluation otherwise; what is rounded at q^k is the same at all of them.
  void find_contact_gaps(const Field<S, 12>& world, const Field<S, 7>& displacement) {
    using std::sqrt;
    for (const CouplingPath& path : paths_.all()) {
      const Coupling& coupling = *path.coupling;
      if (!is_contact(coupling.kind)) continue;
      const Moved a(coupling.slot_a, world, displacement), b(coupling.slot_b, world, displacement);
      const Placement<S> A = placed_in(a.body, placement_of(coupling.frame_a)), B = placed_in(b.body, placement_of(coupling.frame_b));
      const auto behind = [&](const Moved& moved, const Placement<S>& frame, double depth) { return moved.along(frame.p + as<S>(depth) * axis_of(frame.R, 2)); };
      const Along at_a = a.along(A.p), at_b = b.along(B.p);
      const Along middle_a = behind(a, A, -coupling.rounding[0]), middle_b = behind(b, B, coupling.rounding[1]);
      for (int row = 0; row < 3; ++row) {
        const Along &from = row < 2 ? at_a : middle_a, &to = row < 2 ? at_b : middle_b;
        const Vec3<S> d = to.begin - from.begin, apart = to.way - from.way, n = axis_of(A.R, row);
        S& gap = gap_[path.first_row + static_cast<std::size_t>(row)];
        if (row == 2 && coupling.kind == CouplingKind::round_contact) {
          const Vec3<S> end = d + apart;
          const S distance = sqrt(dot(d, d));
          gap = distance + dot(d + end, apart) / (distance + sqrt(dot(end, end)));
        } else {
          gap = dot(n, d) + (dot(n, apart) + dot(a.turned(n), d + apart));
        }
        if (row == 2) gap = gap - as<S>(coupling.rounding[0] + coupling.rounding[1]);
      }
      if (path.rows() > 3) {
        const Vec3<S> turned = b.half_turn_against(a);
        for (int axis = 0; axis < 3; ++axis) {
          gap_[path.first_row + 3 + static_cast<std::size_t>(axis)] = as<S>(2 * coupling.length) * dot(turned, axis_of(A.R, axis));
        }
      }
      if (coupling.oval != decltype(coupling.oval){}) {
        // axes of both frames at the end, and how far that of b is then tilted against the normal of a
        const Vec3<S> n = axis_of(A.R, 2), tilted = a.turned(n);
        std::array<Vec3<S>, 3> of_a, of_b;
        std::array<S, 3> tilt;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3<S> axis = axis_of(A.R, static_cast<int>(k)), other = axis_of(B.R, static_cast<int>(k)), turned = b.turned(other);
          of_a[k] = axis + a.turned(axis);
          of_b[k] = other + turned;
          tilt[k] = dot(other, tilted) + dot(turned, n + tilted);
        }
        const Vec3<S> moved = rolled(coupling.oval, {tilt[0], tilt[1], tilt[2]});
        const Vec3<S> way = moved.x * of_b[0] + moved.y * of_b[1] + moved.z * of_b[2];
        gap_[path.first_row] = gap_[path.first_row] + S(0.5) * (dot(of_a[0], way) - moved.x);
        gap_[path.first_row + 1] = gap_[path.first_row + 1] + S(0.5) * (dot(of_a[1], way) - moved.y);
        gap_[path.first_row + 2] = gap_[path.first_row + 2] + dot(of_a[2], way);
      }
    }
  }

  /// Of each row [m], or without a unit; by what it is judged; 1 / root of how far it would move were its bodies free.
  const std::vector<S>& gaps() const { return gap_; }
  const std::vector<S>& sizes() const { return size_; }
  const std::vector<S>& scales() const { return scale_; }
  /// Square of how fast an angle changes by a turn along its gradient: beyond 1 where a pitch leaves roll and yaw little room. 1 of other rows.
  const std::vector<S>& steepness() const { return steepness_; }
  /// G at q^k, J at q^k+1: what every velocity of a path does to each of its rows.
  const std::vector<S>& at_begin() const { return begin_; }
  const std::vector<S>& at_end() const { return end_; }

  /// Sum of the squares of all gaps of rigid rows, each over the root of how far its row would move were its bodies free.
  S openness() const {
    S sum(0.0);
    for (std::size_t j = 0; j < gap_.size(); ++j) {
      if (is_rigid(j)) sum = sum + (scale_[j] * gap_[j]) * (scale_[j] * gap_[j]);
    }
    return sum;
  }

  /// Of the rigid row that is farthest open beside the size of its mechanism.
  S widest_gap() const {
    using std::abs, std::max;
    S widest(0.0);
    for (std::size_t j = 0; j < gap_.size(); ++j) {
      if (is_rigid(j)) widest = max(widest, abs(gap_[j]) / size_[j]);
    }
    return widest;
  }

  /// G v of a row; numbers: those of G, or J.
  S opening_of(const CouplingPath& path, std::size_t row, const Field<S>& v) const { return opening_of(path, row, begin_, v); }
  S opening_of(const CouplingPath& path, std::size_t row, const std::vector<S>& numbers, const Field<S>& v) const {
    const S* const g = &numbers[path.first_velocity + (row - path.first_row)];
    S sum(0.0);
    each_on_path(path, [&](Index at_v, std::size_t n) { sum = sum + g[n * path.room] * v(at_v); });
    return sum;
  }

  /// visit(velocity row, where it is among the path's) of joints that move the bodies of a coupling against each other.
  template <class Visit>
  void each_on_path(const CouplingPath& path, const Visit& visit) const {
    for (const std::size_t n : path.moving) visit(path.velocity_rows[n], n);
  }
  /// to = combine(to, G^T multipliers) on the paths; numbers: those of G, or J.
  template <class Combine>
  void push(const std::vector<S>& multipliers, const std::vector<S>& numbers, Field<S>& to, const Combine& combine) const {
    for (const CouplingPath& path : paths_.all()) {
      each_on_path(path, [&](Index v, std::size_t n) {
        S sum(0.0);
        for (std::size_t j = 0; j < path.rows(); ++j) {
          sum = sum + multipliers[path.first_row + j] * numbers[path.first_velocity + n * path.room + j];
        }
        to(v) = combine(to(v), sum);
      });
    }
  }

 private:
  /// A point, and its way in a step.
  struct Along {
    Vec3<S> begin, way;
  };
  /// How a body moves in a step, by what is small where that is.
  struct Moved {
    Placement<S> body;  // in the world, at its beginning
    Displacement<S> by;
    Moved(Index slot, const Field<S, 12>& world, const Field<S, 7>& displacement)
        : body{{{S(1.0), S(0.0), S(0.0)}, {S(0.0), S(1.0), S(0.0)}, {S(0.0), S(0.0), S(1.0)}}, {S(0.0), S(0.0), S(0.0)}},
          by{{{S(0.0), S(0.0), S(0.0)}, S(1.0)}, {S(0.0), S(0.0), S(0.0)}} {
      if (slot == 0) return;
      body = load<Placement, S>(world, slot);
      by = load<Displacement, S>(displacement, slot);
    }
    /// By how much a direction changes.
    Vec3<S> turned(const Vec3<S>& n) const { return body.R * turned_within(transpose_times(body.R, n)); }
    /// sin(theta/2) l of the turn against another body, seen from that one, which moves with it; in the world at the beginning.
    Vec3<S> half_turn_against(const Moved& other) const {
      const Vec3<S> mine = body.R * by.r.v, its = other.body.R * other.by.r.v;
      const Vec3<S> turn = other.by.r.w * mine - by.r.w * its - cross(its, mine);
      return select(other.by.r.w * by.r.w + dot(its, mine) < S(0.0), S(-1.0), S(1.0)) * turn;
    }
    Along along(const Vec3<S>& x) const { return {x, body.R * (by.p + turned_within(transpose_times(body.R, x - body.p)))}; }

   private:
    Vec3<S> turned_within(const Vec3<S>& x) const { return S(2.0) * cross(by.r.v, by.r.w * x + cross(by.r.v, x)); }
  };

  /// Points of a cable that are no farther apart have no direction [m].
  template <class Number>
  static constexpr double kNoDistance = is_single<Number> ? 1e-18 : 1e-150;

  /// Of all angles that are equal but for whole turns, that which is nearest to another.
  static S near(const S& angle, const S& to) {
    using std::floor;
    constexpr double kTurn = 2 * std::numbers::pi;
    return angle - as<S>(kTurn) * floor((angle - to) / as<S>(kTurn) + S(0.5));
  }
  static Placement<S> placement_of(const Pose& pose) {
    double numbers[12];
    std::ranges::copy(pose.rotation, numbers);
    std::ranges::copy(pose.shift, numbers + 9);
    return Placement<S>::from(numbers);
  }
  /// Where bodies of a path are, from the body that both of its bodies hang on.
  Placement<S> pose(Index number) const {
    const S zero(0.0), one(1.0);
    return number >= 0 ? load<Placement, S>(pose_, number) : Placement<S>{{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}}, {zero, zero, zero}};
  }
  /// Gaps where bodies are placed by their joints and coordinates moved by delta(row), and how joints change them where there are numbers for it;
  /// scales as well where it is asked.
  template <class PlacementOf, class DeltaOf>
  void look(const PlacementOf& placement, const DeltaOf& delta, std::vector<S>* numbers, bool scales) {
    using std::sqrt;
    std::size_t term = 0;
    for (const CouplingPath& path : paths_.all()) {
      const Coupling& coupling = *path.coupling;
      if (coupling.kind == CouplingKind::gear) {
        S& gap = gap_[path.first_row] = as<S>(coupling.offset);
        for (std::size_t k = 0; k < coupling.terms.size(); ++k, ++term) {
          gap = gap + as<S>(coupling.terms[k].ratio) * (at_start_[term] + delta(coupling.terms[k].v_row));
          if (numbers) (*numbers)[path.first_velocity + path.terms[k] * path.room] = as<S>(coupling.terms[k].ratio);
        }
        if (scales) scale_[path.first_row] = as<S>(1 / std::sqrt(path.least_yield));
        continue;
      }
      for (std::size_t k = path.joints.size(); k-- > 0;) {
        const CouplingPath::Joint& on = path.joints[k];
        if (on.sign == 0) continue;
        with_joint(model_.tree.kind(on.slot), [&](auto joint) {
          const Placement<S> X = placement(joint, on.slot);
          store(pose_, static_cast<Index>(k), on.above >= 0 ? placed_in(pose(on.above), X) : X);
        });
      }
      if (coupling.kind == CouplingKind::cable) {
        look_along(path, at_start_[term] + delta(coupling.terms.front().v_row), numbers, scales);
        ++term;
        continue;
      }
      const Placement<S> A = placed_in(pose(path.ends[0].at), placement_of(coupling.frame_a)), B = placed_in(pose(path.ends[1].at), placement_of(coupling.frame_b));
      const std::span<const GapRow> kinds = rows_of(coupling);
      std::array<Gap<S>, 6> gaps;
      std::array<Vec3<S>, 6> at;  // where forces act
      for (std::size_t j = 0; j < kinds.size(); ++j) {
        gaps[j] = gap_of(kinds[j], coupling.length, A, B);
        at[j] = B.p;
      }
      if (is_contact(coupling.kind)) {
        const auto behind = [](const Placement<S>& frame, double depth) { return Placement<S>{frame.R, frame.p + as<S>(depth) * axis_of(frame.R, 2)}; };
        const Placement<S> middle = behind(B, coupling.rounding[1]);
        gaps[2] = gap_of(kinds[2], 0, behind(A, -coupling.rounding[0]), middle);
        gaps[2].gap = gaps[2].gap - as<S>(coupling.rounding[0] + coupling.rounding[1]);
        at[2] = middle.p;
        if (coupling.oval != decltype(coupling.oval){}) roll(coupling.oval, B.R, gaps, at);
      }
      for (std::size_t j = 0; j < kinds.size(); ++j) gap_[path.first_row + j] = gaps[j].gap;
      for (std::size_t k = 0; numbers && k < path.joints.size(); ++k) {
        const CouplingPath::Joint& on = path.joints[k];
        if (on.sign == 0) continue;
        with_joint(model_.tree.kind(on.slot), [&](auto joint) {
          for (std::size_t j = 0; j < kinds.size(); ++j) {
            S along[6];
            gap_along(joint, model_.constants, on.slot, pose(static_cast<Index>(k)), at[j], gaps[j], as<S>(on.sign), along);
            S* const to = &(*numbers)[path.first_velocity + static_cast<std::size_t>(on.at) * path.room + j];
            for (std::size_t n = 0; n < static_cast<std::size_t>(velocity_count(joint)); ++n) to[n * path.room] = along[n];
          }
        });
      }
      for (std::size_t j = 0; scales && j < kinds.size(); ++j) {
        S moves(0.0);
        for (const CouplingPath::End& end : path.ends) moves = moves + moved(end, gaps[j], at[j]);
        scale_[path.first_row + j] = S(1.0) / sqrt(moves);
        if (kinds[j].kind == GapKind::angle) steepness_[path.first_row + j] = dot(gaps[j].couple, gaps[j].couple);
      }
    }
  }

  /// Of a contact by an oval, whose place `at` lay lowest along the normal at q^k: from there to where it does now.
  ///
  /// What sticks is the place that lies lowest in the middle of the step. A push at q^k where the body lies lowest then works along the mean of both
  /// steps beside it, which hold it half a step before and half a step behind that place: held where it lay at q^k, Euler's disk gained a fifth of its
  /// energy in 8 s.
  static void roll(const std::array<double, 6>& oval, const Mat3<S>& R, std::array<Gap<S>, 6>& gaps, std::array<Vec3<S>, 6>& at) {
    const Vec3<S> n = transpose_times(R, gaps[2].force), moved = rolled(oval, {n.x, n.y, n.z - S(1.0)}), in_world = R * moved;
    gaps[2].gap = gaps[2].gap + dot(gaps[2].force, in_world);
    at[2] = at[2] + in_world;
    for (const std::size_t j : {0u, 1u}) {
      gaps[j].gap = gaps[j].gap + S(0.5) * (dot(gaps[j].force, in_world) - (j == 0 ? moved.x : moved.y));
      at[j] = at[j] + S(0.5) * in_world;
    }
  }

  /// From the place of an oval that lies lowest along z to that which does along z + tilt.
  static Vec3<S> rolled(const std::array<double, 6>& oval, const Vec3<S>& tilt) {
    using std::max, std::sqrt;
    constexpr double kNoDepth = 1e-12;  // square of how deep it is beside what it was: a circle seen along its axis
    const auto number = [&](std::size_t k) { return as<S>(oval[k]); };
    const Mat3<S> Q{{number(0), number(1), number(2)}, {number(1), number(3), number(4)}, {number(2), number(4), number(5)}};
    const Vec3<S> turned = Q * tilt;
    const S more = max(S(2.0) * turned.z + dot(tilt, turned), as<S>(kNoDepth - 1) * Q.z.z), depth = sqrt(Q.z.z), now = sqrt(Q.z.z + more);
    return (more / (depth * now * (depth + now))) * Q.z - (S(1.0) / now) * turned;
  }

  /// The same of a cable whose bodies are placed, and whose length is to be this.
  void look_along(const CouplingPath& path, const S& length, std::vector<S>* numbers, bool scales) {
    using std::max, std::sqrt;
    const Vec3<S> none{S(0.0), S(0.0), S(0.0)};
    const std::vector<CablePoint>& points = path.coupling->points;
    ends_.assign(path.ends.size(), {S(0.0), none, none});
    S& gap = gap_[path.first_row] = S(0.0) - length;
    Vec3<S> from = none;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Placement<S> T = pose(path.ends[path.points[k]].at);
      const Vec3<S> x = T.p + T.R * Vec3<S>{as<S>(points[k].at[0]), as<S>(points[k].at[1]), as<S>(points[k].at[2])};
      if (k > 0) {
        const Vec3<S> d = x - from;
        const S distance = sqrt(dot(d, d));
        const Vec3<S> n = d / max(distance, as<S>(kNoDistance<S>));
        gap = gap + distance;
        const auto push = [&](std::size_t point, const Vec3<S>& force, const Vec3<S>& at) {
          Gap<S>& end = ends_[path.points[point]];
          end.force = end.force + force;
          end.couple = end.couple + cross(at, force);
        };
        push(k - 1, none - n, from);
        push(k, n, x);
      }
      from = x;
    }
    if (!numbers) return;
    for (Index k = 0; k < static_cast<Index>(path.joints.size()); ++k) store(pull_, k, Wrench<S>{none, none});
    for (std::size_t k = 0; k < ends_.size(); ++k) add_pull(path.ends[k].at, {ends_[k].couple, ends_[k].force});
    for (std::size_t k = 0; k < path.joints.size(); ++k) {
      const CouplingPath::Joint& on = path.joints[k];
      if (on.sign == 0) continue;
      const auto pull = load<Wrench, S>(pull_, static_cast<Index>(k));
      add_pull(on.above, pull);
      with_joint(model_.tree.kind(on.slot), [&](auto joint) {
        S along[6];
        gap_along(joint, model_.constants, on.slot, pose(static_cast<Index>(k)), none, Gap<S>{gap, pull.f, pull.n}, as<S>(on.sign), along);
        S* const to = &(*numbers)[path.first_velocity + static_cast<std::size_t>(on.at) * path.room];
        for (std::size_t n = 0; n < static_cast<std::size_t>(velocity_count(joint)); ++n) to[n * path.room] = along[n];
      });
    }
    (*numbers)[path.first_velocity + path.terms.front() * path.room] = S(-1.0);
    if (!scales) return;
    S moves = as<S>(path.least_yield);
    for (std::size_t k = 0; k < ends_.size(); ++k) moves = moves + moved(path.ends[k], ends_[k], none);
    scale_[path.first_row] = S(1.0) / sqrt(moves);
  }
  /// To what reaches the joint of this number from beyond, seen from the body that all hang on.
  void add_pull(Index number, const Wrench<S>& pull) {
    if (number >= 0) store(pull_, number, load<Wrench, S>(pull_, number) + pull);
  }

  /// How far a row would move by this body, were it free; x: where its force acts.
  S moved(const CouplingPath::End& end, const Gap<S>& gap, const Vec3<S>& x) const {
    const Placement<S> T = pose(end.at);
    const Vec3<S> moment = gap.couple + cross(x - T.p, gap.force);
    const Twist<S> w{transpose_times(T.R, moment), transpose_times(T.R, gap.force)};
    const Wrench<S> moves = Mat6<S>::from(end.yields.data()) * w;  // a wrench in, a twist out: the names are those of an inertia
    return dot(moves, w);
  }

  const Model& model_;
  CouplingPaths paths_;
  Field<S, 12> pose_;            // scratch: of a path, see pose()
  std::vector<S> begin_, end_;
  std::vector<S> at_start_;      // coordinates of gears and cables at q^k
  Field<S, 6> pull_;             // scratch: of a cable, what reaches each joint of its path from beyond
  std::vector<Gap<S>> ends_;     // likewise, what each of its bodies feels
  std::vector<S> gap_, size_, scale_, steepness_;
  struct Angle {
    std::size_t row;
    S begin;  // at q^k
  };
  std::vector<Angle> angles_;    // a step may lead past half a turn, where they begin anew
  bool keeps_scales_ = false;
};

}  // namespace linden
