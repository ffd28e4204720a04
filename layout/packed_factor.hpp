// layout/packed_factor.hpp
// What an instance of a batch keeps of a factored matrix (LINDEN_FACTOR_FIELDS; with mimic joints MimicTies::each): 32 bits a number, of a double its sign, exponent and first
// 20 digits. As what corrects a displacement it is as good as all digits are: 5e-7 of the correction is left to the next.
//
// In this order, run of joints by run: gain_up and gain_down, each [row][6]; then joint_inverse of all joints; then of k coordinates that move
// several joints [k][nv] and [k][k]. Gains of free joints are the identity, and left out.
#pragma once

#include <bit>
#include <cstdint>

#include <set>

#include "layout/model.hpp"

namespace linden {

/// Words of an instance.
inline Index packed_factor_words(const Model& model) {
  std::set<Index> leaders;
  for (const Mimic& mimic : model.mimics) leaders.insert(mimic.leader_slot);
  const auto k = static_cast<Index>(leaders.size());
  Index words = model.tree.shape.blocks + k * (model.tree.shape.velocities + k);
  for (const Run& run : model.tree.runs) {
    if (run.kind != JointKind::free) words += 12 * velocity_count(run.kind) * (run.end - run.begin);
  }
  return words;
}

template <class Real>
constexpr std::uint32_t packed_number(Real number) {
  if constexpr (sizeof(Real) == sizeof(float)) {
    return std::bit_cast<std::uint32_t>(number);
  } else {
    return static_cast<std::uint32_t>((std::bit_cast<std::uint64_t>(number) + 0x8000'0000u) >> 32);
  }
}
template <class Real>
constexpr Real unpacked_number(std::uint32_t word) {
  if constexpr (sizeof(Real) == sizeof(float)) {
    return std::bit_cast<float>(word);
  } else {
    return std::bit_cast<double>(std::uint64_t{word} << 32);
  }
}

}  // namespace linden
