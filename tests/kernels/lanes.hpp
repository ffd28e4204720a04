// tests/kernels/lanes.hpp
// Packs as Scalars, one lane at a time, and the proof that a function of numbers treats all lanes alike.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>
#include <xsimd/xsimd.hpp>

#include "tests/kernels/allocation_counter.hpp"

namespace linden {

using Pack = xsimd::batch<double>;

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

template <class S>
inline constexpr std::size_t lane_count = 1;
template <>
inline constexpr std::size_t lane_count<Pack> = Pack::size;

inline double lane(const double& x, std::size_t) { return x; }
inline double lane(const Pack& x, std::size_t at) {
  std::array<double, Pack::size> values;
  x.store_unaligned(values.data());
  return values[at];
}

inline void set_lane(double& x, std::size_t, double value) { x = value; }
inline void set_lane(Pack& x, std::size_t at, double value) {
  std::array<double, Pack::size> values;
  x.store_unaligned(values.data());
  values[at] = value;
  x = Pack::load_unaligned(values.data());
}

inline bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

/// worst <- the largest of worst and the errors; an error that is no number is infinitely large.
template <class... Errors>
void see(double& worst, Errors... errors) {
  ((worst = std::isnan(errors) ? std::numeric_limits<double>::infinity() : std::max(worst, errors)), ...);
}

/// f: array of numbers -> array of numbers, given as a generic lambda. Every sample visits every lane, in two kinds of
/// company: its result has the same bits wherever it stands and is within `tolerance` of the plain path, in units of
/// its largest number. Nothing allocates.
template <std::size_t In, class Function>
void check_value_lanes(const Function& f, const std::vector<std::array<double, In>>& samples, double tolerance) {
  using Result = decltype(f(samples[0]));
  std::vector<Result> plain, packed(samples.size());
  for (const auto& sample : samples) plain.push_back(f(sample));
  std::vector<bool> seen(samples.size(), false);
  std::int64_t allocations = 0;
  for (const std::size_t stride : {1u, 3u}) {
    for (std::size_t round = 0; round < samples.size(); ++round) {
      const auto sample_in = [&](std::size_t l) {
        return (round + stride * l) % samples.size();
      };
      std::array<Pack, In> in{};
      for (std::size_t l = 0; l < Pack::size; ++l) {
        for (std::size_t k = 0; k < In; ++k) set_lane(in[k], l, samples[sample_in(l)][k]);
      }
      const AllocationCounter counter;
      const auto out = f(in);
      allocations += counter.count();
      for (std::size_t l = 0; l < Pack::size; ++l) {
        const std::size_t sample = sample_in(l);
        double scale = 0;
        for (const double value : plain[sample]) scale = std::max(scale, std::abs(value));
        for (std::size_t k = 0; k < out.size(); ++k) {
          const double found = lane(out[k], l);
          if (!seen[sample]) packed[sample][k] = found;
          const bool equal = same_bits(found, packed[sample][k]);
          const bool close = std::abs(found - plain[sample][k]) <= tolerance * scale;
          if (equal && close) continue;
          CAPTURE(sample, l, k, found, packed[sample][k], plain[sample][k]);
          REQUIRE(equal);
          REQUIRE(close);
        }
        seen[sample] = true;
      }
    }
  }
  CHECK(allocations == 0);
}

}  // namespace linden
