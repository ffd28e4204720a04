#include "engine/queries/jacobian.hpp"

#include <algorithm>

#include "engine/queries/fold.hpp"
#include "engine/queries/link_frames.hpp"
#include "kernels/queries/jacobian_up.hpp"

namespace linden {
namespace {

Matrix jacobian_at(const Kinematics& state, Index slot, const Placement<double>& frame) {
  const Tree& tree = state.model().tree;
  Matrix J(6, tree.shape.velocities);
  jacobian_up(tree, state.model().constants, state.bodies().pose, slot, frame, J.numbers.data());
  return J;
}

Matrix lower_half(const Matrix& J) {
  Matrix half(3, J.columns);
  std::copy(J.numbers.begin() + static_cast<std::ptrdiff_t>(half.numbers.size()), J.numbers.end(), half.numbers.begin());
  return half;
}

constexpr Mat3<double> kUpright{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

}  // namespace

Matrix link_jacobian(const Kinematics& state, const LinkPlace& link, Frame frame) {
  const auto T = load<Placement, double>(state.bodies().pose, link.slot);
  const Placement<double> seen = seen_frame(frame, T, link);
  Matrix J = jacobian_at(state, link.slot, {T.R * seen.R, T.p + T.R * seen.p});
  fold_columns(state.model(), J);
  return J;
}

Matrix point_jacobian(const Kinematics& state, const LinkPlace& link, const std::array<double, 3>& at) {
  const Placement<double> T = frame_of(state, link);
  Matrix J = lower_half(jacobian_at(state, link.slot, {kUpright, T.p + T.R * vec3_of(at)}));
  fold_columns(state.model(), J);
  return J;
}

Matrix momentum_matrix(const Kinematics& state) {
  const Model& model = state.model();
  Field<double, 10> composite;
  composite.allocate(model.tree.shape.slots);
  composite_inertia_up(model.tree, model.constants, state.bodies().placement, composite);
  Matrix A(6, model.tree.shape.velocities);
  momentum_matrix_map(model.tree, model.constants, state.bodies().pose, composite, A.numbers.data());
  fold_columns(model, A);
  return A;
}

Matrix centre_of_mass_jacobian(const Kinematics& state) {
  Matrix J = lower_half(momentum_matrix(state));
  const double mass = state.model().constants.subtree_mass(0);
  for (double& number : J.numbers) number = mass > 0 ? number / mass : 0;
  return J;
}

}  // namespace linden
