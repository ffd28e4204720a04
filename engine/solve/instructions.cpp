// Which vector instructions this processor has.
#include <fmt/format.h>

#include "engine/solve/instructions.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

bool available(Instructions instructions) {
  switch (instructions) {
    case Instructions::scalar: return true;
#ifdef LINDEN_WIDE_LANES
    case Instructions::avx2: return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case Instructions::avx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512cd");
#else
    case Instructions::baseline: return true;
#endif
    default: return false;
  }
}

Instructions best_instructions() {
  for (const Instructions candidate : {Instructions::avx512, Instructions::avx2, Instructions::baseline}) {
    if (available(candidate)) return candidate;
  }
  return Instructions::scalar;
}

std::string_view name(Instructions instructions) {
  switch (instructions) {
    case Instructions::scalar: return "scalar";
    case Instructions::baseline: return "baseline";
    case Instructions::avx2: return "avx2";
    case Instructions::avx512: return "avx512";
  }
  return "?";
}

Instructions instructions_from(const std::string& text) {
  for (const Instructions one : {Instructions::scalar, Instructions::baseline, Instructions::avx2, Instructions::avx512}) {
    if (text == name(one)) return one;
  }
  throw InputError(fmt::format("instructions \"{}\" are not known; choose one of: scalar, baseline, avx2, avx512", text));
}

template <class Real>
int lanes_of(Instructions instructions) {
  switch (instructions) {
    case Instructions::scalar: return 1;
    case Instructions::baseline: return 16 / static_cast<int>(sizeof(Real));
    case Instructions::avx2: return 32 / static_cast<int>(sizeof(Real));
    case Instructions::avx512: return 64 / static_cast<int>(sizeof(Real));
  }
  return 1;
}

template int lanes_of<double>(Instructions instructions);
template int lanes_of<float>(Instructions instructions);

}  // namespace linden
