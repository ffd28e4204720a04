#include "kernels/values/lanes_of.hpp"

#include <catch2/catch.hpp>
#include <xsimd/xsimd.hpp>

namespace linden::lanes_of_test {
namespace {

template <class S>
void check_masks() {
  using L = LanesOf<S>;
  S numbers = S(0.0);
  for (int l = 0; l < L::count; ++l) L::set_lane(numbers, l, l + 1);
  for (Lanes lanes = 0; lanes < 1u << L::count; lanes += L::count > 8 ? 7 : 1) {
    const auto mask = L::mask(lanes);
    CHECK(L::bits(mask) == lanes);
    const S chosen = select(mask, numbers, S(0.0));
    for (int l = 0; l < L::count; ++l) CHECK(static_cast<int>(L::lane(chosen, l)) == ((lanes >> l & 1u) != 0 ? l + 1 : 0));
    CHECK(L::bits(chosen > S(0.0)) == lanes);  // what a comparison gives
  }
}

TEST_CASE("lanes as bits, and as a mask of a register, are the same lanes") {
  check_masks<double>();
  check_masks<xsimd::batch<double>>();
  check_masks<xsimd::batch<float>>();
#ifdef __SSE2__
  check_masks<xsimd::batch<double, xsimd::sse2>>();
  check_masks<xsimd::batch<float, xsimd::sse2>>();
#endif
}

}  // namespace
}  // namespace linden::lanes_of_test
