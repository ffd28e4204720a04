#include "bench/comparators/svi_log.hpp"

#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"

namespace linden::comparators {

SviLog::SviLog(const Model& model) : model_(model), ancestry_(model.tree) {
  const Shape& shape = model.tree.shape;
  motion_.allocate(shape.slots);
  displacement_.allocate(shape.slots);
  impulse_.allocate(shape.slots);
  target_.allocate(shape.velocities);
  A_.resize(ancestry_.pairs());
  B_.resize(ancestry_.pairs());
  KB_.resize(static_cast<std::size_t>(shape.slots));
}

template <class PlacementOf>
void SviLog::carry(const PlacementOf& placement_of, std::vector<Twistd>& pairs) {
  for (Index i = 1; i < model_.tree.shape.slots; ++i) {
    const std::size_t first = ancestry_.first(i), count = ancestry_.path(i).size();
    if (count > 1) {
      const Placement<double> X = placement_of(i);
      const std::size_t parent = ancestry_.first(model_.tree.parent(i));
      for (std::size_t j = 0; j + 1 < count; ++j) pairs[first + j] = to_child(X, pairs[parent + j]);
    }
    pairs[first + count - 1] = along(model_, i, 1);
  }
}

void SviLog::add_up(const std::vector<Twistd>& pairs, Field<double>& sum) {
  for (Index i = 1; i < model_.tree.shape.slots; ++i) {
    const auto m = load<Wrench, double>(impulse_, i);
    const auto path = ancestry_.path(i);
    const std::size_t first = ancestry_.first(i);
    for (std::size_t j = 0; j < path.size(); ++j) sum(path[j] - 1) += dot(m, pairs[first + j]);
  }
}

void SviLog::begin(const StepStart& start) {
  placement_ = start.work.placement;
  momentum_target_map(model_.tree, start.h, start.state.p, start.work.force, target_);
  carry([&](Index i) { return load<Placement, double>(placement_, i); }, A_);
}

bool SviLog::residual(const Field<double>& delta, Field<double>& hr) {
  motion_map(model_.tree, model_.constants, delta, motion_);
  if (!(displacement_down(model_.tree, placement_, motion_, displacement_) > 0)) return false;
  momentum_map(model_.tree, model_.constants, displacement_, impulse_);
  vector(hr) = -vector(target_);
  add_up(A_, hr);
  return true;
}

void SviLog::carry_end() {
  carry(
      [&](Index i) {
        return after_motion(Joint<JointKind::screw>{}, load<Placement, double>(placement_, i),
                            load<Displacement, double>(motion_, i));
      },
      B_);
}

void SviLog::jacobian(Eigen::MatrixXd& J) {
  carry_end();
  J.setZero(model_.tree.shape.velocities, model_.tree.shape.velocities);
  for (Index i = 1; i < model_.tree.shape.slots; ++i) {
    const auto path = ancestry_.path(i);
    const std::size_t first = ancestry_.first(i);
    const auto G = load<Inertia, double>(model_.constants.inertia, i);
    const Twistd u = log(load<Displacement, double>(displacement_, i));
    const Mat6<double> K = pose_derivative(G, u, G * u);
    for (std::size_t l = 0; l < path.size(); ++l) KB_[l] = K * B_[first + l];
    for (std::size_t l = 0; l < path.size(); ++l) {
      for (std::size_t j = 0; j < path.size(); ++j) J(path[j] - 1, path[l] - 1) += dot(KB_[l], A_[first + j]);
    }
  }
}

void SviLog::momentum(const StepStart& end, Field<double>& p) {
  // nu = Ad_{dT}^T mu, seen from the end of the step, where the coordinates of the paths act along B
  carry_end();
  for (Index i = 1; i < model_.tree.shape.slots; ++i) {
    store(impulse_, i, carried(load<Displacement, double>(displacement_, i), load<Wrench, double>(impulse_, i)));
  }
  vector(p) = 0.5 * end.h * end.h * vector(end.work.force);
  add_up(B_, p);
  vector(p) /= end.h;
}

}  // namespace linden::comparators
