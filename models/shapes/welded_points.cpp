#include "models/shapes/welded_points.hpp"

#include <array>
#include <cmath>
#include <unordered_map>

namespace linden {
namespace {

constexpr double kOnePoint = 1e-5;  // of the mesh's size

struct CellHash {
  std::size_t operator()(const std::array<std::int64_t, 3>& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t k : cell) hash = (hash ^ static_cast<std::uint64_t>(k)) * 0x9E3779B97F4A7C15ULL + (hash >> 29);
    return hash;
  }
};

}  // namespace

std::vector<std::uint32_t> welded(const std::vector<Eigen::Vector3d>& points, const MeshBox& box) {
  std::vector<std::uint32_t> number;
  if (points.empty()) return number;
  const double cell = kOnePoint * box.sizes().maxCoeff();
  if (!(cell > 0)) return number;
  std::unordered_map<std::array<std::int64_t, 3>, std::uint32_t, CellHash> first;
  number.reserve(points.size());
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d u = (p - box.min()) / cell;
    const std::array<std::int64_t, 3> at{std::llround(u.x()), std::llround(u.y()), std::llround(u.z())};
    number.push_back(first.try_emplace(at, static_cast<std::uint32_t>(number.size())).first->second);
  }
  return number;
}

}  // namespace linden
