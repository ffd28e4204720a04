// Compiled for each set of instructions, with effects and without; CMakeLists.txt says which: LINDEN_INSTRUCTIONS names the set,
// LINDEN_PACK its register of Real numbers, LINDEN_ACTING is true or false.
#include "engine/solve/lane_stepper.hpp"

#include <xsimd/xsimd.hpp>

namespace linden {
namespace {

template <class Real>
using PackOf = LINDEN_PACK;

template <class Real>
std::unique_ptr<BlockStepper<Real>> make_lane_stepper(const BlockSetup<Real>& setup) {
  return std::make_unique<LaneStepper<PackOf<Real>, LINDEN_ACTING>>(setup);
}

}  // namespace

template <>
std::unique_ptr<BlockStepper<double>> make_block_stepper<Instructions::LINDEN_INSTRUCTIONS, LINDEN_ACTING>(const BlockSetup<double>& setup) {
  return make_lane_stepper<double>(setup);
}
template <>
std::unique_ptr<BlockStepper<float>> make_block_stepper<Instructions::LINDEN_INSTRUCTIONS, LINDEN_ACTING>(const BlockSetup<float>& setup) {
  return make_lane_stepper<float>(setup);
}

}  // namespace linden
