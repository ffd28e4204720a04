#include "engine/program/pull.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <span>

#include "engine/queries/jacobian.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/queries/mass_matrix.hpp"
#include "models/build/isometry.hpp"

namespace linden {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kFrequency = 9;      // [rad/s]
constexpr double kDampingRatio = 0.7;
constexpr double kMostWeights = 10;
constexpr double kGravity = 9.81;     // [m/s^2]

Vector3d vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

/// Of all that hangs on the same joint of the world.
double mass_with(const Model& model, Index slot) {
  while (model.tree.parent(slot) > 0) slot = model.tree.parent(slot);
  return model.constants.subtree_mass(slot);
}

Vector3d point_of(const Kinematics& now, const LinkPlace& link, const std::array<double, 3>& point) {
  return isometry(link_pose(now, link)) * vector_of(point);
}

std::span<const double> row_of_matrix(const Matrix& matrix, Index row) {
  const auto columns = static_cast<std::size_t>(matrix.columns);
  return std::span(matrix.numbers).subspan(static_cast<std::size_t>(row) * columns, columns);
}

double product(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

/// How much a force at the point moves it there: J M^-1 J^T [1/kg].
Matrix3d mobility(const Kinematics& now, const Matrix& J) {
  Matrix3d W;
  for (int column = 0; column < 3; ++column) {
    const std::vector<double> moved = solve_mass_matrix(now, row_of_matrix(J, column));
    for (int row = 0; row < 3; ++row) W(row, column) = product(row_of_matrix(J, row), moved);
  }
  return W;
}

}  // namespace

LinkPlace Pulls::place(const Pull& pull) const {
  const Names& names = simulation_.model().names;
  const auto link = names.link.find(names.body[static_cast<std::size_t>(pull.slot)]);
  return link != names.link.end() ? link->second : LinkPlace{pull.slot, {}};
}

Kinematics& Pulls::now() {
  if (now_) now_->set(simulation_);
  else now_.emplace(simulation_);
  return *now_;
}

void Pulls::apply() {
  if (!acts()) return;
  applied_ = any();
  if (!applied_) return simulation_.set_forces({});
  const Kinematics& state = now();
  const double h = simulation_.options().step;
  std::vector<double> forces(static_cast<std::size_t>(simulation_.model().tree.shape.velocities), 0.0);
  for (const auto& [who, pull] : pulls_) {
    const LinkPlace link = place(pull);
    const Matrix J = point_jacobian(state, link, pull.point);
    const double mass = mass_with(simulation_.model(), pull.slot);
    const double k = mass * kFrequency * kFrequency, c = 2 * kDampingRatio * mass * kFrequency;
    Vector3d v;
    for (int row = 0; row < 3; ++row) v[row] = product(row_of_matrix(J, row), state.velocities());
    const Vector3d wanted = k * (vector_of(pull.to) - point_of(state, link, pull.point) - h * v) - c * v;
    const Matrix3d softened = Matrix3d::Identity() + (c * h + k * h * h) * mobility(state, J);
    Vector3d f = softened.partialPivLu().solve(wanted);
    const double most = kMostWeights * mass * kGravity;
    if (f.norm() > most) f *= most / f.norm();
    for (int row = 0; row < 3; ++row) {
      const std::span<const double> arm = row_of_matrix(J, row);
      for (std::size_t n = 0; n < forces.size(); ++n) forces[n] += arm[n] * f[row];
    }
  }
  simulation_.set_forces(forces);
}

std::vector<DrawnPull> Pulls::drawn() {
  std::vector<DrawnPull> result;
  if (!any()) return result;
  const Kinematics& state = now();
  for (const auto& [who, pull] : pulls_) {
    const Vector3d from = point_of(state, place(pull), pull.point);
    result.push_back({pull.slot, {from.x(), from.y(), from.z()}, pull.to});
  }
  return result;
}

}  // namespace linden
