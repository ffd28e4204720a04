// Checkpoints of a Batch (engine/checkpoint_bytes.hpp), instance by instance, whatever the lanes are that they are computed in:
//
//   "linden batch 5\n"
//   header: what it belongs to, instances, bytes of a number, numbers that effects keep, which rows there are, bytes of the text that follows
//   kinds of effects and what they act on (engine/effects/effect_owners.hpp); their numbers may be others
//   of each instance all rows that there are in the order of BatchOf::Data::each, then its record member by member
//   FNV-1a over all of it
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <mutex>

#include "engine/batch_data.hpp"
#include "engine/batch_instances.hpp"
#include "engine/checkpoint_bytes.hpp"
#include "engine/effects/effect_owners.hpp"
#include "engine/files/output_file.hpp"
#include "layout/archive.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

struct BatchHeader {
  CheckpointOf of;
  std::int64_t instances;
  std::int64_t precision;  // bytes of a number
  std::int64_t kept;       // numbers that effects keep of an instance
  std::int64_t rows;       // bit k: there is the kth of Data::each
  std::int64_t effects;    // bytes
};
static_assert(sizeof(BatchHeader) == 96, "a checkpoint's header has no padding");

// Data: BatchOf<Real>::Data

template <class Data>
std::int64_t rows_there(const Data& data) {
  std::int64_t bits = 0;
  int k = 0;
  Data::each(data, [&](const auto& numbers, Index) { bits |= std::int64_t{numbers.empty() ? 0 : 1} << k++; });
  return bits;
}

/// How many come before those that have memory only if they are asked for.
template <class Data>
int always_there(const Data& data) {
  int count = 0;
  Data::each(data, [&](const auto&, Index) { ++count; });
  Data::each_asked(data, [&](const auto&, Index, const auto&) { --count; });
  return count;
}

/// Those that there may be or not.
template <class Data>
std::int64_t rows_asked(const Data& data) {
  std::int64_t bits = 0;
  int k = always_there(data);
  Data::each_asked(data, [&](const auto&, Index rows, const auto&) { bits |= std::int64_t{rows > 0 ? 1 : 0} << k++; });
  return bits;
}

/// visit(numbers, rows) of the rows of a checkpoint.
template <class Data, class Visit>
void each_row(Data& data, std::int64_t there, const Visit& visit) {
  int k = 0;
  Data::each(data, [&](auto& numbers, Index rows) {
    if ((there >> k++ & 1) != 0) visit(numbers, rows);
  });
}

std::size_t record_bytes() {
  std::size_t bytes = 0;
  const InstanceRecord record;
  each_member(record, [&](const auto& number) { bytes += sizeof(number); });
  return bytes;
}

/// Bytes of an instance.
template <class Data>
std::size_t instance_bytes(const Data& data, std::int64_t there) {
  std::size_t bytes = record_bytes();
  each_row(data, there, [&](const auto& numbers, Index rows) { bytes += static_cast<std::size_t>(rows) * sizeof(numbers[0]); });
  return bytes;
}

/// work(instance, its bytes) of all, on all threads.
template <class Data, class Byte, class Work>
void for_instances(const Data& data, Byte* bytes, std::size_t of_each, const Work& work) {
  data.for_blocks([&](std::int64_t b, auto&) {
    for (std::int64_t i = b * data.lanes; i < std::min((b + 1) * data.lanes, data.size); ++i) {
      work(i, bytes + of_each * static_cast<std::size_t>(i));
    }
  });
}

/// What an instance that was read holds and none can hold; empty where it is sound. state: positions and momenta.
template <class Real>
std::string fault_of(const InstanceRecord& record, Index slots, Index couplings, const char* state, Index numbers) {
  for (Index k = 0; k < numbers; ++k, state += sizeof(Real)) {
    Real number;
    std::memcpy(&number, state, sizeof(number));
    if (!std::isfinite(number)) return "a number that is not finite";
  }
  const auto status = static_cast<int>(record.status);
  if (status < 0 || status > static_cast<int>(StepStatus::opens)) return fmt::format("the status {}", status);
  if (record.displacements < 0 || record.displacements > 2) return fmt::format("the displacements of {} steps", record.displacements);
  if (record.slot < 0 || record.slot >= slots) return fmt::format("the body {}", record.slot);
  if (record.coupling < 0 || (record.coupling > 0 && record.coupling >= couplings)) return fmt::format("the coupling {}", record.coupling);
  if (record.steps < 0) return fmt::format("{} steps", record.steps);
  return {};
}

/// Of all instances. Throws InputError for the first one that cannot be.
template <class Real, class Data>
std::vector<InstanceRecord> sound_records(const CheckpointReader& in, const Data& data, std::string_view all, std::size_t of_each) {
  std::vector<InstanceRecord> records(data.records.size());
  std::int64_t faulty = data.size;
  std::string fault;
  std::mutex telling;
  const Shape& shape = data.shape();
  for_instances(data, all.data(), of_each, [&](std::int64_t i, const char* bytes) {
    const char* from = bytes + of_each - record_bytes();
    InstanceRecord& record = records[static_cast<std::size_t>(i)];
    each_member(record, [&](auto& number) {
      std::memcpy(&number, from, sizeof(number));
      from += sizeof(number);
    });
    const std::string found = fault_of<Real>(record, shape.slots, static_cast<Index>(data.model->couplings.size()), bytes, shape.positions + shape.velocities);
    if (found.empty()) return;
    const std::lock_guard lock(telling);
    if (i < faulty) faulty = i, fault = found;
  });
  if (!fault.empty()) in.impossible(fmt::format("{} of instance {}", fault, faulty));
  return records;
}

/// What a checkpoint holds before its instances, of how many and of which size they are.
struct BatchParts {
  BatchHeader header;
  std::string_view effects, instances;
  std::size_t of_each;
};

BatchParts parts_of(CheckpointReader& in, std::size_t size) {
  BatchParts parts{in.header<BatchHeader>(), {}, {}, 0};
  const std::size_t effects = in.size_of("effects", parts.header.effects);
  const std::size_t around = kOfBatch.line.size() + sizeof(BatchHeader) + effects + sizeof(std::uint64_t);
  const auto count = static_cast<std::size_t>(std::max<std::int64_t>(parts.header.instances, 0));
  const std::size_t numbers = size - std::min(size, around);
  if (count == 0 || numbers % count != 0) in.impossible(fmt::format("{} instances in {} bytes", parts.header.instances, numbers));
  in.numbers(effects + numbers);
  parts.effects = in.next(effects);
  parts.instances = in.next(numbers);
  parts.of_each = numbers / count;
  return parts;
}

}  // namespace

std::string joined_instances(std::span<const InstancesOf> parts) {
  if (parts.empty()) throw InputError("instances are to be joined, and there are none; give one part at least");
  std::string all;
  std::int64_t count = 0;
  for (const InstancesOf& part : parts) {
    CheckpointBytes bytes(part.bytes, part.name);
    CheckpointReader in(bytes, kOfBatch);
    BatchParts found = parts_of(in, part.bytes.size());
    if (part.first < 0 || part.first >= part.last || part.last > found.header.instances) {
      throw InputError(fmt::format("{}: instances {} to {} are asked of a checkpoint of {}; expected some of these", part.name, part.first,
                                   part.last - 1, found.header.instances));
    }
    found.header.instances = 0;  // told at the end
    std::string before(reinterpret_cast<const char*>(&found.header), sizeof(BatchHeader));
    before += found.effects;
    if (all.empty()) all = before;
    if (!all.starts_with(before)) {
      throw InputError(fmt::format("{}: this checkpoint is one of other instances than {}: of another model, step, gravity or precision, "
                                   "with other effects, or with other rows that were set; join what belongs together",
                                   part.name, parts.front().name));
    }
    const auto first = static_cast<std::size_t>(part.first), last = static_cast<std::size_t>(part.last);
    all += found.instances.substr(first * found.of_each, (last - first) * found.of_each);
    count += part.last - part.first;
  }
  std::memcpy(all.data() + offsetof(BatchHeader, instances), &count, sizeof(count));
  return sealed(kOfBatch.line, all);
}

template <class Real>
std::string BatchOf<Real>::checkpoint() const {
  const Data& data = *data_;
  const std::string effects = effect_owners(data.plan, model().names);
  const BatchHeader header{checkpoint_of(model(), options()), size(), sizeof(Real), data.plan.kept(), rows_there(data),
                      static_cast<std::int64_t>(effects.size())};
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof(BatchHeader));
  bytes += effects;
  const std::size_t begin = bytes.size(), of_each = instance_bytes(data, header.rows);
  bytes.resize(begin + of_each * static_cast<std::size_t>(size()));
  for_instances(data, bytes.data() + begin, of_each, [&](std::int64_t i, char* to) {
    const auto put = [&](const auto& number) {
      std::memcpy(to, &number, sizeof(number));
      to += sizeof(number);
    };
    each_row(data, header.rows, [&](const auto& numbers, Index rows) {
      const auto* const from = numbers.data() + data.at(i / lanes(), rows) + i % lanes();
      for (Index row = 0; row < rows; ++row) put(from[row * lanes()]);
    });
    each_member(data.records[static_cast<std::size_t>(i)], put);
  });
  return sealed(kOfBatch.line, bytes);
}

template <class Real>
void BatchOf<Real>::restore(CheckpointBytes& bytes) {
  Data& data = *data_;
  CheckpointReader in(bytes, kOfBatch);
  const auto header = in.header<BatchHeader>();
  in.check_model(header.of, model());
  if (header.instances != size()) {
    throw InputError(fmt::format("{}: this checkpoint is one of {} instances; the batch has {}; load it into one of as many", bytes.name(),
                                 header.instances, size()));
  }
  if (header.precision != sizeof(Real)) {
    throw InputError(fmt::format("{}: this checkpoint holds numbers of {} bytes; the batch computes with {}; load it into one of the same "
                                 "precision",
                                 bytes.name(), header.precision, sizeof(Real)));
  }
  in.check_effects(header.effects, effect_owners(data.plan, model().names));
  in.check_step(header.of, options());
  if (header.kept != data.plan.kept() || ((header.rows ^ rows_there(data)) & ~rows_asked(data)) != 0) {
    in.impossible("other rows than an instance has");
  }
  const std::size_t of_each = instance_bytes(data, header.rows);
  in.numbers(of_each * static_cast<std::size_t>(size()));
  const std::string_view all = in.next(of_each * static_cast<std::size_t>(size()));
  std::vector<InstanceRecord> records = sound_records<Real>(in, data, all, of_each);

  // nothing can go wrong any more, as long as there is memory
  int k = always_there(data);
  Data::each_asked(data, [&](auto& numbers, Index rows, const auto& own) {
    const bool comes = (header.rows >> k++ & 1) != 0;
    if (comes == numbers.empty()) data.fill(numbers, rows, own);
  });
  for_instances(data, all.data(), of_each, [&](std::int64_t i, const char* from) {
    each_row(data, header.rows, [&](auto& numbers, Index rows) {
      auto* const to = numbers.data() + data.at(i / lanes(), rows) + i % lanes();
      for (Index row = 0; row < rows; ++row, from += sizeof(*to)) std::memcpy(to + row * lanes(), from, sizeof(*to));
    });
  });
  data.records = std::move(records);
  data.has_start.clear();
}

template <class Real>
void BatchOf<Real>::save(const std::string& file) const {
  write_file(file, checkpoint());
}

template <class Real>
void BatchOf<Real>::load(const std::string& file) {
  CheckpointBytes bytes(file);
  restore(bytes);
}

template <class Real>
void BatchOf<Real>::restore(std::string_view bytes, const std::string& name) {
  CheckpointBytes given(bytes, name);
  restore(given);
}

template std::string BatchOf<double>::checkpoint() const;
template std::string BatchOf<float>::checkpoint() const;
template void BatchOf<double>::save(const std::string& file) const;
template void BatchOf<float>::save(const std::string& file) const;
template void BatchOf<double>::load(const std::string& file);
template void BatchOf<float>::load(const std::string& file);
template void BatchOf<double>::restore(std::string_view bytes, const std::string& name);
template void BatchOf<float>::restore(std::string_view bytes, const std::string& name);

}  // namespace linden
