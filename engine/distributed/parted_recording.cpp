#include "engine/distributed/parted_recording.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "layout/support/input_error.hpp"

namespace linden {

template <class Real>
PartedRecording<Real>::PartedRecording(Ranks& ranks, std::string file, std::int64_t instances, std::vector<RecordedArray> arrays,
                                       std::vector<FixedArray> fixed, int packers)
    : PartedRecording(ranks, std::move(file), instances, std::move(arrays), std::move(fixed),
                      {ranks.broadcast(ranks.first() ? Destination::letters() : ""), {}}, packers) {}

template <class Real>
PartedRecording<Real>::PartedRecording(Ranks& ranks, std::string file, std::int64_t instances, std::vector<RecordedArray> arrays,
                                       std::vector<FixedArray> fixed, RecordedParts done, int packers)
    : ranks_(ranks),
      file_(std::move(file)),
      instances_(instances),
      arrays_(with_own_names(std::move(arrays), fixed)),
      fixed_(std::move(fixed)),
      packers_(packers),
      done_(std::move(done)),
      folder_(file_, done_.letters, !done_.segments.empty()) {
  if (const std::string ending = std::filesystem::path(file_).extension().string(); ending != ".h5") {
    throw InputError(fmt::format("{}: the file's name ends in \"{}\"; expected .h5, which alone can be written in parts", file_, ending));
  }
  const std::string fault = first_text(ranks_, fault_of([&] {
    if (!ranks_.first()) return;
    if (done_.segments.empty()) return folder_.make();
    folder_.take(done_.segments);
    write_master();  // before what it shows of later frames goes
    folder_.clear_but(done_.segments);
  }));
  if (!fault.empty()) throw std::runtime_error(fault);
  begin_segment();
}

template <class Real>
PartedRecording<Real>::~PartedRecording() = default;

template <class Real>
std::string PartedRecording<Real>::fault_of(const std::function<void()>& work) const {
  try {
    work();
  } catch (const std::exception& error) {
    return of_recording(error.what());
  }
  return "";
}

template <class Real>
std::string PartedRecording<Real>::of_recording(std::string text) const {
  if (!part_file_.empty() && text.starts_with(part_file_)) text.replace(0, part_file_.size(), file_);
  return text;
}

template <class Real>
void PartedRecording<Real>::begin_segment() {
  const std::size_t number = done_.segments.size();
  part_file_ = folder_.part(number, ranks_.rank(), ranks_.count());
  const std::string fault = first_text(ranks_, fault_of([&] {
    if (ranks_.first()) {
      room_.emplace((std::filesystem::path(folder_.path()) / ".room.part").string());
      if (const int error = room_->grow(bytes_of_master())) cannot_be_written(file_, error);
    } else if (!std::filesystem::is_directory(folder_.path())) {
      cannot_be_written(file_, fmt::format("rank {} does not see the folder {} that rank 0 has made; expected a file system that all machines share",
                                           ranks_.rank(), folder_.path()));
    }
    const std::int64_t own = share_of(instances_, ranks_.rank(), ranks_.count()).count;
    part_.emplace(part_file_, own, arrays_, number == 0 ? fixed_ : std::vector<FixedArray>(), packers_);
  }));
  if (!fault.empty()) throw std::runtime_error(fault);
  for (FixedArray& array : fixed_) array.numbers = {};
}

template <class Real>
void PartedRecording<Real>::add(double time, std::span<const std::span<const Real>> arrays, std::span<const Real> energy,
                                std::span<const std::uint8_t> status) {
  try {
    part_->add(time, arrays, energy, status);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(of_recording(error.what()));
  }
}

template <class Real>
void PartedRecording<Real>::end_segment() {
  put_in_place();
  begin_segment();
}

template <class Real>
void PartedRecording<Real>::commit() {
  put_in_place();
  if (done_.segments.empty()) cannot_be_written(file_, "the disk has no room for one frame");
}

template <class Real>
void PartedRecording<Real>::put_in_place() {
  std::int64_t frames = part_ ? part_->frames() : 0;  // a segment that could not begin has none
  ranks_.least({&frames, 1});
  std::string fault;
  if (frames > 0) {
    fault = fault_of([&] { part_->commit(); });
    if (!fault.empty()) frames = 0;
    ranks_.least({&frames, 1});
  }
  part_.reset();
  if (frames > 0) {
    done_.segments.push_back({frames, ranks_.count()});
    if (ranks_.first()) fault = fault_of([&] { write_master(); });
  }
  fault = first_text(ranks_, fault);
  if (fault.empty() && frames > 0) folder_.keep();
  if (fault.empty()) return;
  if (frames > 0) done_.segments.pop_back();
  throw std::runtime_error(fault);
}

template <class Real>
void PartedRecording<Real>::write_master() {
  room_.reset();
  H5Master master(file_, parts_of_master());
  declare<Real>(master, instances_, arrays_, fixed_);
  master.commit([&] { folder_.keep(); });
}

template <class Real>
std::vector<RecordingPart> PartedRecording<Real>::parts_of_master() const {
  std::vector<RecordingPart> parts;
  std::int64_t first_frame = 0;
  for (std::size_t k = 0; k < done_.segments.size(); ++k) {
    const RecordedSegment& segment = done_.segments[k];
    for (int rank = 0; rank < segment.ranks; ++rank) {
      const InstanceRange share = share_of(instances_, rank, segment.ranks);
      parts.push_back({folder_.part_of_master(k, rank, segment.ranks), first_frame, segment.frames, share.first, share.count});
    }
    first_frame += segment.frames;
  }
  return parts;
}

template <class Real>
std::size_t PartedRecording<Real>::bytes_of_master() const {
  constexpr std::size_t kRest = 1 << 16;
  std::size_t parts = static_cast<std::size_t>(ranks_.count()), bytes = kRest;
  for (const RecordedSegment& segment : done_.segments) parts += static_cast<std::size_t>(segment.ranks);
  for (const RecordedArray& array : arrays_) {
    for (const std::string& row : array.rows) bytes += 4 * row.size();  // as words and as an attribute
  }
  return bytes + (arrays_.size() + fixed_.size() + 3) * parts * kMasterBytesPerPart;
}

template <class Real>
std::int64_t PartedRecording<Real>::frames() const {
  return done_.frames() + (part_ ? part_->frames() : 0);
}

template class PartedRecording<double>;
template class PartedRecording<float>;

}  // namespace linden
