#include "engine/files/rollout_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <iterator>
#include <set>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

#include "engine/files/array_file.hpp"
#include "engine/files/temporary_folder.hpp"
#include "engine/step_report.hpp"

namespace linden {
namespace {

const std::string kStatuses[] = {"converged", "not_converged", "past_pi", "gains_energy", "not_finite", "opens"};
static_assert(std::size(kStatuses) == static_cast<std::size_t>(StepStatus::opens) + 1, "every status has a name");

std::unique_ptr<ArrayFile> array_file(const std::string& file, std::int64_t instances, int packers) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (ending == ".npz") return npz_file(file);
  if (ending == ".h5") return h5_file(file, packers);
  if (ending == ".csv" && instances == 1) return csv_file(file);
  cannot_be_written(file, fmt::format("the file's name ends in \"{}\"; expected .npz or .h5", ending));
}

void require_length(std::string_view what, std::size_t found, std::size_t expected) {
  if (found == expected) return;
  throw std::invalid_argument(fmt::format("a frame with {} numbers of {}; expected {}", found, what, expected));
}

std::vector<std::string> prefixed(const std::string& prefix, std::vector<std::string> names) {
  for (std::string& name : names) name.insert(0, prefix);
  return names;
}

}  // namespace

std::vector<RecordedArray> with_own_names(std::vector<RecordedArray> arrays, const std::vector<FixedArray>& fixed) {
  std::set<std::string> taken{"time", "energy", "status", "statuses"};
  for (const FixedArray& array : fixed) {
    taken.insert(array.name);
    taken.insert(array.names);
  }
  const auto take = [&](const std::string& name) {
    std::string own = name;
    for (int k = 2; !taken.insert(own).second; ++k) own = fmt::format("{}_{}", name, k);
    return own;
  };
  for (RecordedArray& array : arrays) array.name = take(array.name);
  return arrays;
}

template <class Real>
void declare(ArrayLayout& arrays, std::int64_t instances, const std::vector<RecordedArray>& recorded, const std::vector<FixedArray>& fixed) {
  constexpr ElementType kReal = std::is_same_v<Real, float> ? ElementType::float32 : ElementType::float64;
  arrays.add_numbers("time", ElementType::float64, {}, {"time"});
  arrays.add_numbers("energy", kReal, {instances}, {"energy"});
  for (const RecordedArray& array : recorded) {
    arrays.add_numbers(array.name, kReal, {instances, std::ssize(array.rows)}, prefixed(array.prefix, array.rows));
    if (!array.units.empty()) arrays.describe(array.rows, array.units);
  }
  arrays.add_numbers("status", ElementType::uint8, {instances}, {});
  for (const FixedArray& array : fixed) {
    std::vector<std::int64_t> shape{instances};
    if (!array.names.empty()) shape.push_back(std::ssize(array.columns));
    arrays.add_fixed(array.name, shape, array.numbers);
  }
  std::set<std::string> named;
  for (const RecordedArray& array : recorded) {
    if (named.insert(array.names).second) arrays.add_words(array.names, array.rows);
  }
  for (const FixedArray& array : fixed) {
    if (!array.names.empty() && named.insert(array.names).second) arrays.add_words(array.names, array.columns);
  }
  arrays.add_words("statuses", kStatuses);
}

template void declare<double>(ArrayLayout&, std::int64_t, const std::vector<RecordedArray>&, const std::vector<FixedArray>&);
template void declare<float>(ArrayLayout&, std::int64_t, const std::vector<RecordedArray>&, const std::vector<FixedArray>&);

RecordedArray recorded_positions(const Names& names) { return {"q", "positions", names.position, ""}; }
RecordedArray recorded_velocities(const Names& names) { return {"v", "velocities", names.velocity, "v."}; }

template <class Real>
struct RolloutFile<Real>::Data {
  std::string file;
  std::int64_t instances;
  std::vector<RecordedArray> recorded;
  std::unique_ptr<ArrayFile> arrays;  // none when all is done
  bool failed = false;
  std::int64_t frames = 0;  // that were committed

  void require_open() const {
    if (!arrays || failed) cannot_be_written(file, "it is committed or has failed before");
  }
};

template <class Real>
RolloutFile<Real>::RolloutFile(const std::string& file, std::int64_t instances, std::vector<RecordedArray> recorded,
                               const std::vector<FixedArray>& fixed, int packers)
    : data_(new Data{file, instances, with_own_names(std::move(recorded), fixed), array_file(file, instances, packers)}) {
  declare<Real>(*data_->arrays, instances, data_->recorded, fixed);
}

template <class Real>
RolloutFile<Real>::~RolloutFile() = default;

template <class Real>
void RolloutFile<Real>::add(double time, std::span<const std::span<const Real>> arrays, std::span<const Real> energy,
                            std::span<const std::uint8_t> status) {
  const auto n = static_cast<std::size_t>(data_->instances);
  require_length("energy", energy.size(), n);
  require_length("status", status.size(), n);
  if (arrays.size() != data_->recorded.size()) {
    throw std::invalid_argument(fmt::format("a frame of {} arrays; expected {}", arrays.size(), data_->recorded.size()));
  }
  std::vector<const void*> rows{&time, energy.data()};
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    require_length(data_->recorded[k].name, arrays[k].size(), n * data_->recorded[k].rows.size());
    rows.push_back(arrays[k].data());
  }
  rows.push_back(status.data());
  data_->require_open();
  data_->failed = true;
  data_->arrays->append(rows);
  data_->failed = false;
}

template <class Real>
void RolloutFile<Real>::commit() {
  if (!data_->arrays) data_->require_open();
  const std::unique_ptr<ArrayFile> arrays = std::move(data_->arrays);
  data_->frames = arrays->rows();
  if (data_->failed && data_->frames == 0) cannot_be_written(data_->file, "the disk has no room for one frame");
  try {
    arrays->commit();
  } catch (const std::runtime_error&) {
    data_->frames = arrays->rows();  // of a table there may be some
    throw;
  }
  data_->frames = arrays->rows();
}

template <class Real>
std::int64_t RolloutFile<Real>::frames() const {
  return data_->arrays ? data_->arrays->rows() : data_->frames;
}

template class RolloutFile<double>;
template class RolloutFile<float>;

}  // namespace linden
