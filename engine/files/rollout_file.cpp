#include "engine/files/rollout_file.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

#include "engine/files/array_file.hpp"
#include "engine/files/temporary_folder.hpp"
#include "engine/step_report.hpp"

namespace linden {
namespace {

const std::string kStatuses[] = {"converged", "not_converged", "past_pi", "gains_energy", "not_finite"};
static_assert(std::size(kStatuses) == static_cast<std::size_t>(StepStatus::not_finite) + 1, "every status has a name");

std::unique_ptr<ArrayFile> array_file(const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (ending == ".npz") return npz_file(file);
  if (ending == ".h5") return h5_file(file);
  cannot_be_written(file, fmt::format("the file's name ends in \"{}\"; expected .npz or .h5", ending));
}

void require_length(std::string_view what, std::size_t found, std::int64_t expected) {
  if (found == static_cast<std::size_t>(expected)) return;
  throw std::invalid_argument(fmt::format("a frame with {} numbers of {}; expected {}", found, what, expected));
}

}  // namespace

template <class Real>
struct RolloutFile<Real>::Data {
  std::string file;
  std::int64_t instances, nq, nv;
  std::unique_ptr<ArrayFile> arrays;  // none when all is done
  bool failed = false;
  std::int64_t frames = 0;  // that were committed

  void require_open() const {
    if (!arrays || failed) cannot_be_written(file, "it is committed or has failed before");
  }
};

template <class Real>
RolloutFile<Real>::RolloutFile(const std::string& file, const Names& names, std::int64_t instances)
    : data_(new Data{file, instances, std::ssize(names.position), std::ssize(names.velocity), array_file(file)}) {
  constexpr ElementType kReal = std::is_same_v<Real, float> ? ElementType::float32 : ElementType::float64;
  ArrayFile& arrays = *data_->arrays;
  arrays.add_numbers("time", ElementType::float64, {});
  arrays.add_numbers("q", kReal, {instances, data_->nq});
  arrays.add_numbers("v", kReal, {instances, data_->nv});
  arrays.add_numbers("energy", kReal, {instances});
  arrays.add_numbers("status", ElementType::uint8, {instances});
  arrays.add_words("positions", names.position);
  arrays.add_words("velocities", names.velocity);
  arrays.add_words("statuses", kStatuses);
}

template <class Real>
RolloutFile<Real>::~RolloutFile() = default;

template <class Real>
void RolloutFile<Real>::add(double time, std::span<const Real> q, std::span<const Real> v, std::span<const Real> energy,
                            std::span<const std::uint8_t> status) {
  require_length("q", q.size(), data_->instances * data_->nq);
  require_length("v", v.size(), data_->instances * data_->nv);
  require_length("energy", energy.size(), data_->instances);
  require_length("status", status.size(), data_->instances);
  data_->require_open();
  data_->failed = true;
  data_->arrays->append(std::array<const void*, 5>{&time, q.data(), v.data(), energy.data(), status.data()});
  data_->failed = false;
}

template <class Real>
void RolloutFile<Real>::commit() {
  if (!data_->arrays) data_->require_open();
  const std::unique_ptr<ArrayFile> arrays = std::move(data_->arrays);
  data_->frames = arrays->rows();
  if (data_->failed && data_->frames == 0) cannot_be_written(data_->file, "the disk has no room for one frame");
  arrays->commit();
}

template <class Real>
std::int64_t RolloutFile<Real>::frames() const {
  return data_->arrays ? data_->arrays->rows() : data_->frames;
}

template class RolloutFile<double>;
template class RolloutFile<float>;

}  // namespace linden
