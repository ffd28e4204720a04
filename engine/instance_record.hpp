// engine/instance_record.hpp
// What is known of one instance of a batch.
#pragma once

#include <cstdint>

#include "engine/step_report.hpp"
#include "layout/field.hpp"

namespace linden {

/// How an instance is doing, and what its steps cost.
struct InstanceRecord {
  StepStatus status = StepStatus::converged;  // of the last step; an instance that fails is frozen at its last good state
  std::int8_t displacements = 0;              // how many earlier displacements the first guess may use
  Index slot = 0;                             // where a frozen instance failed: body or joint; 0 = fine
  Index coupling = 0;                         // likewise, of couplings the one that was farthest open
  std::int32_t rescued = 0;                   // steps taken alone: backtracked, split or with bodies near each other, as a Simulation would
  std::uint32_t factors = 0;                  // of the Jacobian, but for those of steps taken alone
  std::int64_t steps = 0;                     // since the start or the last reset
  std::int64_t evaluations = 0;               // of the residual, likewise
  double residual = 0;                        // relative, of a frozen instance's failed step
  bool operator==(const InstanceRecord&) const = default;
};

}  // namespace linden
