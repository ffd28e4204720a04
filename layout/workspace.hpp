// layout/workspace.hpp
// Scratch of one thread: what the sweeps of a step hand to each other. Nothing in it outlives a step, so a thread needs one
// workspace however many instances it steps. All impulses are carried times h (see kernels/tree/momentum_map.hpp).
#pragma once

#include <type_traits>

#include "layout/field.hpp"

namespace linden {

/// Room for a 6 x 6 matrix: four 3 x 3 blocks row by row; one tree's are also held as six rows of eight, one a register.
template <class Scalar>
inline constexpr int kMatrixNumbers = std::is_same_v<Scalar, double> ? 48 : 36;

/// A factored matrix of the tree: the mass matrix or a Jacobian.
#define LINDEN_FACTOR_FIELDS(FIELD)                                                          \
  FIELD(Scalar, gain_up, 6, velocities, "Pi S d^-1, one row a degree of freedom")            \
  FIELD(Scalar, gain_down, 6, velocities, "(S^T Pi)^T d^-T, one row a degree of freedom")    \
  FIELD(Scalar, joint_inverse, 1, blocks, "d^-1, d = S^T Pi S, row by row")

#define LINDEN_WORKSPACE_FIELDS(FIELD)                                                                                 \
  FIELD(Scalar, placement, 12, slots, "X: child -> parent at q; rotation row by row, shift [m]")                       \
  FIELD(Scalar, motion, 7, slots, "exp(S delta): the joint's own displacement; quaternion x y z w, shift [m]")         \
  FIELD(Scalar, displacement, 7, slots, "dT = T(k)^-1 T(k+1); quaternion x y z w, shift [m], body frame")              \
  FIELD(Scalar, twist, 6, slots, "V: velocity of the body [rad/s, m/s], body frame")                                \
  FIELD(Scalar, turn, 3, slots, "angular part of h V [rad]")                                                           \
  FIELD(Scalar, impulse, 6, slots, "h F: h mu, then summed over the subtree; moment, force")                           \
  FIELD(Scalar, articulated, kMatrixNumbers<Scalar>, slots, "articulated inertia; or what of Pi waits, see Tree::pending") \
  LINDEN_FACTOR_FIELDS(FIELD)                                                                                          \
  FIELD(Scalar, bias, 6, slots, "b: impulse that reaches the parent when the joints yield")                            \
  FIELD(Scalar, variation, 6, slots, "eta: change of the body's pose at k+1, body frame [rad, m]")                     \
  FIELD(Scalar, residual, 1, velocities, "h r [kg m^2, kg m]")                                                         \
  FIELD(Scalar, momentum_target, 1, velocities, "h (p + h/2 Q): what the residual is measured against")                \
  FIELD(Scalar, innovation, 1, velocities, "u = r - S^T b")                                                            \
  FIELD(Scalar, increment, 1, velocities, "Delta: the correction of the displacement [rad, m]")                        \
  FIELD(Scalar, applied, 1, velocities, "the correction applied last [rad, m]")                                        \
  FIELD(Scalar, end_momentum, 1, velocities, "h p at the end of the step, but for its forces [kg m^2, kg m]")          \
  FIELD(Scalar, end_impulse, 1, velocities, "what effects of joints add to p at the end of the step")                  \
  FIELD(Scalar, momentum, 1, velocities, "M v, or h p of a displacement, of whoever asks")                              \
  FIELD(Scalar, delta, 1, velocities, "delta: displacement of the joints, first guess and then better [rad, m]")                     \
  FIELD(Scalar, force, 1, velocities, "Q: generalized force of the potentials at q [N m, N]")                          \
  FIELD(Scalar, field, 3, slots, "gravity in the body frame [m/s^2]")                                                  \
  FIELD(Scalar, first_moment, 3, slots, "m c of the subtree, body frame [kg m]")

template <class Scalar>
struct Workspace {
  LINDEN_FIELDS(LINDEN_WORKSPACE_FIELDS)
};

/// Factor of the mass matrix, where that of the steps is to stay when velocities are read.
template <class Scalar>
struct MassFactor {
  LINDEN_FIELDS(LINDEN_FACTOR_FIELDS)
};

#define LINDEN_KEPT_FIELDS(FIELD)                                                  \
  FIELD(Scalar, motion, 7, slots, "of the accepted displacement, as in Workspace") \
  FIELD(Scalar, displacement, 7, slots, "likewise")                                \
  FIELD(Scalar, impulse, 6, slots, "likewise")                                     \
  FIELD(Scalar, innovation, 1, velocities, "likewise")                             \
  FIELD(Scalar, delta, 1, velocities, "likewise")

/// Of a block of instances: results of those that are done, while others go on.
template <class Scalar>
struct Kept {
  LINDEN_FIELDS(LINDEN_KEPT_FIELDS)
};

/// Fills every field of a structure with NaN.
template <class Structure>
void poison_all(Structure& structure) {
  Structure::each(structure, [](const char*, auto& field, Rows, const char*) { poison(field); });
}

/// Bytes held by the fields of a structure.
template <class Structure>
std::size_t bytes(const Structure& structure) {
  std::size_t total = 0;
  Structure::each(structure, [&](const char*, const auto& field, Rows, const char*) { total += field.bytes(); });
  return total;
}

/// Bytes that the fields of a structure take, without allocating them.
template <class Structure>
std::size_t bytes_for(const Shape& shape) {
  const Structure empty{};
  std::size_t total = 0;
  Structure::each(empty, [&](const char*, const auto& field, Rows rows, const char*) {
    using Kind = std::remove_cvref_t<decltype(field)>;
    total += static_cast<std::size_t>(shape.rows(rows)) * Kind::components * sizeof(typename Kind::value_type);
  });
  return total;
}

}  // namespace linden
