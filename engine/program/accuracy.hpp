// engine/program/accuracy.hpp
// What accuracy costs on one scene: every method over a ladder of steps, against a reference that two independent methods agree
// on.
//
//   methods    orders 2, 4, 6, 8 of linden; RK4 and semi-implicit Euler, as other engines step (engine/baseline/baseline.hpp). Scenes with
//              damping, servos, torques, wrenches or drag have no orders above 2; with friction, limits or ground there is but
//              order 2; RK4 and Euler move trees alone, without couplings
//   steps      16, 8, 4, 2, 1, 1/2, 1/4 times the step of the options
//   also       the solver's tolerance from 1e-6 to 1e-12 for orders 2 and 6, and order 2 in single precision, all at the step of
//              the options
//   reference  order 8 and RK4, their steps halved until they change no more, are 1/8 and 1/32 of the options' or their share of
//              the budget is spent. Where they agree to kAgreed over the whole duration errors are judged at its end. Where they
//              do not the motion is chaotic as far as anybody can tell: errors are judged at the horizon, the last time to which
//              they agree to kJudged, and beyond it energy alone is. Without higher orders order 2 takes the place of order 8, its
//              leading error taken away by a run at twice the step; where there is order 2 alone it is compared with itself at twice
//              the step, and judged to kJudgedAlone. Where there are couplings order 6 takes the place of RK4.
//   error      largest difference of a coordinate to the reference [rad, m]; of a quaternion twice its components', an angle.
//              Never less than what the two references leave open.
//   energy     band max H - min H and slope of H, sampled as a run is (energy_stride), relative to the largest kinetic energy of the
//              reference; with effects that take or give energy of H + taken - given, where a method keeps that account
//   time       CPU time of the steps alone, of this thread: of a run of its own in which nothing is looked at
//   budget     the clock's seconds for everything. Rows go from large steps to small; what no longer fits is left out and said
//              so. Where not even a reference would fit the duration is cut.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/drift.hpp"
#include "engine/initial_state.hpp"
#include "engine/options.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

inline constexpr double kAgreed = 1e-6, kJudged = 1e-8;  // [rad, m]

struct AccuracySetup {
  std::shared_ptr<const Model> model;
  Effects effects;
  Options options;                    // step and gravity
  InitialState start;                 // empty: at rest in the zero configuration
  double duration = 10, budget = 60;  // [s]
};

struct AccuracyMethod {
  enum class Kind { composed, semi_implicit_euler, rk4, single };
  Kind kind = Kind::composed;
  int order = 2;  // nominal
  bool operator==(const AccuracyMethod&) const = default;
};

/// "order 4", "RK4", "semi-implicit Euler", "order 2, single".
std::string name(const AccuracyMethod& method);

/// A method, a step, a tolerance.
struct AccuracyRow {
  AccuracyMethod method;
  double step = 0, tolerance = 0;               // tolerance: 0 where nothing is solved
  bool of_ladder = true;                        // else one of the rows with another tolerance or precision
  bool left_out = false;                        // no time was left
  std::string failure;                          // empty where every step went well
  double error = 0;                             // at the horizon; NaN where it was not reached
  double band = 0, slope = 0, slope_error = 0;  // [1], [1/s]
  double momentum = 0;                          // drift, as MomentumDrift; NaN where something outside takes it
  double seconds = 0;                           // of CPU
  std::int64_t steps = 0, evaluations = 0, split_steps = 0;

  bool done() const { return failure.empty() && !left_out; }
};

struct AccuracyReference {
  AccuracyMethod method, other;    // both alike: nobody else knows the scene's effects
  double step = 0, other_step = 0;  // of the finest of each
  double horizon = 0;              // [s]
  double gap = 0, gap_at_end = 0;  // between the two, up to the horizon and over all [rad, m]
  double kinetic = 0;              // largest [J]
  std::string failure;             // where none was found
};

/// How the error of a method falls with its step: over its three finest rows that are neither too coarse nor near rounding and
/// the gap.
struct AccuracyFit {
  AccuracyMethod method;
  double order = 0, from = 0, to = 0;  // largest and smallest step; order: NaN below three rows
  int rows = 0;
  double error = 0;  // of the order: its standard error
};

struct AccuracyFigures {
  double duration = 0, asked = 0;  // [s]; what was run and what was asked for
  AccuracyReference reference;
  std::vector<AccuracyRow> rows;
  bool interrupted = false;
  bool moves = true;  // else there is nothing to be accurate about

  bool chaotic() const { return reference.horizon < duration; }
};

/// go_on(seconds): asked often, with the seconds that have gone by; false ends the measurement early and keeps the rows that are
/// done.
AccuracyFigures measure_accuracy(const AccuracySetup& setup, const std::function<bool(double seconds)>& go_on);

/// One run without a reference: energy, momentum, time. tolerance: 0 for the method's own. Energies relative to `kinetic` [J]; the error is
/// NaN.
AccuracyRow measure_energy(const AccuracySetup& setup, const AccuracyMethod& method, double step, double tolerance,
                           double kinetic);

std::vector<AccuracyFit> accuracy_fits(const AccuracyFigures& figures);

/// The row of the ladder that costs least among those that keep `value` (error or band) to `target`; null where none does.
const AccuracyRow* cheapest(const AccuracyFigures& figures, double AccuracyRow::*value, double target, bool ours);

}  // namespace linden
