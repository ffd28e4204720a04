// engine/program/accuracy_mover.hpp
// One way to move a model, whatever moves it: what a study of accuracy runs.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "engine/program/accuracy.hpp"
#include "engine/simulation.hpp"

namespace linden {

class Mover {
 public:
  virtual ~Mover() = default;
  /// False where the step failed.
  virtual bool step() = 0;
  virtual Energy energy() = 0;
  /// What effects took of the energy less what they gave, so far [J]. NaN where nobody counts it.
  virtual double gone() { return std::numeric_limits<double>::quiet_NaN(); }
  virtual std::optional<Momentum> momentum() = 0;
  virtual std::span<const double> positions() = 0;
  virtual std::int64_t evaluations() const = 0;
  virtual std::int64_t split_steps() const { return 0; }
  virtual std::string failure() const = 0;
};

/// tolerance: 0 for the method's own (use_default_tolerance).
std::unique_ptr<Mover> mover_of(const AccuracySetup& setup, const AccuracyMethod& method, double step, double tolerance);

}  // namespace linden
