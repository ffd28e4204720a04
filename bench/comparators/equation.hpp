// bench/comparators/equation.hpp
// A discrete Euler-Lagrange equation (3) in momentum form, as a root finder sees it: a residual, its derivative, and the momentum
// at the end of the step.
//
//   h r(delta) = -h D1 L_d(q, q + delta) - h p = 0          p = D2 L_d of the step before
//
// All vectors have nv rows; trees of screws only, so a coordinate is a body: row i - 1 belongs to slot i.
#pragma once

#include <Eigen/Core>

#include "kernels/tree/articulated.hpp"
#include "layout/model.hpp"
#include "layout/state.hpp"
#include "layout/workspace.hpp"

namespace linden::comparators {

using Vec3d = Vec3<double>;
using Twistd = Twist<double>;
using Wrenchd = Wrench<double>;

/// A one-component field as Eigen sees it.
inline Eigen::Map<Eigen::VectorXd> vector(Field<double>& field) { return {field.flat().data(), field.rows()}; }
inline Eigen::Map<const Eigen::VectorXd> vector(const Field<double>& field) { return {field.flat().data(), field.rows()}; }

/// S v of a screw joint.
inline Twistd along(const Model& model, Index i, double v) {
  return {{0, 0, model.constants.screw(i, 0) * v}, {0, 0, model.constants.screw(i, 1) * v}};
}

/// S^T F of a screw joint.
inline double projected(const Model& model, Index i, const Wrenchd& F) {
  return model.constants.screw(i, 0) * F.n.z + model.constants.screw(i, 1) * F.f.z;
}

/// What a step starts from: state, and placement and force of gravity at its positions, in the workspace.
struct StepStart {
  const State<double>& state;
  const Workspace<double>& work;
  Vec3d gravity;  // world frame [m/s^2]
  double h;       // [s]
};

class Equation {
 public:
  virtual ~Equation() = default;

  virtual void begin(const StepStart& start) = 0;
  /// h r(delta). False where it is not defined: a body would turn by pi or more.
  virtual bool residual(const Field<double>& delta, Field<double>& hr) = 0;
  /// d(h r)/d(delta) where the residual was taken last.
  virtual void jacobian(Eigen::MatrixXd& J) = 0;
  /// p at the end of the step, for the delta of the last residual; `end` is there.
  virtual void momentum(const StepStart& end, Field<double>& p) = 0;
};

}  // namespace linden::comparators
