#include "bench/comparators/svi.hpp"

#include "kernels/tree/gravity.hpp"
#include "kernels/tree/placement_map.hpp"

namespace linden::comparators {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// ad_a b
Twistd bracket(const Twistd& a, const Twistd& b) { return {cross(a.w, b.w), cross(a.w, b.v) + cross(a.v, b.w)}; }

}  // namespace

Svi::Svi(const Model& model) : model_(model), ancestry_(model.tree) {
  const Shape& shape = model.tree.shape;
  for (Field<double>* field : {&q_, &momentum_, &middle_, &by_rate_, &by_position_}) field->allocate(shape.velocities);
  placement_.allocate(shape.slots);
  field_.allocate(shape.slots);
  const auto slots = at(shape.slots);
  for (auto* twists : {&rate_, &dA_, &dU_}) twists->resize(slots, Twistd{});
  for (auto* wrenches : {&m_, &weight_, &GA_, &GU_, &Gz_}) wrenches->resize(slots, Wrenchd{});
  A_.resize(ancestry_.pairs());
  U_.resize(ancestry_.pairs());
}

void Svi::begin(const StepStart& start) {
  h_ = start.h;
  gravity_ = start.gravity;
  weightless_ = dot(gravity_, gravity_) == 0;
  vector(q_) = vector(start.state.q);
  vector(momentum_) = h_ * vector(start.state.p);
}

bool Svi::residual(const Field<double>& delta, Field<double>& hr) {
  const Tree& tree = model_.tree;
  vector(middle_) = vector(q_) + 0.5 * vector(delta);
  placement_map(tree, model_.constants, middle_, placement_);
  if (!weightless_) gravity_field_down(tree, placement_, gravity_, field_);
  vector(by_rate_).setZero();
  vector(by_position_).setZero();
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const Index parent = tree.parent(i);
    const auto X = load<Placement, double>(placement_, i);
    const auto G = load<Inertia, double>(model_.constants.inertia, i);
    const Twistd S = along(model_, i, 1);
    const Twistd u = to_child(X, rate_[at(parent)]) + delta(i - 1) * S;
    rate_[at(i)] = u;
    const Wrenchd m = G * u;
    m_[at(i)] = m;
    if (!weightless_) weight_[at(i)] = G * Twistd{{0, 0, 0}, (h_ * h_) * load<Vec3, double>(field_, i)};

    const auto path = ancestry_.path(i);
    Twistd* const A = A_.data() + ancestry_.first(i);
    Twistd* const U = U_.data() + ancestry_.first(i);
    if (parent != 0) {
      const Twistd* const A_parent = A_.data() + ancestry_.first(parent);
      const Twistd* const U_parent = U_.data() + ancestry_.first(parent);
      for (std::size_t j = 0; j + 1 < path.size(); ++j) {
        A[j] = to_child(X, A_parent[j]);
        U[j] = to_child(X, U_parent[j]);
      }
    }
    A[path.size() - 1] = S;
    U[path.size() - 1] = bracket(u, S);
    for (std::size_t j = 0; j < path.size(); ++j) {
      by_rate_(path[j] - 1) += dot(m, A[j]);
      by_position_(path[j] - 1) += dot(m, U[j]);
      if (!weightless_) by_position_(path[j] - 1) += dot(weight_[at(i)], A[j]);
    }
  }
  vector(hr) = vector(by_rate_) - 0.5 * vector(by_position_) - vector(momentum_);
  return true;
}

void Svi::jacobian(Eigen::MatrixXd& J) {
  J.setZero(model_.tree.shape.velocities, model_.tree.shape.velocities);
  // products of first derivatives
  for (Index i = 1; i < model_.tree.shape.slots; ++i) {
    const auto path = ancestry_.path(i);
    const auto G = load<Inertia, double>(model_.constants.inertia, i);
    const Twistd* const A = A_.data() + ancestry_.first(i);
    const Twistd* const U = U_.data() + ancestry_.first(i);
    const Vec3d g = weightless_ ? Vec3d{0, 0, 0} : (h_ * h_) * load<Vec3, double>(field_, i);
    for (std::size_t l = 0; l < path.size(); ++l) {
      GA_[l] = G * A[l];
      GU_[l] = G * U[l];
      if (!weightless_) Gz_[l] = G * Twistd{{0, 0, 0}, cross(g, A[l].w)};  // of h^2 dgamma_i/dq_l = -h^2 ad_A gamma
    }
    for (std::size_t l = 0; l < path.size(); ++l) {
      const Index column = path[l] - 1;
      for (std::size_t j = 0; j <= l; ++j) {
        const Index row = path[j] - 1;
        double even = dot(GA_[l], A[j]) - 0.25 * dot(GU_[l], U[j]);
        if (!weightless_) even -= 0.25 * dot(Gz_[l], A[j]);
        const double odd = 0.5 * (dot(GU_[l], A[j]) - dot(GU_[j], A[l]));
        J(row, column) += even + odd;
        if (j != l) J(column, row) += even - odd;
      }
    }
  }
  second_derivatives(J);
}

void Svi::second_derivatives(Eigen::MatrixXd& J) {
  const Tree& tree = model_.tree;
  for (Index l = 1; l < tree.shape.slots; ++l) {
    const auto path = ancestry_.path(l), subtree = ancestry_.subtree(l);
    const Twistd* const A = A_.data() + ancestry_.first(l);
    const Twistd* const U = U_.data() + ancestry_.first(l);
    const Twistd S = along(model_, l, 1);
    for (std::size_t j = 0; j < path.size(); ++j) {
      double by_rate = 0, by_position = 0;
      for (const Index i : subtree) {
        if (i == l) {
          dA_[at(l)] = bracket(A[j], S);
          dU_[at(l)] = bracket(U[j], S);
        } else {
          const auto X = load<Placement, double>(placement_, i);
          dA_[at(i)] = to_child(X, dA_[at(tree.parent(i))]);
          dU_[at(i)] = to_child(X, dU_[at(tree.parent(i))]);
        }
        by_rate += dot(m_[at(i)], dA_[at(i)]);
        by_position += dot(m_[at(i)], dU_[at(i)]);
        if (!weightless_) by_position += dot(weight_[at(i)], dA_[at(i)]);
      }
      const Index row = path[j] - 1, column = l - 1;
      J(row, column) += 0.5 * by_rate - 0.25 * by_position;
      if (row != column) J(column, row) -= 0.5 * by_rate + 0.25 * by_position;
    }
  }
}

void Svi::momentum(const StepStart& end, Field<double>& p) {
  vector(p) = (vector(by_rate_) + 0.5 * vector(by_position_)) / end.h;
}

}  // namespace linden::comparators
