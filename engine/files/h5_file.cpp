// Numbers are datasets in chunks of some rows of some instances (h5_chunks.hpp), which are written when their rows are full.
#include <hdf5.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstring>

#include "engine/files/array_file.hpp"
#include "engine/files/h5_chunks.hpp"
#include "engine/files/h5_output.hpp"

namespace linden {
namespace {

class H5File final : public ArrayFile {
 public:
  H5File(const std::string& file, int packers) : out_(file), packers_(packers) {}

  void add_numbers(const std::string& name, ElementType type, std::vector<std::int64_t> row, std::vector<std::string>) override {
    const auto [stored, native] = h5_types(type);
    const std::vector<hsize_t> one_row(row.begin(), row.end());
    std::vector<hsize_t> now{0}, most{H5S_UNLIMITED};
    for (const hsize_t size : one_row) {
      now.push_back(size);
      most.push_back(size > 0 ? size : H5S_UNLIMITED);  // no chunk is longer than an axis that cannot grow
    }
    H5Chunks chunks(one_row, H5Tget_size(native));
    const std::vector<hsize_t> sizes = chunks.sizes();
    const Handle creation = out_.creation();
    out_.call(H5Pset_chunk, creation.id(), static_cast<int>(sizes.size()), sizes.data());
    out_.call(H5Pset_shuffle, creation.id());
    out_.call(H5Pset_deflate, creation.id(), 1u);
    arrays_.push_back({out_.create(name, stored, out_.space(now, most.data()), creation), chunks, now, {}});
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
    std::size_t room = 0;
    for (const Array& array : arrays_) room += array.chunks.room(array.waiting_rows() + 1);
    if (const int error = out_.disk().hold(room)) cannot_be_written(out_.target(), error);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      Array& to = arrays_[k];
      const auto* const row = static_cast<const std::byte*>(rows[k]);
      to.waiting.insert(to.waiting.end(), row, row + to.chunks.row_bytes());
      if (to.waiting_rows() == to.chunks.rows()) write(to);
    }
    rows_ += 1;
  }

  std::int64_t rows() const override { return rows_; }

  void commit() override {
    const auto all = static_cast<hsize_t>(std::exchange(rows_, 0));
    for (Array& array : arrays_) {
      write(array);
      array.shape[0] = all;  // also of one whose rows have no numbers
      out_.call(H5Dset_extent, array.dataset.id(), array.shape.data());
      out_.finish(array.dataset);
    }
    out_.publish();
    rows_ = static_cast<std::int64_t>(all);
  }

 private:
  struct Array {
    Handle dataset;
    H5Chunks chunks;
    std::vector<hsize_t> shape;      // [rows, row...], of what is written
    std::vector<std::byte> waiting;  // rows behind these, which fill no chunk yet

    std::size_t waiting_rows() const { return waiting.empty() ? 0 : waiting.size() / chunks.row_bytes(); }
  };

  void write(Array& array) const {
    if (array.waiting.empty()) return;
    std::vector<H5Chunks::Chunk> chunks(array.chunks.beside());
    const hsize_t first = array.shape[0];
    oneapi::tbb::task_arena(std::max(packers_, 1)).execute([&] {
      oneapi::tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t k) {
        chunks[k] = array.chunks.chunk(k, array.waiting, first, packers_ > 0);
      });
    });
    array.shape[0] += array.waiting_rows();
    array.waiting.clear();
    out_.call(H5Dset_extent, array.dataset.id(), array.shape.data());
    for (const H5Chunks::Chunk& chunk : chunks) {
      out_.call(H5Dwrite_chunk, array.dataset.id(), H5P_DEFAULT, chunk.skipped, chunk.place.data(), chunk.bytes.size(), chunk.bytes.data());
    }
  }

  H5Output out_;
  int packers_;  // threads
  std::vector<Array> arrays_;
  std::int64_t rows_ = 0;
};

}  // namespace

std::unique_ptr<ArrayFile> h5_file(const std::string& file, int packers) { return std::make_unique<H5File>(file, packers); }

}  // namespace linden
