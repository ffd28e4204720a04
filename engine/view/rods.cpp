#include "engine/view/rods.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

namespace linden {
namespace {

using Eigen::Vector3d;

constexpr double kDensity = 2500;                  // [kg/m^3]
constexpr double kThinnest = 0.03, kThickest = 0.12;  // radius over the length of the longest rod
constexpr double kNoLength = 1e-9;                 // [m]

}  // namespace

BodyRods rods_of(const Model& model, Index slot, const std::vector<Index>& children) {
  BodyRods rods;
  const BodyConstants<double>& constants = model.constants;
  const double mass = constants.inertia(slot, 0);
  std::set<std::array<double, 3>> joints;  // where several bodies hang at one place, one rod leads there
  for (const Index child : children) {
    std::array<double, 3> joint{};
    for (int k = 0; k < 3; ++k) joint[static_cast<std::size_t>(k)] = constants.tree_placement(child, 9 + k);
    if (joints.insert(joint).second) rods.ends.emplace_back(joint[0], joint[1], joint[2]);
  }
  rods.carries = !children.empty();
  if (!rods.carries && mass > 0) {
    rods.ends.push_back(2 / mass * Vector3d(constants.inertia(slot, 1), constants.inertia(slot, 2), constants.inertia(slot, 3)));
  }
  std::erase_if(rods.ends, [](const Vector3d& end) { return !(end.norm() > kNoLength); });
  double all = 0, longest = 0;
  for (const Vector3d& end : rods.ends) {
    all += end.norm();
    longest = std::max(longest, end.norm());
  }
  if (longest > 0) {
    rods.radius = std::clamp(std::sqrt(mass / (std::numbers::pi * kDensity * all)), kThinnest * longest, kThickest * longest);
  } else if (mass > 0) {
    rods.radius = std::cbrt(3 * mass / (4 * std::numbers::pi * kDensity));
  }
  return rods;
}

}  // namespace linden
