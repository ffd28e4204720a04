// bench/comparators/integrator.hpp
// Steps a tree of screws by any evaluation and any root finder of the paper's studies, in momentum form (q, p), p0 = M(q0) v0.
//
//   placement, articulated inertias and force of gravity at q^k
//   first guess    IG3, as the paper's published code does; IG1; or the zero configuration (figure 4a)
//   root finder    |r| < tolerance
//   q^k+1 = q^k + delta,  p^k+1 = D2 L_d(q^k, q^k+1)
//
// A step that does not converge leaves the state as it was.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "bench/comparators/root_finder.hpp"

namespace linden::comparators {

enum class Evaluation { drnea, svi, svi_log };
enum class RootFinding { riqn, newton_dense, broyden, broyden_kept, newton_linear };  // the last with DRNEA only
enum class Guess {
  ig1,   // q^k+1 = q^k
  ig3,   // explicit acceleration, semi-implicit Euler
  zero,  // q^k+1 = 0
};

struct Settings {
  Evaluation evaluation = Evaluation::drnea;
  RootFinding root_finding = RootFinding::riqn;
  Guess guess = Guess::ig3;
  Stop stop{};
  double step = 1e-3;  // [s]
  Vec3d gravity{0, 0, 0};
};

/// "RIQN + DRNEA"
std::string name(RootFinding root_finding, Evaluation evaluation);

class Integrator {
 public:
  /// Throws std::invalid_argument for a model with joints of more than one degree of freedom or with mimic joints, and for
  /// newton_linear with another evaluation than DRNEA.
  Integrator(const Model& model, const Settings& settings);

  void set(std::span<const double> q, std::span<const double> v);
  /// One step; `residuals` as in Solved.
  Solved step(std::vector<double>* residuals = nullptr);

  std::span<const double> positions() const { return state_.q.flat(); }
  std::span<const double> momenta() const { return state_.p.flat(); }
  /// Kinetic energy 1/2 p.M^-1 p and potential [J].
  double energy();
  /// v = M^-1 p.
  const Field<double>& velocities();

 private:
  StepStart start() const { return {state_, work_, settings_.gravity, settings_.step}; }
  void place();
  void guess();

  const Model& model_;
  Settings settings_;
  State<double> state_;
  Workspace<double> work_;
  Field<double> delta_, residual_, rate_;
  double potential_ = 0;
  std::unique_ptr<Equation> equation_;
  std::unique_ptr<RootFinder> root_finder_;
};

}  // namespace linden::comparators
