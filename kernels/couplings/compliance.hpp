// kernels/couplings/compliance.hpp
// Rows of couplings that give way: springs and dampers along a gap g, from g0 at q^k to g1 at q^k+1.
//
//   lambda = -h^2 (k ((1 - s) g0 + s g1) + d (g1 - g0) / h)      impulse over the step, times h
//   s lambda acts at the beginning along G(q^k),   (1 - s) lambda at the end along J(q^k+1)
//
// s as for springs and dampers of joints (kernels/effects/joint_impulses.hpp): 1/2 where a step resolves what the row does, so that the
// step is that of a discrete Lagrangian and symplectic; towards 1, backward Euler, where it does not. At each end what acts is a pair of
// opposite wrenches, so momentum is exact at any s. mu = s lambda takes the place of the multiplier of a row that is rigid:
//
//   g1 + yield mu + drift g0 = 0,   yield = 1 / (s (h^2 k s + h d)),   drift = (h^2 k (1 - s) - h d) / (h^2 k s + h d)
//
// which is affine in mu, and with k beyond all else g1 = 0, as of a rigid row: at s = 1 nothing is left of drift.
//
// To read velocities what acts at the beginning beyond the end counts half, as it is at q^k:  x = -(s - 1/2) h (k g + d G v).
//
// units   gaps of shifts and lengths in m, k in N/m, d in N s/m; of products and sums without a unit, k in N m, d in N m s
// energy  1/2 k g^2; takes (k (s - 1/2) + d / h) (g1 - g0)^2 a step
// source  Marsden, West, Discrete mechanics and variational integrators (2001), 2.3.1, 3.2 (discrete d'Alembert principle)
#pragma once

#include <cmath>

#include "kernels/effects/joint_impulses.hpp"
#include "kernels/values/scalar.hpp"
#include "layout/couplings.hpp"

namespace linden {

struct RowLaw {
  double share, yield, drift;
};

/// moves: how far the row opens by a unit of impulse along it (engine/sweeps/coupling_yields.hpp). Either number of the compliance is above
/// zero.
LINDEN_INLINE RowLaw row_law(const Compliance& compliance, double h, double moves) {
  const double k = h * h * compliance.stiffness, d = std::abs(h) * compliance.damping;
  const double share = begin_share(moves * (k + d)), both = share * k + d;
  return {share, 1 / (share * both), ((1 - share) * k - d) / both};
}

/// lambda of a step.
template <class S>
LINDEN_INLINE S row_impulse(const Compliance& compliance, double h, double share, const S& begin, const S& end) {
  return as<S>(-h * h * compliance.stiffness) * (begin + as<S>(share) * (end - begin)) - as<S>(h * compliance.damping) * (end - begin);
}

/// What the row took in a step [J].
template <class S>
LINDEN_INLINE S row_loss(const Compliance& compliance, double h, double share, const S& begin, const S& end) {
  return as<S>(compliance.stiffness * (share - 0.5) + compliance.damping / h) * (end - begin) * (end - begin);
}

}  // namespace linden
