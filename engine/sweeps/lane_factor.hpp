// engine/sweeps/lane_factor.hpp
// The factored Jacobian of a block of instances, held from step to step (engine/solve/held_factor.hpp). It is half of what a free step
// computes; a tumbling humanoid makes one in some nine steps.
//
// Each lane goes by its own numbers: it makes a factor when its own is expected to serve no longer, whatever the lanes beside it do, so its
// results are the same in any company. But a factor takes the same time for one lane as for all of them. So lanes agree on when to make one
// without asking each other: one that could hold its factor for 8 steps, or 11, makes it anew when its count of steps is a multiple of 8.
//
// Of an instance the factor is kept in numbers of 32 bits (layout/packed_factor.hpp). What was made is rounded so before it is used, so that
// it does not matter how many steps are taken in one go.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "engine/solve/block_stepper.hpp"
#include "engine/solve/held_factor.hpp"
#include "engine/solve/lane_counts.hpp"
#include "kernels/tree/articulated.hpp"
#include "kernels/tree/mimic.hpp"
#include "layout/packed_factor.hpp"
#include "layout/workspace.hpp"

namespace linden {

template <class Pack>
class LaneFactor {
 public:
  using Real = typename ElementOf<Pack>::type;
  using L = LanesOf<Pack>;
  using Mask = typename L::Mask;
  static constexpr int W = L::count;

  LaneFactor(const Model& model, bool holds)
      : tree_(model.tree), holds_(holds), ties_(model.mimics, model.tree), fresh_ties_(model.mimics, model.tree) {
    fresh_.allocate(tree_.shape);
  }
  /// Whether it outlasts a step.
  bool holds() const { return holds_; }

  /// The factor and what is known of it, of the instances of a block.
  void load(const Block<Real>& block, Workspace<Pack>& work) {
    made_ = 0;
    if (!holds()) return;
    for (int k = 0; k < kFacts; ++k) held_.numbers()[static_cast<std::size_t>(k)] = L::load(block.held + k * W);
    const std::uint32_t* words = block.factor;
    each_kept(work, [&](std::span<Pack> rows) {
      for (Pack& row : rows) {
        alignas(kAlignment) Real numbers[W];
        for (int l = 0; l < W; ++l) numbers[l] = unpacked_number<Real>(words[l]);
        row = L::load(numbers);
        words += W;
      }
    });
  }
  void store(const Block<Real>& block, Workspace<Pack>& work) {
    if (!holds()) return;
    for (int k = 0; k < kFacts; ++k) L::store(held_.numbers()[static_cast<std::size_t>(k)], block.held + k * W);
    if (made_ == 0) return;
    std::uint32_t* words = block.factor;
    each_kept(work, [&](std::span<Pack> rows) {
      for (const Pack& row : rows) {
        alignas(kAlignment) Real numbers[W];
        L::store(row, numbers);
        for (int l = 0; l < W; ++l) words[l] = packed_number(numbers[l]);
        words += W;
      }
    });
  }

  /// Lanes that make a factor for the first guess of the step that comes.
  Lanes due(const Block<Real>& block, double tolerance) {
    corrected_ = 0;
    made_in_step_ = {};
    if (!holds()) return ~Lanes(0);
    alignas(kAlignment) Real until[W];
    for (int l = 0; l < W; ++l) {
      const std::int64_t steps = l < block.count ? block.instances[l].steps : 0;
      until[l] = static_cast<Real>(2 << std::countr_zero(static_cast<std::uint64_t>(steps) | kLongest));
    }
    using std::max;
    due_ = ~L::bits(held_.serves(as<Pack>(tolerance), max(held_.age(), L::load(until))));
    fresh_ones_ = due_;
    return due_;
  }

  /// Where one is made, beside that which lanes may keep.
  Gains<Pack> fresh() { return {fresh_.gain_up, fresh_.gain_down, fresh_.joint_inverse}; }
  MimicTies<Pack>& fresh_ties() { return fresh_ties_; }
  /// Of the factor that there is.
  MimicTies<Pack>& ties() { return ties_; }
  /// What was made there is the factor of these lanes from now on.
  void take(Lanes lanes, Workspace<Pack>& work) {
    made_in_step_.add(lanes);
    const Mask mask = L::mask(lanes);
    made_ |= lanes;
    fresh_ones_ |= lanes;
    const auto each = [&](std::span<Pack> to, std::span<const Pack> from) {
      for (std::size_t k = 0; k < to.size(); ++k) {
        Pack number = from[k];
        if (holds()) {
          alignas(kAlignment) Real numbers[W];
          L::store(number, numbers);
          for (int l = 0; l < W; ++l) numbers[l] = unpacked_number<Real>(packed_number(numbers[l]));
          number = L::load(numbers);
        }
        to[k] = select(mask, number, to[k]);
      }
    };
    each(work.gain_up.flat(), fresh_.gain_up.flat());
    each(work.gain_down.flat(), fresh_.gain_down.flat());
    each(work.joint_inverse.flat(), fresh_.joint_inverse.flat());
    std::vector<std::span<Pack>> made;
    fresh_ties_.each([&](std::span<Pack> numbers) { made.push_back(numbers); });
    auto next = made.begin();
    ties_.each([&](std::span<Pack> numbers) { each(numbers, *next++); });
  }

  /// The first correction of a solve, in these lanes: squared energy norms of the residual before and after it, and their scale (judge.hpp).
  void first_correction(Lanes lanes, const Pack& before, const Pack& after, const Pack& scale) {
    corrected_ = lanes;
    guess_ = before;
    left_ = after;
    scale_ = scale;
  }
  /// The step of these lanes is solved, with a residual of this norm.
  void end(Lanes lanes, const Pack& norm, const Pack& scale, double tolerance) {
    if (!holds() || lanes == 0) return;
    if (corrected_ == 0) {
      guess_ = norm;
      scale_ = scale;
    }
    using std::sqrt;
    const Pack zero(Real(0)), half = as<Pack>(0.5);
    const auto ratio = [&](const Pack& above, const Pack& below) { return select(below > zero, sqrt(above / below), zero); };
    const Pack left = ratio(half * norm, scale);
    const Mask at_floor = left > as<Pack>(tolerance), fresh = L::mask(fresh_ones_), tried = L::mask(corrected_ & ~due_);
    HeldFactor<Pack> now = held_;
    now.begin(ratio(half * guess_, scale_), L::mask(due_));
    HeldFactor<Pack> measured = now;
    measured.corrected(ratio(left_, guess_), at_floor);
    now.end(left, at_floor, fresh);
    measured.end(left, at_floor, fresh);
    const Mask solved = L::mask(lanes);
    for (std::size_t k = 0; k < kFacts; ++k) {
      Pack& number = held_.numbers()[k];
      number = select(solved, select(tried, measured.numbers()[k], now.numbers()[k]), number);
    }
  }
  /// How many each lane made in the step there is.
  const LaneCounts<W>& made() const { return made_in_step_; }
  /// The factor of this lane is of no use any more.
  void drop(int lane) { L::set_lane(held_.age(), lane, 0); }

 private:
  static constexpr int kFacts = HeldFactor<Pack>::kNumbers;
  static constexpr std::uint64_t kLongest = 32;

  /// visit(rows) of all that is kept of a factor.
  template <class Visit>
  void each_kept(Workspace<Pack>& work, const Visit& visit) {
    for (const Run& run : tree_.runs) {
      if (run.kind == JointKind::free) continue;
      const std::size_t first = 6 * static_cast<std::size_t>(tree_.first_v(run.begin));
      const std::size_t count = 6 * static_cast<std::size_t>(velocity_count(run.kind) * (run.end - run.begin));
      visit(work.gain_up.flat().subspan(first, count));
      visit(work.gain_down.flat().subspan(first, count));
    }
    visit(work.joint_inverse.flat());
    ties_.each(visit);
  }

  const Tree& tree_;
  bool holds_;
  MassFactor<Pack> fresh_;
  MimicTies<Pack> ties_, fresh_ties_;
  HeldFactor<Pack> held_;
  Lanes made_ = 0;  // since the block was loaded
  Lanes due_ = 0;   // see due
  // of the step there is
  Lanes fresh_ones_ = 0;  // made in it
  LaneCounts<W> made_in_step_;
  Lanes corrected_ = 0;
  Pack guess_, left_, scale_;
};

}  // namespace linden
