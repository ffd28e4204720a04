// tests/reference/elimination_plain.hpp
// Gaussian elimination of a dense matrix joint by joint, leaves first: what the O(n) factorisations do without it.
//
//   A <- A - A_:i d^-1 A_i:,   r <- r - A_:i d^-1 r_i,   d = A_ii at the time
#pragma once

#include "tests/reference/plain_tree.hpp"

namespace linden::reference {

struct Elimination {
  std::vector<MatrixXd> pivot;  // d of every joint
  VectorXd innovation;          // r_i at the time when joint i is eliminated
};

inline Elimination eliminate(const PlainTree& tree, MatrixXd A, VectorXd r) {
  Elimination result;
  result.pivot.resize(tree.bodies.size());
  result.innovation.resize(tree.velocities);
  for (Index i = tree.slots() - 1; i > 0; --i) {
    const PlainBody& body = tree.body(i);
    const MatrixXd d = A.block(body.v, body.v, body.dofs(), body.dofs());
    const MatrixXd column = A.middleCols(body.v, body.dofs()), line = A.middleRows(body.v, body.dofs());
    const VectorXd own = r.segment(body.v, body.dofs());
    const MatrixXd share = column * d.inverse();
    result.pivot[static_cast<std::size_t>(i)] = d;
    result.innovation.segment(body.v, body.dofs()) = own;
    A -= share * line;
    r -= share * own;
  }
  return result;
}

}  // namespace linden::reference
