// engine/baseline/baseline.hpp
// Steps as other engines take them, on the same trees and the same kernels: what linden is compared with.
//
//   a(q, v) = M(q)^-1 (Q(q) - C(q, v))                             forward dynamics by articulated bodies, O(n)
//   semi_implicit_euler   v += h a(q, v);  q <- q (+) h v          first order, one evaluation a step
//   rk4                   the classical Runge-Kutta method         fourth order, four evaluations
//
// Positions of ball and free joints move along exp of a body twist. RK4 takes its stages in the coordinates of that exp, u' = v
// + 1/2 [u, v] + 1/12 [u, [u, v]], without which it would be of second order there (Munthe-Kaas).
//
// acts    gravity, and every effect as the force that it is at the time of an evaluation: `push` of its law (kernels/effects/law.hpp). What changes
//         suddenly, as its facts say, is refused: friction, limits, servos with limited force, given motions, ground; and so are couplings
// cost    an evaluation is some 150 ns a body, as much as a step of order 2 takes: placements, velocities, forces up, factor up,
//         accelerations down
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.3; Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.8
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "engine/energy.hpp"
#include "engine/options.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"
#include "layout/workspace.hpp"

namespace linden {

struct EffectPlan;
template <class S>
class MimicTies;

enum class Scheme { semi_implicit_euler, rk4 };

std::string_view name(Scheme scheme);

class Baseline {
 public:
  /// At rest in the model's zero configuration. Of the options it takes step and gravity. Throws InputError for an effect that
  /// it has not, and for a model with couplings.
  Baseline(std::shared_ptr<const Model> model, Scheme scheme, const Options& options, const Effects& effects = {});
  ~Baseline();

  const Model& model() const { return *model_; }
  double time() const { return static_cast<double>(steps_) * options_.step; }
  std::int64_t evaluations() const { return evaluations_; }  // of a(q, v), so far

  /// [nq], [nv], as Simulation's.
  std::span<const double> positions() const { return q_.flat(); }
  std::span<const double> velocities() const { return v_.flat(); }
  /// As Simulation::set_positions and set_velocities.
  void set(std::span<const double> q, std::span<const double> v);

  /// False where the result is not finite: the state is then the last good one. Allocates nothing.
  bool step();

  Energy energy();
  Momentum momentum();

 private:
  struct BodyEffects;

  /// Placements, forces of gravity and the potential of all at q_.
  void place();
  /// Effects on joints, on top of the forces of place(), and on bodies, taken from work_.impulse: at the time of an evaluation.
  void drive_joints(double time, const Field<double>& v);
  void drive_bodies(double time);
  void accelerate(double time, const Field<double>& v, Field<double>& a);
  /// M(q) v into work_.residual; the system's momentum into slot 0 of work_.impulse.
  void find_momentum(const Field<double>& v);
  /// q_ <- from (+) u
  void move(const Field<double>& from, const Field<double>& u);
  void chart_rate(const Field<double>& u, const Field<double>& v, Field<double>& rate) const;
  void euler_step();
  void rk4_step();

  std::shared_ptr<const Model> model_;
  Scheme scheme_;
  Options options_;
  bool gravity_;
  std::unique_ptr<const EffectPlan> plan_;
  std::unique_ptr<BodyEffects> body_effects_;  // where something acts on bodies
  double potential_ = 0;
  std::int64_t steps_ = 0, evaluations_ = 0;
  Field<double> q_, v_, good_q_, good_v_;
  Field<double> stage_u_, stage_v_, rate_u_, rate_v_, sum_u_, sum_v_;
  Field<double, 36> none_;  // stiffness of bodies: of none
  Field<double, 12> pose_;  // of bodies in the world, where something acts on them
  Workspace<double> work_;
  std::unique_ptr<MimicTies<double>> ties_;
};

}  // namespace linden
