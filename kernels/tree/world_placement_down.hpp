// kernels/tree/world_placement_down.hpp
// Placement of every body in the world.
//
//   T_i = T_lambda(i) X_i
//
// reads   placement 12 x n
// writes  pose 12 x n (body -> world; rotation row by row, shift [m])
// cost    one product of rotations a body
#pragma once

#include "kernels/values/joints.hpp"

namespace linden {

template <class S>
void world_placement_down(const Tree& tree, const Field<S, 12>& placement, Field<S, 12>& pose) {
  const S zero(0.0), one(1.0);
  store(pose, 0, Placement<S>{{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}}, {zero, zero, zero}});
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const auto T = load<Placement, S>(pose, tree.parent(i)), X = load<Placement, S>(placement, i);
    store(pose, i, Placement<S>{T.R * X.R, T.p + T.R * X.p});
  }
}

}  // namespace linden
