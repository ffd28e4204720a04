#include "engine/guess/extrapolation.hpp"

#include <algorithm>
#include <cstring>

#include "kernels/values/body_lanes.hpp"

namespace linden {
namespace {

constexpr std::array<std::array<double, kHistory>, kHistory> kThrough{{
    {1}, {2, -1}, {3, -3, 1}, {4, -6, 4, -1}, {5, -10, 10, -5, 1},
}};

/// Next value of the cubic nearest to the last 5.
constexpr std::array<double, kHistory> kCubic{3.2, -2.8, -0.8, 2.2, -0.8};

/// Fourth differences of noise are 1.87 times third ones; a motion that whips has such moments, but few.
constexpr double kNoise = 1.4;

/// Third differences below this share of the displacements leave no correction that rounding could matter to.
constexpr double kMuch = 3e-5;

/// Rows that are looked at, of histories with so many more that it does not show in the time of a step.
constexpr Index kSample = 128, kFewest = 8 * kSample;

/// Whether much of the last displacements, past(row, k) k steps ago, is noise from their third difference on.
template <class Past>
bool is_noise(Index rows, const Past& past) {
  double latest = 0, third = 0, fourth = 0;
  for (Index row = 0; row < rows; row += rows / kSample) {
    const double d[] = {past(row, 0), past(row, 1), past(row, 2), past(row, 3), past(row, 4)};
    const double now = d[0] - 3 * d[1] + 3 * d[2] - d[3], before = d[1] - 3 * d[2] + 3 * d[3] - d[4];
    latest += d[0] * d[0];
    third += now * now;
    fourth += (now - before) * (now - before);
  }
  return fourth > kNoise * kNoise * third && third > kMuch * kMuch * latest;
}

template <class Past>
Extrapolation extrapolation_of(Index rows, int terms, const Past& past) {
  const bool cubic = terms == kHistory && rows >= kFewest && is_noise(rows, past);
  return {cubic ? kCubic : polynomial_through(terms), terms};
}

}  // namespace

const std::array<double, kHistory>& polynomial_through(int terms) { return kThrough[static_cast<std::size_t>(terms - 1)]; }

Extrapolation extrapolation(const Field<double, kHistory>& history, int terms) {
  return extrapolation_of(history.rows(), terms, [&](Index row, int k) { return history(row, k); });
}

Extrapolation extrapolation_after(const Field<double>& latest, const Field<double, kHistory>& history, int terms) {
  return extrapolation_of(history.rows(), terms, [&](Index row, int k) { return k == 0 ? latest(row) : history(row, k - 1); });
}

void extrapolate(const Extrapolation& guess, const Field<double, kHistory>& history, Slots rows, Field<double>& delta) {
  Index row = rows.begin;
  if (guess.terms == kHistory) {
    for (; row + kBodies <= rows.end; row += kBodies) {
      BodyPack past[kHistory];
      turning::rows_to_lanes<kHistory>([&](int l) LINDEN_INLINE_LAMBDA { return history.row(row + l); }, past);
      BodyPack next = guess.shares[0] * past[0];
      for (std::size_t k = 1; k < kHistory; ++k) next = next + guess.shares[k] * past[k];
      next.store_unaligned(delta.row(row));
    }
  }
  for (; row < rows.end; ++row) delta(row) = extrapolated(guess, history, row);
}

void remember(const Field<double>& delta, Slots rows, Field<double, kHistory>& history) {
  for (Index row = rows.begin; row < rows.end; ++row) {
    double* const past = history.row(row);
    std::memmove(past + 1, past, (kHistory - 1) * sizeof(double));
    past[0] = delta(row);
  }
}

}  // namespace linden
