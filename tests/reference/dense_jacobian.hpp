// tests/reference/dense_jacobian.hpp
// The derivative of h r(delta) as a dense matrix: the kernels themselves, run on dual numbers. Its own twin, Algorithm
// 2 in plain matrices, is dense_jacobian_plain.hpp.
//
// Column j is the change of h r when coordinate j of the step's motion varies from the right, M <- M exp(S Delta).
#pragma once

#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/residual_up.hpp"
#include "layout/workspace.hpp"
#include "tests/reference/plain_tree.hpp"

namespace linden::reference {

/// d(h r)/d(Delta), the kernels run on dual numbers.
inline MatrixXd dense_jacobian(const Model& model, const Field<double, 12>& placement, const Field<double, 7>& motion) {
  using T = Dual<8>;
  const Tree& tree = model.tree;
  Workspace<T> work;
  work.allocate(tree.shape);
  for (std::size_t k = 0; k < placement.flat().size(); ++k) work.placement.flat()[k] = placement.flat()[k];
  return jacobian(tree.shape.velocities, [&](const VectorX<T>& eps) {
    for (Index row = 0; row < tree.shape.velocities; ++row) work.delta(row) = eps[row];
    motion_map(tree, model.constants, work.delta, work.motion);
    for (Index i = 1; i < tree.shape.slots; ++i) {
      Displacement<T> M;
      const auto at = load<Displacement, double>(motion, i);
      M.r = {{at.r.v.x, at.r.v.y, at.r.v.z}, at.r.w};
      M.p = {at.p.x, at.p.y, at.p.z};
      store(work.motion, i, M * load<Displacement, T>(work.motion, i));
    }
    displacement_down(tree, work.placement, work.motion, work.displacement);
    momentum_map(tree, model.constants, work.displacement, work.impulse);
    residual_up(tree, model.constants, work.placement, work.momentum_target, work.impulse, work.residual);
    VectorX<T> residual(tree.shape.velocities);
    for (Index row = 0; row < tree.shape.velocities; ++row) residual[row] = work.residual(row);
    return residual;
  });
}

}  // namespace linden::reference
