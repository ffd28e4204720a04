// tests/kernels/allocation_counter.hpp
// How often memory was asked for: every operator new of the program is counted, of all threads and all its libraries.
#pragma once

#include <cstdint>

namespace linden {

class AllocationCounter {
 public:
  AllocationCounter() : start_(total()) {}
  /// Allocations since construction.
  std::int64_t count() const { return total() - start_; }

 private:
  static std::int64_t total();
  std::int64_t start_;
};

}  // namespace linden
