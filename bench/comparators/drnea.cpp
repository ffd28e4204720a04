#include "bench/comparators/drnea.hpp"

#include "bench/comparators/drnea_derivative.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/residual_up.hpp"

namespace linden::comparators {

Drnea::Drnea(const Model& model) : model_(model), ancestry_(model.tree) {
  const Shape& shape = model.tree.shape;
  motion_.allocate(shape.slots);
  displacement_.allocate(shape.slots);
  impulse_.allocate(shape.slots);
  target_.allocate(shape.velocities);
  residual_.allocate(shape.velocities);
  factor_.allocate(shape);
}

void Drnea::begin(const StepStart& start) {
  placement_ = start.work.placement;
  momentum_target_map(model_.tree, start.h, start.state.p, start.work.force, target_);
}

bool Drnea::residual(const Field<double>& delta, Field<double>& hr) {
  motion_map(model_.tree, model_.constants, delta, motion_);
  if (!(displacement_down(model_.tree, placement_, motion_, displacement_) > 0)) return false;
  momentum_map(model_.tree, model_.constants, displacement_, impulse_);
  residual_up(model_.tree, model_.constants, placement_, target_, impulse_, residual_);
  vector(hr) = vector(residual_);
  return true;
}

void Drnea::jacobian(Eigen::MatrixXd& J) { drnea_derivative(model_, ancestry_, placement_, motion_, displacement_, J); }

void Drnea::factor() {
  const Gains<double> gains{factor_.gain_up, factor_.gain_down, factor_.joint_inverse};
  newton_factor_up(model_.tree, model_.constants, placement_, motion_, displacement_, factor_.articulated, gains);
}

void Drnea::apply_inverse(const Field<double>& r, Field<double>& x) {
  const Gains<double> gains{factor_.gain_up, factor_.gain_down, factor_.joint_inverse};
  impulse_pass_up(model_.tree, model_.constants, placement_, gains, r, factor_.bias, factor_.innovation);
  increment_down(model_.tree, model_.constants, placement_, motion_, gains, factor_.innovation, factor_.variation, x);
}

void Drnea::momentum(const StepStart& end, Field<double>& p) {
  momentum_update_map(model_.tree, model_.constants, end.h, displacement_, impulse_, residual_, end.work.force, p);
}

}  // namespace linden::comparators
