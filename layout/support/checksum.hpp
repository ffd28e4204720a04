// layout/support/checksum.hpp
// FNV-1a, 64 bits: whether bytes are those that were written, and a short name for what must be the same. It finds faults, not forgeries.
#pragma once

#include <cstdint>
#include <cstring>
#include <string_view>

namespace linden {

class Checksum {
 public:
  void add(std::string_view bytes) {
    for (const char byte : bytes) state_ = (state_ ^ static_cast<unsigned char>(byte)) * 1099511628211ull;
  }
  template <class T>
  void add_number(const T& value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    add({bytes, sizeof(T)});
  }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 14695981039346656037ull;
};

inline std::uint64_t checksum(std::string_view bytes) {
  Checksum sum;
  sum.add(bytes);
  return sum.value();
}

}  // namespace linden
