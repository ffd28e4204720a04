// engine/solve/step_choice.hpp
// How long the next step is to be, where an accuracy of the energy is asked for (Options::accuracy).
//
// One number says how fast things happen: the density D of steps [1/s], from twists V_i of the bodies that are known anyway, and what they
// change by,
//
//   A_i = (V_i - V_i before) / time between them
//   D^2 = 1/T* sum_i (1/2 A_i.G_i A_i + 1/2 V_i.G_i V_i |w_i|^2)  +  R^2/4,    R = (sum_i (|w_i|^4 + |dw_i/dt|^2)^2)^(1/8)
//   T*  = the largest so far of  T + sum_i 1/2 A_i.G_i A_i / R^2               (1/R at most kLongestTime steps of Options::step)
//   h   = theta D before/D^2 e^beta,   theta = (accuracy / C)^(1/r) <= 0.15,   r the order, C measured (below)
//
// The first part of D follows the energy error of order 2, which alone would lose the light tip of a long chain; R keeps fast bodies resolved.
// Accelerations keep D above zero where motions turn back. Of order 2 V is the mean twist of a step, log(dT)/h: where two steps meet both are in
// the same frame. Of higher orders it is that of the node. Either way D is of a step ago, and is carried on by a step as it grew in the last, at
// most by two: a chain that cracks takes a tenth less of order 4 for the same band so, and no longer strays by four times of it now and then.
//
// Feedback. A step of c h in the place of h at y moves the modified energy E that fixed steps keep by (c^r - 1)(E - H(y)): all drift of variable
// steps is the sum of these. So it is steered, by steps a little longer or shorter where that brings E back:
//
//   e = H(y_n) - H(y_0),   F += (e - F)/200,   w = F - e,   W += (w^2 - W)/200
//   beta = 29/30 beta - clamp(kappa F w / (r W), +-0.03),   |beta| <= 0.2,   kappa = 2e-3, from the 100th step on
//
// Its mean work is dF/dn = -kappa F: what E has strayed decays in 500 steps. Each step is one of the symplectic map; no force is added, nothing
// projected. All is counted in steps, so nothing has a unit. Of order 2 energy, which costs a solve with the mass matrix, is looked at in every
// fourth step. Where effects take or give energy nothing is steered.
//
// Kept or said: where |e| is beyond the accuracy theta is multiplied by 0.7, and again beyond twice, three times, ... of it, at most once in
// 1,000 steps and ten times; it is never raised.
//
// C: of order 2 the largest energy band over theta^2 of ten-link chain, double pendulum, flail, humanoid and heavy top over 1,000 s, 3.7, by
// densities that were not carried on (a ten-link chain has 0.5). Of orders 4, 6, 8 the largest of chains of ten hinges and of ten ball joints, a ring of
// eight, a ladder of five cells and a tree of 63 bodies over 3 s, 0.33, 0.75, 0.54; of order 4 the ten-link chain has 0.13 over 1,000 s.
//
// cost    some 120 operations a body and step; no allocation but in the first step
// source  reversible step densities, of which this is none: Hairer, Söderlind, Explicit, time reversible, adaptive step size control (2005).
//         On a ten-link chain over 1,000 s theirs let the energy wander like a random walk; h = theta/D without feedback lets it fall by 4e-5
//         of the largest kinetic energy a second
#pragma once

#include <cstdint>

#include "engine/options.hpp"
#include "engine/step_report.hpp"
#include "layout/body_constants.hpp"
#include "layout/field.hpp"

namespace linden {

struct Effects;
struct Model;

/// With an accuracy the order that it asks for, 2 down to 1e-3, 4 to 1e-6, 6 to 1e-9, 8 below, and its tolerance; 2 where an effect cannot be
/// taken back in time. An order or a tolerance beyond the usual one stays. Without, the same options.
Options with_accuracy(const Options& options, const Model& model, const Effects& effects);

class StepChoice {
 public:
  /// What there is to know of it, for checkpoints.
  struct Law {
    std::int64_t steps = 0;  // since the start
    double theta = 0, density = 0, density_before = 0, most_energy = 0;  // theta, D, the one before, T*
    double beta = 0, change = 0, filtered = 0, variance = 0;  // beta and what each step changes it by, F, W
    double begin = 0;              // H(y_0), once begun is true
    bool begun = false;
    std::int64_t steered = 0;      // steps since
    double kinetic = 0;            // the largest [J]
    double lowest = 0, highest = 0;  // e
    std::int64_t lowered_at = 0;   // step at which theta was
  };
  struct Lengths {
    double accuracy = 0;  // asked for
    double shortest = 0, longest = 0, sum = 0;
    std::int64_t retaken = 0;
    int lowered = 0;
  };

  /// steers: no effect takes or gives energy.
  StepChoice(const Options& options, bool steers);

  /// A start: nothing is known.
  void begin();
  /// Energy is compared with what it is from now on: forces were set from outside.
  void begin_energy();

  /// What the law alone says of the next step [s], infinite at rest; its length, `before` that of the last one, 0 where there is none.
  double wish() const;
  double next(double before) const;
  /// A step of h was taken. Twists of the bodies, body frame, and those `apart` seconds before; slot 0 is not looked at.
  void add(double h, const BodyConstants<double>& constants, const Field<double, 6>& before, const Field<double, 6>& now, double apart);
  void count_retaken() { lengths_.retaken += 1; }

  /// Whether energy is to be told after this step; e: H + taken - given now, its kinetic part [J].
  bool looks() const { return law_.steps % every_ == 0; }
  void steer(double energy, double kinetic);

  StepLengths report() const;
  Law& law() { return law_; }
  Lengths& lengths() { return lengths_; }

 private:
  int order_, every_;
  bool steers_;
  double accuracy_, step_;
  Law law_;
  Lengths lengths_;
};

}  // namespace linden
