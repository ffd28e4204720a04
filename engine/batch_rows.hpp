// engine/batch_rows.hpp
// What Batch::step takes in and gives out beside the state: rows in the caller's memory, instance by instance, as a policy has them.
//
//   batch.step(20, {.targets = actions, .observations = &seen, .observed = std::span(rows)});
//
// The thread that steps a block of instances brings their rows to its lanes just before its steps, and sees them just after, while they are
// in its cache. It is the same to the bit as writing the views (Batch::servo_targets, ...), step(n) and observe, and what the last step left
// is not found anew.
#pragma once

#include <span>
#include <variant>

namespace linden {

class Observations;  // engine/queries/observations.hpp

/// Where a span is empty, the numbers that the batch has are left as they are.
template <class Real>
struct BatchRows {
  std::span<const Real> targets{};          // [size x servos], as Batch::servo_targets [rad, m]; NaN gives a servo back to its table
  std::span<const Real> forces{};           // [size x nv], as Batch::forces [N m, N]
  std::span<const Real> gains{};            // [size x servos], as Batch::gains
  std::span<const Real> friction{};         // [size x Effects::friction], as Batch::friction [N m, N]
  std::span<const Real> ground_friction{};  // [size], as Batch::ground_friction
  std::span<const Real> gravity{};          // [size x 3], as Batch::gravity [m/s^2]

  const Observations* observations = nullptr;  // what is seen after the last step; null: nothing
  std::variant<std::span<double>, std::span<float>> observed{};  // [size x width]
};

}  // namespace linden
