// Compiled for each set of instructions; CMakeLists.txt says which: LINDEN_INSTRUCTIONS names the set, LINDEN_PACK its register of Real
// numbers.
#include "engine/queries/lane_observer.hpp"

#include <xsimd/xsimd.hpp>

namespace linden {
namespace {

template <class Real>
using PackOf = LINDEN_PACK;

}  // namespace

template <>
std::unique_ptr<BlockObserver<double>> make_block_observer<Instructions::LINDEN_INSTRUCTIONS>(const ObserverSetup<double>& setup) {
  return std::make_unique<LaneObserver<PackOf<double>>>(setup);
}
template <>
std::unique_ptr<BlockObserver<float>> make_block_observer<Instructions::LINDEN_INSTRUCTIONS>(const ObserverSetup<float>& setup) {
  return std::make_unique<LaneObserver<PackOf<float>>>(setup);
}

}  // namespace linden
