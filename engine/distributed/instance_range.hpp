// engine/distributed/instance_range.hpp
// Which instances of a rollout belong to a rank: instances 0 .. N-1 dealt out by number, neighbours together. Nothing that is computed of an
// instance depends on it, since seeds go by its number and a batch gives equal bits for any place and any neighbours.
#pragma once

#include <algorithm>
#include <cstdint>

namespace linden {

/// Instances first .. first + count - 1.
struct InstanceRange {
  std::int64_t first = 0, count = 0;

  std::int64_t end() const { return first + count; }
  bool operator==(const InstanceRange&) const = default;
};

/// Those of rank 0 .. ranks - 1: the first ranks have one more than the others where the number does not divide.
constexpr InstanceRange share_of(std::int64_t instances, int rank, int ranks) {
  const std::int64_t each = instances / ranks, more = instances % ranks;
  return {rank * each + std::min<std::int64_t>(rank, more), each + (rank < more ? 1 : 0)};
}

}  // namespace linden
