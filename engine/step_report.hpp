// engine/step_report.hpp
// What a step tells its caller: how the solve went, and where it failed.
#pragma once

#include <cstdint>
#include <string>

#include "layout/model.hpp"

namespace linden {

enum class StepStatus {
  converged,
  not_converged,  // the residual would not go below the tolerance
  past_pi,        // a body turns by half a turn or more in one step, which the log map cannot represent
  gains_energy,   // the solution found is not the motion's: a second root, met where the step is far too large
  not_finite,     // a residual that is NaN or infinite: a singular joint or an overflow
  opens,          // a coupling would open: its bodies are moved or held where it cannot follow
};

struct StepReport {
  StepStatus status = StepStatus::converged;
  int iterations = 0;      // corrections of the displacement (linear solves), over all sub-steps
  int evaluations = 0;     // of the residual
  int factorisations = 0;  // of the Jacobian
  int backtracks = 0;      // corrections cut short
  int blows = 0;           // impulses at which joints met limits
  int substeps = 1;        // above 1: the step, or one of the sub-steps that an order above 2 is made of, failed whole and was split
  bool at_rounding_floor = false;  // stopped above the tolerance, where rounding lets the residual fall no further
  double residual = 0;      // sqrt(1/2 r.M^-1 r / kinetic energy) at the end, the largest over sub-steps; of `opens` gap / size of the mechanism
  Index slot = 0;           // where it failed: the body that turns too far or the joint with the largest residual; 0 = fine
  Index coupling = 0;       // likewise, of couplings the one that is farthest open

  /// Counts what another sub-step took; its status and trouble are those of the whole.
  void add(const StepReport& more);
  bool ok() const { return status == StepStatus::converged; }
};

/// What several steps took together. The one that failed is not counted.
struct StepsReport {
  std::int64_t steps = 0;
  std::int64_t iterations = 0, evaluations = 0, factorisations = 0, substeps = 0;
  int most_iterations = 0;
  std::int64_t split_steps = 0, floor_steps = 0;  // that were split; that ended at the rounding floor
  std::int64_t splits_in_a_row = 0;               // the most
  std::int64_t first_splits = 0, last_splits = 0;  // in a row, at the beginning and at the end
  double largest_residual = 0;
  StepReport last;  // of the last step, or of the one that failed

  void add(const StepReport& step);
  void add(const StepsReport& more);
  bool ok() const { return last.ok(); }
};

/// Variable steps since the last start, and the accuracy they were chosen for (engine/solve/step_choice.hpp).
struct StepLengths {
  std::int64_t steps = 0;
  double shortest = 0, longest = 0, mean = 0;  // [s]
  std::int64_t retaken = 0;                    // steps that failed and were taken again, shorter
  double accuracy = 0;                         // asked for
  double strayed = 0;                          // band of the energy over the largest kinetic energy, as far as it was looked at
  int lowered = 0;                             // times that steps were made shorter by 0.7 for good because it strayed further
  bool kept() const { return strayed <= accuracy; }
};

/// One sentence on steps that were split; empty where none was.
std::string describe(const StepsReport& report);

/// One sentence: what failed, at which body and joint, by how much, and what to do. Empty for a step that converged.
std::string describe(const StepReport& report, const Model& model, double step);

}  // namespace linden
