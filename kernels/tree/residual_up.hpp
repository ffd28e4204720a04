// kernels/tree/residual_up.hpp
// Residual of the discrete Euler-Lagrange equation in momentum form, leaves to root.
//
//   h r = S^T F - h (p + h/2 Q)          F: impulse_up of h mu;  (21), (22) with the terms of the step before gathered in p
//
// reads   screw 2 x n, placement 12 x n at q^k, impulse 6 x n holding h mu, momentum_target nv
// writes  impulse 6 x n (h F), residual nv [kg m^2, kg m]
// returns |h r|^2, the paper's norm
#pragma once

#include "kernels/tree/impulse_up.hpp"

namespace linden {

template <class S, class Element>
S residual_up(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
              const Field<S>& momentum_target, Field<S, 6>& impulse, Field<S>& residual) {
  impulse_up(tree, constants, placement, impulse, residual);
  S norm(0.0);
  for (Index row = 0; row < tree.shape.velocities; ++row) {
    residual(row) = residual(row) - momentum_target(row);
    norm = norm + residual(row) * residual(row);
  }
  return norm;
}

}  // namespace linden
