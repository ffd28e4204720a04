// Numbers are datasets in chunks of about one row, without filters.
#include <hdf5.h>

#include <algorithm>

#include "engine/files/array_file.hpp"
#include "engine/files/h5_output.hpp"

namespace linden {
namespace {

// bytes of a chunk: every chunk takes a place in an index and a trip to the disk, and is read whole even where a part is asked for
constexpr hsize_t kSmallestChunk = 1 << 16, kLargestChunk = 1 << 21;

/// [rows, row...] of about one row.
std::vector<hsize_t> chunk_of(std::span<const hsize_t> row, hsize_t element) {
  std::vector<hsize_t> chunk{1};
  hsize_t bytes = element;
  for (const hsize_t size : row) {
    chunk.push_back(std::max<hsize_t>(size, 1));
    bytes *= chunk.back();
  }
  if (bytes < kSmallestChunk) chunk[0] = (kSmallestChunk + bytes - 1) / bytes;
  for (std::size_t axis = 1; axis < chunk.size() && bytes > kLargestChunk; ++axis) {
    const hsize_t whole = chunk[axis], parts = std::min(whole, (bytes + kLargestChunk - 1) / kLargestChunk);
    chunk[axis] = (whole + parts - 1) / parts;
    bytes = bytes / whole * chunk[axis];
  }
  return chunk;
}

class H5File final : public ArrayFile {
 public:
  explicit H5File(const std::string& file) : out_(file) {}

  void add_numbers(const std::string& name, ElementType type, std::vector<std::int64_t> row, std::vector<std::string>) override {
    const auto [stored, native] = h5_types(type);
    const std::vector<hsize_t> one_row(row.begin(), row.end());
    std::vector<hsize_t> now{0}, most{H5S_UNLIMITED};
    for (const hsize_t size : one_row) {
      now.push_back(size);
      most.push_back(size > 0 ? size : H5S_UNLIMITED);  // no chunk is longer than an axis that cannot grow
    }
    const Handle creation = out_.creation();
    const std::vector<hsize_t> chunk = chunk_of(one_row, H5Tget_size(native));
    out_.call(H5Pset_chunk, creation.id(), static_cast<int>(chunk.size()), chunk.data());
    hsize_t room = H5Tget_size(native) * chunk[0];
    for (std::size_t axis = 1; axis < chunk.size(); ++axis) room *= (one_row[axis - 1] + chunk[axis] - 1) / chunk[axis] * chunk[axis];
    arrays_.push_back({out_.create(name, stored, out_.space(now, most.data()), creation), out_.space(one_row), native, now, chunk[0], room});
  }

  void describe(std::span<const std::string> names, const std::string& units) override {
    out_.describe(arrays_.back().dataset.id(), names, units);
  }

  void add_fixed(const std::string& name, std::vector<std::int64_t> shape, std::span<const double> numbers) override {
    const std::vector<hsize_t> sizes(shape.begin(), shape.end());
    Handle dataset = out_.create(name, H5T_IEEE_F64LE, out_.space(sizes), out_.creation());
    out_.call(H5Dwrite, dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
    out_.finish(dataset);
  }

  void add_words(const std::string& name, std::span<const std::string> words) override { out_.add_words(name, words); }

  void append(std::span<const void* const> rows) override {
    out_.require(true);
    if (const int error = out_.disk().hold(row_room())) cannot_be_written(out_.target(), error);
    for (std::size_t k = 0; k < rows.size(); ++k) append(arrays_[k], rows[k]);
    rows_ += 1;
  }

  std::int64_t rows() const override { return rows_; }

  void commit() override {
    const std::int64_t all = std::exchange(rows_, 0);
    for (Array& array : arrays_) out_.finish(array.dataset);
    out_.publish();
    rows_ = all;
  }

 private:
  struct Array {
    Handle dataset, row;         // row: one row in memory
    hid_t type;                  // in memory
    std::vector<hsize_t> shape;  // [rows, row...]
    hsize_t chunk_rows;          // of a chunk
    hsize_t chunk_bytes;         // of the chunks that a row lies in
  };

  /// Room that the next row of all arrays takes at most: chunks that begin with it, and places in their index.
  hsize_t row_room() const {
    constexpr hsize_t kOfStructure = 1 << 14;
    hsize_t room = kOfStructure;
    for (const Array& array : arrays_) {
      if (array.shape[0] % array.chunk_rows == 0) room += array.chunk_bytes + kOfStructure;
    }
    return room;
  }

  void append(Array& to, const void* row) {
    std::vector<hsize_t> start(to.shape.size(), 0), count = to.shape;
    start[0] = std::exchange(to.shape[0], to.shape[0] + 1);
    count[0] = 1;
    out_.call(H5Dset_extent, to.dataset.id(), to.shape.data());
    const Handle place = out_.own(H5Sclose, H5Dget_space, to.dataset.id());
    out_.call(H5Sselect_hyperslab, place.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    out_.call(H5Dwrite, to.dataset.id(), to.type, to.row.id(), place.id(), H5P_DEFAULT, row);
  }

  H5Output out_;
  std::vector<Array> arrays_;
  std::int64_t rows_ = 0;
};

}  // namespace

std::unique_ptr<ArrayFile> h5_file(const std::string& file) { return std::make_unique<H5File>(file); }

}  // namespace linden
