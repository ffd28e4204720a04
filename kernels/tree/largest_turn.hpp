// kernels/tree/largest_turn.hpp
// How far apart two displacements of a step are, as a turn of a joint.
//
//   max over joints of |r (a - b)|    of a screw;    max over its rows of |a - b|    of the turning rows of a ball or free joint
//
// Shifts do not count: the equation of a step is linear in them, and only turns give it other roots.
//
// reads   screw 2 x n, a nv, b_of(row)
// returns [rad]
// cost    one pass over the rows
// source  Kantorovich, Akilov, Functional Analysis, XVIII.1: a root is alone within a distance that the curvature of its equation sets
#pragma once

#include "kernels/values/joints.hpp"

namespace linden {

template <class S, class Element, class RowOf>
S largest_turn(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& a, const RowOf& b_of) {
  using std::abs;
  using std::max;
  S most(0.0);
  down(tree, [&](auto joint, Index i) {
    const Index row = tree.first_v(i);
    if constexpr (joint == JointKind::screw) {
      most = max(most, abs(load_screw<S>(constants, i).r * (a(row) - b_of(row))));
    } else {
      for (Index k = row; k < row + 3; ++k) most = max(most, abs(a(k) - b_of(k)));
    }
  });
  return most;
}

}  // namespace linden
