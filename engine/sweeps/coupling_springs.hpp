// Rows of couplings that give way, within a step: their laws (kernels/couplings/compliance.hpp), and what they push.
//
//   place      gaps at q^k
//   begin      laws of a step of h
//   yield      what a law adds to the diagonal of S; to the right side, what is left of it
//   end        what it pushes at the end of a step, and took
//   excess     what it pushes at the beginning of a step beyond its end, half of it: beside p where velocities are read
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kernels/couplings/compliance.hpp"

namespace linden {

/// What is solved for: the displacement of a step, with J and gaps at its end; velocities at q^k, with G and no gaps, and those that momenta
/// are read as, where dampers of rows that give way have their say; positions that close the gaps there.
enum class Coupled : std::uint8_t { step, velocities, reading, positions };

template <class S>
class CouplingSprings {
 public:
  /// Row by row. yields: how far the row opens by a unit of impulse (coupling_yields.hpp).
  void add(std::size_t row, const Compliance& compliance, double yields) { springs_.push_back({row, compliance, yields}); }
  bool empty() const { return springs_.empty(); }

  void place(const std::vector<S>& gaps) {
    for (Spring& spring : springs_) spring.begin = gaps[spring.row];
  }
  void begin(double h) {
    for (Spring& spring : springs_) spring.law = row_law(spring.compliance, h, spring.yields);
  }

  /// What a row yields beside its bodies, where this is solved for; infinite: it pushes nothing.
  double yield(Coupled of, std::size_t row) const {
    const Spring& spring = spring_of(row);
    return of == Coupled::step      ? spring.law.yield
           : of == Coupled::reading ? 1 / (spring.excess * spring.compliance.damping)
                                    : std::numeric_limits<double>::infinity();
  }
  /// Of a step: -gaps become what is left of the laws, with multipliers lambda.
  void complete(const std::vector<S>& lambda, std::vector<S>& right_side) const {
    for (const Spring& spring : springs_) {
      S& left = right_side[spring.row];
      left = left - (as<S>(spring.law.yield) * lambda[spring.row] + as<S>(spring.law.drift) * spring.begin);
    }
  }
  /// How much farther a row works in a step than its gap changes, if at q^k and at q^k+1 it opens by these: nothing, where the step follows how it turns.
  S strays(std::size_t row, const S& gap, const S& opens_at_begin, const S& opens_at_end) const {
    const Spring& spring = spring_of(row);
    return opens_at_end + as<S>(spring.law.share) * (opens_at_begin - opens_at_end) - (gap - spring.begin);
  }
  /// Whole multiplier of a row, from the share of it that acts at the beginning.
  S whole(std::size_t row, const S& multiplier) const { return multiplier / as<S>(spring_of(row).law.share); }

  /// What rows push at the end of a step of h, where gaps are these; returns what they took [J].
  S end(double h, const std::vector<S>& gaps, std::vector<S>& push) const {
    S loss(0.0);
    std::ranges::fill(push, S(0.0));
    for (const Spring& spring : springs_) {
      const double share = spring.law.share;
      loss = loss + row_loss(spring.compliance, h, share, spring.begin, gaps[spring.row]);
      push[spring.row] = as<S>((1 - share) / h) * row_impulse(spring.compliance, h, share, spring.begin, gaps[spring.row]);
    }
    return loss;
  }
  /// x of rows for steps of h; opening: G v of each row, none where dampers have their say in the solve.
  void excess(double h, std::span<const S> opening, std::vector<S>& push) {
    begin(h);
    std::ranges::fill(push, S(0.0));
    for (Spring& spring : springs_) {
      spring.excess = (spring.law.share - 0.5) * h;
      S pulls = as<S>(spring.compliance.stiffness) * spring.begin;
      if (!opening.empty()) pulls = pulls + as<S>(spring.compliance.damping) * opening[spring.row];
      push[spring.row] = as<S>(-spring.excess) * pulls;
    }
  }
  /// At q^k [J].
  S potential() const {
    S sum(0.0);
    for (const Spring& spring : springs_) sum = sum + as<S>(0.5 * spring.compliance.stiffness) * spring.begin * spring.begin;
    return sum;
  }

 private:
  struct Spring {
    std::size_t row;
    Compliance compliance;
    double yields;
    RowLaw law{};
    double excess = 0;  // (s - 1/2) h, for readings
    S begin{};          // its gap at q^k
  };
  const Spring& spring_of(std::size_t row) const { return *std::ranges::lower_bound(springs_, row, {}, &Spring::row); }

  std::vector<Spring> springs_;  // by row
};

}  // namespace linden
