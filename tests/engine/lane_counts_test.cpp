#include "engine/solve/lane_counts.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <random>

namespace linden::lane_counts_test {
namespace {

template <int W>
void check_counts() {
  std::mt19937 random(1);
  LaneCounts<W> counts;
  std::array<int, W> plain{};
  for (int round = 0; round < 1000; ++round) {
    const Lanes lanes = static_cast<Lanes>(random()) & static_cast<Lanes>(random()) & ((1u << W) - 1);
    counts.add(lanes);
    for (int l = 0; l < W; ++l) plain[static_cast<std::size_t>(l)] += static_cast<int>(lanes >> l & 1u);
    if (round % 50 != 0) continue;
    for (int l = 0; l < W; ++l) {
      CHECK(counts.of(l) == plain[static_cast<std::size_t>(l)]);
      for (int other = 0; other < W; ++other) {
        CHECK((counts.same_as(l) >> other & 1u) == (plain[static_cast<std::size_t>(l)] == plain[static_cast<std::size_t>(other)] ? 1u : 0u));
      }
    }
    std::array<int, W> visited{};
    counts.each(lanes, [&](int l, int count) { visited[static_cast<std::size_t>(l)] = count + 1; });
    for (int l = 0; l < W; ++l) {
      CHECK(visited[static_cast<std::size_t>(l)] == ((lanes >> l & 1u) != 0 ? plain[static_cast<std::size_t>(l)] + 1 : 0));
    }
  }
}

TEST_CASE("lanes that are counted together have the counts that each would have alone", "[solve]") {
  check_counts<16>();
  check_counts<4>();
  check_counts<1>();
}

TEST_CASE("of a bit of many lanes those are found that have it as one of them has", "[solve]") {
  CHECK((same_lanes(0b0110, 1) & 0b1111) == 0b0110);
  CHECK((same_lanes(0b0110, 0) & 0b1111) == 0b1001);
}

}  // namespace
}  // namespace linden::lane_counts_test
