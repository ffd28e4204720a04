// engine/program/energy_change.hpp
// How energy changed over a rollout.
#pragma once

#include <cstdint>
#include <span>

#include "engine/distributed/ranks.hpp"

namespace linden {

/// From the first state to the last, over all instances, relative to each one's largest kinetic energy.
struct EnergyChange {
  double mean = 0, median = 0, most = 0;  // mean keeps the sign: it shows a drift that all share
  std::int64_t worst = 0;                 // instance, the first of those with the most
};

/// Of all ranks, known to all. first, last, kinetic: of the own instances [J].
EnergyChange energy_change(Ranks& ranks, InstanceRange own, std::int64_t instances, std::span<const double> first, std::span<const double> last,
                           std::span<const double> kinetic);

}  // namespace linden
