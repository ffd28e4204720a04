#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "engine/files/array_readers.hpp"
#include "engine/files/h5_handle.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"

namespace linden {
namespace {

class H5Reader {
 public:
  explicit H5Reader(const std::string& file) : file_name_(file), file_(open()) {}

  RecordedArrays read() {
    H5G_info_t about;
    silence();
    require(H5Gget_info(file_.id(), &about) >= 0);
    for (hsize_t k = 0; k < about.nlinks; ++k) {
      const ssize_t length = H5Lget_name_by_idx(file_.id(), ".", H5_INDEX_NAME, H5_ITER_INC, k, nullptr, 0, H5P_DEFAULT);
      require(length >= 0);
      std::string name(static_cast<std::size_t>(length) + 1, '\0');
      require(H5Lget_name_by_idx(file_.id(), ".", H5_INDEX_NAME, H5_ITER_INC, k, name.data(), name.size(), H5P_DEFAULT) >= 0);
      name.pop_back();
      const Handle object(H5Oopen(file_.id(), name.c_str(), H5P_DEFAULT), H5Oclose);
      if (object.id() >= 0 && H5Iget_type(object.id()) == H5I_DATASET) add(name, object.id());
    }
    return std::move(arrays_);
  }

 private:
  Handle open() {
    silence();
    (void)open_to_read(file_name_);  // is told to those who must not write over it
    Handle file(H5Fopen(file_name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    require(file.id() >= 0);
    return file;
  }

  void add(const std::string& name, hid_t dataset) {
    const Handle space(H5Dget_space(dataset), H5Sclose), type(H5Dget_type(dataset), H5Tclose);
    require(space.id() >= 0 && type.id() >= 0);
    const int axes = H5Sget_simple_extent_ndims(space.id());
    require(axes >= 0);
    std::vector<hsize_t> sizes(static_cast<std::size_t>(axes));
    if (axes > 0) require(H5Sget_simple_extent_dims(space.id(), sizes.data(), nullptr) >= 0);
    const std::vector<std::int64_t> shape(sizes.begin(), sizes.end());
    const std::size_t count = count_of(file_name_, name, shape);
    require_parts(dataset);
    const H5T_class_t kind = H5Tget_class(type.id());
    if (kind == H5T_FLOAT || kind == H5T_INTEGER) {
      std::vector<double> numbers(count);
      if (count > 0) require(H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) >= 0);
      arrays_.numbers[name] = {shape, std::move(numbers)};
    } else if (kind == H5T_STRING && H5Tis_variable_str(type.id()) == 0) {
      const std::size_t longest = H5Tget_size(type.id());
      const std::size_t bytes = count_of(file_name_, name, {static_cast<std::int64_t>(count), static_cast<std::int64_t>(longest)});
      std::string cells(bytes, '\0');
      if (count > 0) require(H5Dread(dataset, type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, cells.data()) >= 0);
      std::vector<std::string>& words = arrays_.words[name];
      for (std::size_t k = 0; k < count; ++k) {
        const std::string cell = cells.substr(k * longest, longest);
        words.push_back(cell.substr(0, cell.find('\0')));
      }
    }
  }

  /// Of a recording in parts (h5_master.hpp): HDF5 reads what is not there as if it held no numbers.
  void require_parts(hid_t dataset) {
    const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
    require(creation.id() >= 0);
    const std::filesystem::path folder = std::filesystem::canonical(file_name_).parent_path();
    for (const std::string& part : virtual_files(creation.id())) {
      if (!found_.insert(part).second || std::filesystem::exists(folder / part)) continue;
      throw InputError(fmt::format("{}: its part {} is not there; expected it beside the file; copy or move the folder with it", file_name_, part));
    }
  }

  void require(bool done) const {
    if (done) return;
    throw InputError(fmt::format("{}: {}; expected a .h5 file that linden or h5py wrote", file_name_, first_error()));
  }

  std::string file_name_;
  Handle file_;
  RecordedArrays arrays_;
  std::set<std::string> found_;  // parts that are there
};

}  // namespace

RecordedArrays h5_arrays(const std::string& file) { return H5Reader(file).read(); }

}  // namespace linden
