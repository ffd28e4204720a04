#include "engine/mass_distribution.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "kernels/tree/placement_map.hpp"

namespace linden {

MassDistribution mass_distribution(const Model& model, std::span<const double> q) {
  using Eigen::Isometry3d;
  using Eigen::Vector3d;
  const Tree& tree = model.tree;
  Field<double> positions;
  positions.allocate(tree.shape.positions);
  std::ranges::copy(q, positions.flat().begin());
  Field<double, 12> placement;
  placement.allocate(tree.shape.slots);
  placement_map(tree, model.constants, positions, placement);

  std::vector<Isometry3d> pose(static_cast<std::size_t>(tree.shape.slots), Isometry3d::Identity());
  MassDistribution result;
  Vector3d center = Vector3d::Zero();
  for (Index i = 1; i < tree.shape.slots; ++i) {
    Isometry3d in_parent = Isometry3d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) in_parent.linear()(row, column) = placement(i, 3 * row + column);
      in_parent.translation()[row] = placement(i, 9 + row);
    }
    Isometry3d& body = pose[static_cast<std::size_t>(i)] = pose[static_cast<std::size_t>(tree.parent(i))] * in_parent;
    const auto inertia = [&](int component) { return model.constants.inertia(i, component); };
    const Vector3d moment = body.linear() * Vector3d(inertia(1), inertia(2), inertia(3));
    const Vector3d p = body.translation();
    result.mass += inertia(0);
    center += moment + inertia(0) * p;
    result.polar_moment += inertia(0) * p.squaredNorm() + 2 * p.dot(moment) + 0.5 * (inertia(4) + inertia(7) + inertia(9));
  }
  if (result.mass > 0) center /= result.mass;
  result.center = {center.x(), center.y(), center.z()};
  return result;
}

}  // namespace linden
