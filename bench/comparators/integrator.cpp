#include "bench/comparators/integrator.hpp"

#include <algorithm>
#include <stdexcept>

#include "bench/comparators/broyden.hpp"
#include "bench/comparators/drnea.hpp"
#include "bench/comparators/newton_dense.hpp"
#include "bench/comparators/newton_linear.hpp"
#include "bench/comparators/riqn.hpp"
#include "bench/comparators/svi.hpp"
#include "bench/comparators/svi_log.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/velocity_down.hpp"

namespace linden::comparators {
namespace {

void check(const Model& model) {
  for (const Run& run : model.tree.runs) {
    if (run.kind != JointKind::screw) throw std::invalid_argument("the comparators know joints of one degree of freedom only");
  }
  if (!model.mimics.empty()) throw std::invalid_argument("the comparators know no mimic joints");
}

std::unique_ptr<Equation> make(Evaluation evaluation, const Model& model) {
  switch (evaluation) {
    case Evaluation::drnea: return std::make_unique<Drnea>(model);
    case Evaluation::svi: return std::make_unique<Svi>(model);
    case Evaluation::svi_log: return std::make_unique<SviLog>(model);
  }
  throw std::invalid_argument("no such evaluation");
}

std::unique_ptr<RootFinder> make(RootFinding root_finding, const Model& model, Workspace<double>& work, Equation& equation) {
  switch (root_finding) {
    case RootFinding::riqn: return std::make_unique<Riqn>(model, work);
    case RootFinding::newton_dense: return std::make_unique<NewtonDense>();
    case RootFinding::broyden: return std::make_unique<Broyden>(FirstJacobian::differences);
    case RootFinding::broyden_kept: return std::make_unique<Broyden>(FirstJacobian::kept);
    case RootFinding::newton_linear:
      if (auto* const drnea = dynamic_cast<Drnea*>(&equation)) return std::make_unique<NewtonLinear>(*drnea);
      throw std::invalid_argument("Newton in O(n) solves DRNEA's equation only");
  }
  throw std::invalid_argument("no such root finder");
}

/// Placement, articulated inertias, force and potential of gravity at q.
void place_at(const Model& model, const Field<double>& q, const Vec3d& gravity, Workspace<double>& work, double& potential) {
  placement_map(model.tree, model.constants, q, work.placement);
  const Gains<double> gains{work.gain_up, work.gain_down, work.joint_inverse};
  articulated_inertia_up(model.tree, model.constants, work.placement, work.articulated, gains);
  if (dot(gravity, gravity) == 0) return;
  gravity_field_down(model.tree, work.placement, gravity, work.field);
  potential = gravity_force_up(model.tree, model.constants, work.placement, work.field, work.first_moment, work.force);
}

/// M v
void apply_mass(const Model& model, Workspace<double>& work, const Field<double>& v, Field<double>& p) {
  velocity_down(model.tree, model.constants, work.placement, v, work.twist);
  momentum_of_map(model.tree, model.constants, work.twist, work.impulse);
  impulse_up(model.tree, model.constants, work.placement, work.impulse, p);
}

/// M^-1 (Q - C), (23).
void acceleration(const Model& model, Workspace<double>& work, const Field<double>& v, Field<double>& result) {
  velocity_down(model.tree, model.constants, work.placement, v, work.twist);
  coriolis_down(model.tree, model.constants, work.placement, v, work.twist, work.bias, work.impulse);
  impulse_up(model.tree, model.constants, work.placement, work.impulse, result);
  vector(result) = vector(work.force) - vector(result);
  apply_mass_inverse(model, work, result, result);
}

}  // namespace

std::string name(RootFinding root_finding, Evaluation evaluation) {
  const char* const roots[] = {"RIQN", "Newton", "Broyden", "Broyden, kept", "Newton O(n)"};
  const char* const evaluations[] = {"DRNEA", "SVI", "SVI-log"};
  return std::string(roots[static_cast<int>(root_finding)]) + " + " + evaluations[static_cast<int>(evaluation)];
}

Integrator::Integrator(const Model& model, const Settings& settings) : model_(model), settings_(settings) {
  check(model);
  state_.allocate(model.tree.shape);
  work_.allocate(model.tree.shape);
  for (Field<double>* field : {&delta_, &residual_, &rate_}) field->allocate(model.tree.shape.velocities);
  equation_ = make(settings.evaluation, model);
  root_finder_ = make(settings.root_finding, model, work_, *equation_);
}

void Integrator::set(std::span<const double> q, std::span<const double> v) {
  std::ranges::copy(q, state_.q.flat().begin());
  std::ranges::copy(v, rate_.flat().begin());
  place();
  apply_mass(model_, work_, rate_, state_.p);
}

void Integrator::place() { place_at(model_, state_.q, settings_.gravity, work_, potential_); }

void Integrator::guess() {
  switch (settings_.guess) {
    case Guess::ig1: vector(delta_).setZero(); return;
    case Guess::zero: vector(delta_) = -vector(state_.q); return;
    case Guess::ig3:
      apply_mass_inverse(model_, work_, state_.p, rate_);
      acceleration(model_, work_, rate_, delta_);
      vector(delta_) = settings_.step * (vector(rate_) + settings_.step * vector(delta_));
      return;
  }
}

Solved Integrator::step(std::vector<double>* residuals) {
  Solved solved{.residuals = residuals};
  guess();
  equation_->begin(start());
  root_finder_->solve(*equation_, settings_.step, settings_.stop, delta_, residual_, solved);
  if (!solved.converged) return solved;
  vector(state_.q) += vector(delta_);
  place();
  equation_->momentum(start(), state_.p);
  return solved;
}

const Field<double>& Integrator::velocities() {
  apply_mass_inverse(model_, work_, state_.p, rate_);
  return rate_;
}

double Integrator::energy() { return 0.5 * vector(velocities()).dot(vector(state_.p)) + potential_; }

}  // namespace linden::comparators
