// engine/batch_instances.hpp
// Checkpoints of batches cut and joined, instance by instance: what a few saved goes on, to the bit, in as many others as there are to be.
//
//   const InstancesOf parts[] = {{a, "a", 5, 8}, {b, "b", 0, 2}};     of the batch that saved a the instances 5, 6, 7, then 0, 1 of another
//   Batch(model, 5).restore(joined_instances(parts));
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace linden {

/// Instances first to last - 1 of the batch that saved these bytes. name: of where they come from, for messages.
struct InstancesOf {
  std::string_view bytes;
  std::string name;
  std::int64_t first, last;
};

/// The checkpoint of a batch of those instances, in that order. Throws InputError for bytes that no batch saved or that are damaged, for
/// instances that they do not hold, and for parts that are not of one kind: of one model, step, gravity and precision, with the same
/// effects and with the same rows set for each instance.
std::string joined_instances(std::span<const InstancesOf> parts);

}  // namespace linden
