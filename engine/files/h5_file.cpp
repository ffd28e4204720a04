// Numbers are datasets in chunks of about one row, without filters; words are strings of fixed length, padded with zeros.
#include <hdf5.h>

#include <algorithm>

#include "engine/files/array_file.hpp"
#include "engine/files/h5_disk.hpp"
#include "engine/files/h5_handle.hpp"
#include "engine/files/temporary_folder.hpp"

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
  explicit H5File(const std::string& file) : folder_(file), disk_(folder_.file(kWhole)), file_(create()) {}

  void add_numbers(const std::string& name, ElementType type, std::vector<std::int64_t> row, std::vector<std::string>) override {
    const std::pair<hid_t, hid_t> types[] = {{H5T_IEEE_F32LE, H5T_NATIVE_FLOAT},
                                             {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE},
                                             {H5T_STD_U8LE, H5T_NATIVE_UINT8}};
    const auto [stored, native] = types[static_cast<std::size_t>(type)];
    const std::vector<hsize_t> one_row(row.begin(), row.end());
    std::vector<hsize_t> now{0}, most{H5S_UNLIMITED};
    for (const hsize_t size : one_row) {
      now.push_back(size);
      most.push_back(size > 0 ? size : H5S_UNLIMITED);  // no chunk is longer than an axis that cannot grow
    }
    const Handle space = own(H5Sclose, H5Screate_simple, static_cast<int>(now.size()), now.data(), most.data());
    const Handle creation = without_times();
    const std::vector<hsize_t> chunk = chunk_of(one_row, H5Tget_size(native));
    call(H5Pset_chunk, creation.id(), static_cast<int>(chunk.size()), chunk.data());
    hsize_t room = H5Tget_size(native) * chunk[0];
    for (std::size_t axis = 1; axis < chunk.size(); ++axis) room *= (one_row[axis - 1] + chunk[axis] - 1) / chunk[axis] * chunk[axis];
    arrays_.push_back({create(name, stored, space, creation),
                       own(H5Sclose, H5Screate_simple, static_cast<int>(now.size()) - 1, now.data() + 1, nullptr), native, now, chunk[0], room});
  }

  void describe(std::span<const std::string> names, const std::string& units) override {
    constexpr std::size_t kMostNames = 2000;  // an attribute has 64 KiB
    const hid_t dataset = arrays_.back().dataset.id();
    const Handle type = own(H5Tclose, H5Tcopy, H5T_C_S1);
    call(H5Tset_size, type.id(), H5T_VARIABLE);
    call(H5Tset_cset, type.id(), H5T_CSET_UTF8);
    const auto write = [&](const char* attribute, const Handle& space, const std::vector<const char*>& words) {
      Handle made = own(H5Aclose, H5Acreate2, dataset, attribute, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT);
      call(H5Awrite, made.id(), type.id(), words.data());
      finish(made);
    };
    write("units", own(H5Sclose, H5Screate, H5S_SCALAR), {units.c_str()});
    if (names.size() > kMostNames) return;
    std::vector<const char*> words;
    for (const std::string& name : names) words.push_back(name.c_str());
    const hsize_t count = words.size();
    write("names", own(H5Sclose, H5Screate_simple, 1, &count, nullptr), words);
  }

  void add_fixed(const std::string& name, std::vector<std::int64_t> shape, std::span<const double> numbers) override {
    const std::vector<hsize_t> sizes(shape.begin(), shape.end());
    const Handle space = own(H5Sclose, H5Screate_simple, static_cast<int>(sizes.size()), sizes.data(), nullptr);
    Handle dataset = create(name, H5T_IEEE_F64LE, space, without_times());
    call(H5Dwrite, dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
    finish(dataset);
  }

  void add_words(const std::string& name, std::span<const std::string> words) override {
    std::size_t longest = 1;
    for (const std::string& word : words) longest = std::max(longest, word.size());
    std::string cells;
    for (const std::string& word : words) cells.append(word).append(longest - word.size(), '\0');
    const Handle type = own(H5Tclose, H5Tcopy, H5T_C_S1);
    call(H5Tset_size, type.id(), longest);
    call(H5Tset_cset, type.id(), H5T_CSET_UTF8);
    call(H5Tset_strpad, type.id(), H5T_STR_NULLPAD);
    const hsize_t count = words.size();
    const Handle space = own(H5Sclose, H5Screate_simple, 1, &count, nullptr);
    Handle dataset = create(name, type.id(), space, without_times());
    call(H5Dwrite, dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, cells.data());
    finish(dataset);
  }

  void append(std::span<const void* const> rows) override {
    require(true);
    if (const int error = disk_.hold(row_room())) cannot_be_written(folder_.target(), error);
    for (std::size_t k = 0; k < rows.size(); ++k) append(arrays_[k], rows[k]);
    rows_ += 1;
  }

  std::int64_t rows() const override { return rows_; }

  void commit() override {
    const std::int64_t all = std::exchange(rows_, 0);
    for (Array& array : arrays_) finish(array.dataset);
    finish(file_);
    disk_.close();
    require(true);
    folder_.publish(kWhole);
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
    call(H5Dset_extent, to.dataset.id(), to.shape.data());
    const Handle place = own(H5Sclose, H5Dget_space, to.dataset.id());
    call(H5Sselect_hyperslab, place.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    call(H5Dwrite, to.dataset.id(), to.type, to.row.id(), place.id(), H5P_DEFAULT, row);
  }

  static constexpr const char* kWhole = "whole.h5";

  /// HDF5's functions that return an error ...
  template <class Function, class... Arguments>
  void call(Function function, Arguments... arguments) const {
    silence();
    require(function(arguments...) >= 0);
  }

  /// ... and those that return a handle.
  template <class Function, class... Arguments>
  Handle own(Handle::Close close, Function function, Arguments... arguments) const {
    silence();
    Handle handle(function(arguments...), close);
    require(handle.id() >= 0);
    return handle;
  }

  void finish(Handle& handle) const { require(handle.close() >= 0); }

  void require(bool done) const {
    if (disk_.error() != 0) cannot_be_written(folder_.target(), disk_.error());
    if (!done) cannot_be_written(folder_.target(), first_error());
  }

  Handle create() {
    const Handle access = own(H5Pclose, [this] { return disk_.access(); });
    // no chunk waits in memory: what there is room for is asked row by row
    call(H5Pset_cache, access.id(), 0, std::size_t{1}, std::size_t{0}, 1.0);
    return own(H5Fclose, H5Fcreate, kWhole, H5F_ACC_TRUNC, H5P_DEFAULT, access.id());
  }

  Handle create(const std::string& name, hid_t type, const Handle& space, const Handle& creation) const {
    return own(H5Dclose, H5Dcreate2, file_.id(), name.c_str(), type, space.id(), H5P_DEFAULT, creation.id(), H5P_DEFAULT);
  }

  Handle without_times() const {
    Handle creation = own(H5Pclose, H5Pcreate, H5P_DATASET_CREATE);
    call(H5Pset_obj_track_times, creation.id(), false);
    return creation;
  }

  TemporaryFolder folder_;
  H5Disk disk_;
  Handle file_;
  std::vector<Array> arrays_;
  std::int64_t rows_ = 0;
};

}  // namespace

std::unique_ptr<ArrayFile> h5_file(const std::string& file) { return std::make_unique<H5File>(file); }

}  // namespace linden
