// bench/machine.hpp
// What a benchmark ran on and how it was built: printed above every table, since a time without them means nothing.
#pragma once

#include <benchmark/benchmark.h>

#include <fstream>
#include <string>

namespace linden {

inline std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

inline void describe_machine() {
  benchmark::AddCustomContext("processor", processor());
  benchmark::AddCustomContext("compiler", __VERSION__);
#if defined(__AVX512F__)
  benchmark::AddCustomContext("instructions", "AVX-512");
#elif defined(__AVX2__)
  benchmark::AddCustomContext("instructions", "AVX2");
#else
  benchmark::AddCustomContext("instructions", "baseline");
#endif
}

/// Adds the column "per_body": seconds a body, printed with its unit (ns).
inline void per_body(benchmark::State& state, double bodies) {
  state.counters["per_body"] =
      benchmark::Counter(bodies, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

}  // namespace linden
