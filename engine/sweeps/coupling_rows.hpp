// Rows of couplings where bodies are: gaps, and how joints change them.
//
//   place       q^k: gaps, and G on the paths
//   find_gaps   q^k+1: gaps, and J on the paths
//
// Bodies of a coupling are placed from the body that both hang on, joint by joint: what is rounded on the way from the world is of no account to
// a gap, at the end of a rope of a thousand cells as at its beginning.
//
// A row is scaled by how far it would move were its bodies free: metres and radians are alike then, and so are rows that others hold already.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "engine/sweeps/coupling_paths.hpp"
#include "kernels/block/evaluate_down.hpp"
#include "kernels/couplings/gap_map.hpp"
#include "kernels/couplings/row_lanes.hpp"
#include "layout/model.hpp"

namespace linden {

/// Side: of rows in memory.
template <class S, class Side = RowLanes<S, RowPack<S>>>
class CouplingRows {
 public:
  CouplingRows(const Model& model, Closing closing) : model_(model), paths_(model, closing, Side::count) {
    if (empty()) return;
    std::size_t longest = 0;
    for (const CouplingPath& path : paths_.all()) longest = std::max(longest, path.joints.size());
    pose_.allocate(static_cast<Index>(longest));
    for (std::vector<S>* each : {&gap_, &size_, &scale_}) each->assign(count(), S(0.0));
    for (std::vector<S>* each : {&begin_, &end_}) each->assign(paths_.velocities(), S(0.0));
    for (const CouplingPath& path : paths_.all()) {
      for (const auto& term : path.coupling->terms) at_start_.push_back(as<S>(term.ratio));
      for (std::size_t row = 0; row < path.rows(); ++row) {
        const GapKind kind = rows_of(path.coupling->kind)[row].kind;
        size_[path.first_row + row] = as<S>(kind == GapKind::product || kind == GapKind::sum ? 1.0 : path.length);
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
    look([&](auto, Index slot) { return load<Placement, S>(placement, slot); }, [](Index) { return S(0.0); }, begin_, !keeps_scales_);
  }
  /// Rows keep the scales of where they were placed last, so that gaps at several places can be compared.
  void keep_scales(bool keep) { keeps_scales_ = keep; }

  /// Gaps at the end of motions of the joints, and how joints change them there.
  void find_gaps(const Field<S, 12>& placement, const Field<S, 7>& motion, const Field<S>& delta) {
    look([&](auto joint, Index slot) { return after_motion(joint, load<Placement, S>(placement, slot), load_motion(joint, motion, slot)); },
         [&](Index row) { return delta(row); }, end_, false);
  }

  /// Of each row [m], or without a unit; by what it is judged; 1 / root of how far it would move were its bodies free.
  const std::vector<S>& gaps() const { return gap_; }
  const std::vector<S>& sizes() const { return size_; }
  const std::vector<S>& scales() const { return scale_; }
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

  /// G v of a row.
  S opening_of(const CouplingPath& path, std::size_t row, const Field<S>& v) const {
    const S* const g = &begin_[path.first_velocity + (row - path.first_row)];
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
  /// Gaps where bodies are placed by their joints and coordinates moved by delta(row), and how joints change them; scales as well where it is
  /// asked.
  template <class PlacementOf, class DeltaOf>
  void look(const PlacementOf& placement, const DeltaOf& delta, std::vector<S>& numbers, bool scales) {
    std::size_t term = 0;
    for (const CouplingPath& path : paths_.all()) {
      const Coupling& coupling = *path.coupling;
      if (coupling.kind == CouplingKind::gear) {
        S& gap = gap_[path.first_row] = as<S>(coupling.offset);
        for (std::size_t k = 0; k < coupling.terms.size(); ++k, ++term) {
          gap = gap + as<S>(coupling.terms[k].ratio) * (at_start_[term] + delta(coupling.terms[k].v_row));
          numbers[path.first_velocity + path.terms[k] * path.room] = as<S>(coupling.terms[k].ratio);
        }
        if (scales) scale_[path.first_row] = as<S>(1 / std::sqrt(path.gear_yield));
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
      const Placement<S> A = placed_in(pose(path.at_a), placement_of(coupling.frame_a)), B = placed_in(pose(path.at_b), placement_of(coupling.frame_b));
      const std::span<const GapRow> kinds = rows_of(coupling.kind);
      std::array<Gap<S>, 6> gaps;
      for (std::size_t j = 0; j < kinds.size(); ++j) {
        gaps[j] = gap_of(kinds[j], coupling.length, A, B);
        gap_[path.first_row + j] = gaps[j].gap;
      }
      for (std::size_t k = 0; k < path.joints.size(); ++k) {
        const CouplingPath::Joint& on = path.joints[k];
        if (on.sign == 0) continue;
        with_joint(model_.tree.kind(on.slot), [&](auto joint) {
          for (std::size_t j = 0; j < kinds.size(); ++j) {
            S along[6];
            gap_along(joint, model_.constants, on.slot, pose(static_cast<Index>(k)), B.p, gaps[j], as<S>(on.sign), along);
            S* const to = &numbers[path.first_velocity + static_cast<std::size_t>(on.at) * path.room + j];
            for (std::size_t n = 0; n < static_cast<std::size_t>(velocity_count(joint)); ++n) to[n * path.room] = along[n];
          }
        });
      }
      for (std::size_t j = 0; scales && j < kinds.size(); ++j) scale_[path.first_row + j] = scale_of(path, gaps[j], B.p);
    }
  }

  /// 1 / root of how far a row would move were its bodies free.
  S scale_of(const CouplingPath& path, const Gap<S>& gap, const Vec3<S>& x_b) const {
    using std::sqrt;
    const auto moved = [&](Index number, const std::array<double, 36>& yield) {
      const Placement<S> T = pose(number);
      const Vec3<S> moment = gap.couple + cross(x_b - T.p, gap.force);
      const Twist<S> w{transpose_times(T.R, moment), transpose_times(T.R, gap.force)};
      const Wrench<S> moves = Mat6<S>::from(yield.data()) * w;  // a wrench in, a twist out: the names are those of an inertia
      return dot(moves, w);
    };
    return S(1.0) / sqrt(moved(path.at_a, path.yield_a) + moved(path.at_b, path.yield_b));
  }

  const Model& model_;
  CouplingPaths paths_;
  Field<S, 12> pose_;            // scratch: of a path, see pose()
  std::vector<S> begin_, end_;
  std::vector<S> at_start_;      // coordinates of gears at q^k
  std::vector<S> gap_, size_, scale_;
  bool keeps_scales_ = false;
};

}  // namespace linden
