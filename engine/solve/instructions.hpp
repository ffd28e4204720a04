// engine/solve/instructions.hpp
// Sets of vector instructions that blocks of instances are compiled for; which of them this processor has is known when the program starts.
// On x86-64 a build has AVX2 and AVX-512, or SSE2 in their place (LINDEN_WIDE_LANES in CMakeLists.txt).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace linden {

/// Lanes of double precision; of single precision twice as many, but for one.
enum class Instructions : std::uint8_t {
  scalar,    // 1: no vector instructions
  baseline,  // 2: SSE2, NEON
  avx2,      // 4: AVX2 and FMA
  avx512,    // 8
};

/// The best that this processor has and linden was compiled for.
Instructions best_instructions();
bool available(Instructions instructions);
std::string_view name(Instructions instructions);
/// Throws InputError naming the choices where `text` is none of them.
Instructions instructions_from(const std::string& text);
/// Instances of a block.
template <class Real>
int lanes_of(Instructions instructions);

}  // namespace linden
