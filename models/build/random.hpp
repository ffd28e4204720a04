// models/build/random.hpp
// Random numbers that are the same on every machine and with every standard library.
//
// source  Steele, Lea, Flood: Fast splittable pseudorandom number generators (SplitMix64); Shoemake: uniform random rotations
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace linden {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }

  std::uint64_t below(std::uint64_t bound) { return next() % bound; }
  /// 53 random bits in [low, high).
  double uniform(double low, double high) { return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53; }

  /// Uniform over all rotations.
  Eigen::Quaterniond rotation() {
    const double u = uniform(0, 1), a = uniform(0, 2 * std::numbers::pi), b = uniform(0, 2 * std::numbers::pi);
    const double s = std::sqrt(1 - u), c = std::sqrt(u);
    return {c * std::cos(b), s * std::sin(a), s * std::cos(a), c * std::sin(b)};
  }

 private:
  std::uint64_t state_;
};

}  // namespace linden
