// tests/gallery/scenario.hpp
// A scene that is run step by step, and what a run of it left behind.
//
// What a method of second order may do to the energy follows from the motion itself. In a step a body's twist changes by dV; the
// force at both ends of a step stands for the force within, and what that leaves out is of the size of the energy of that change:
//
//   second_order = max over steps of sum_i 1/2 dV_i . G_i dV_i          dV_i in the frame of body i
//
// For an oscillator of frequency w this is (h w)^2 E, and the energy of the Stoermer-Verlet step swings by (h w)^2 E / 4: a bound
// with a margin of four, that scales with every mass, length and speed and needs no number fitted to a run.
//
// source  Hairer, Lubich, Wanner, Geometric Numerical Integration, IX.3 (modified energy of the leapfrog)
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/drift.hpp"
#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"
#include "layout/effects.hpp"
#include "tests/gallery/report.hpp"

namespace linden {

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

struct Scenario {
  std::shared_ptr<const Model> model;
  Options options{};
  Effects effects{};
  InitialState start{};  // empty: at rest in the zero configuration
  std::int64_t steps = 0;
  int every = 1;  // steps from one look at the energy to the next
};

Scenario scenario(Model model, const Options& options, std::int64_t steps);

Simulation simulation_of(const Scenario& scenario);

struct RunRecord {
  std::int64_t steps = 0;  // that were taken
  std::string failure;     // of the first step that failed; empty: none
  std::int64_t iterations = 0, evaluations = 0, split = 0, at_floor = 0;
  int most_iterations = 0;
  double residual = 0;  // the largest
  EnergyDrift drift{1};
  std::optional<MomentumDrift> momentum;  // of what nothing ties to the world
  double start_energy = 0;
  double duration = 0;      // [s]
  double energy_error = 0;  // largest |H - H at the start| [J]
  double energy_gain = 0;   // largest H - H at the start [J]
  double second_order = 0;  // see above [J]; the largest over the steps looked at
  double turn = 0;          // of a body in one step, the largest [rad]
  double gap = 0;           // of couplings, the largest of any row [m, cosine of an angle]
};

/// Runs to the end, or to the first step that fails. watch: called at every look.
RunRecord run(Simulation& simulation, std::int64_t steps, int every = 1, const std::function<void(Simulation&)>& watch = {});
RunRecord run(const Scenario& scenario);

/// Every step converged; the energy error is one of second order and, where the run is long enough to tell, without slope.
void promise_conservation(Report& report, const RunRecord& record, std::int64_t steps, bool slope);

/// Over a run as long as one likes the energy wanders within its band and goes nowhere.
void promise_no_slope(Report& report, const RunRecord& record);

/// "1.2 iterations a step, 4 at most; 3 of 1,000 steps split"
std::string effort(const RunRecord& record);

/// The same scenario in the other engines that are there, told as the largest change of energy over `scale` [J] or when it blew
/// up.
void run_beside(Report& report, const Scenario& scenario, double scale);

}  // namespace linden
