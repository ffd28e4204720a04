// engine/files/h5_output.hpp
// An HDF5 file that is being written: on a disk that may be full (h5_disk.hpp), under a hidden name until it is published. Equal content makes
// equal bytes: HDF5 keeps no times. Words are strings of fixed length, padded with zeros.
#pragma once

#include <hdf5.h>

#include <functional>
#include <span>
#include <string>
#include <utility>

#include "engine/files/array_file.hpp"
#include "engine/files/h5_disk.hpp"
#include "engine/files/h5_handle.hpp"
#include "engine/files/temporary_folder.hpp"

namespace linden {

/// In a file and in memory.
inline std::pair<hid_t, hid_t> h5_types(ElementType type) {
  switch (type) {
    case ElementType::float32: return {H5T_IEEE_F32LE, H5T_NATIVE_FLOAT};
    case ElementType::float64: return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE};
    case ElementType::uint8: break;
  }
  return {H5T_STD_U8LE, H5T_NATIVE_UINT8};
}

/// All functions throw cannot_be_written, naming the file.
class H5Output {
 public:
  explicit H5Output(const std::string& file) : folder_(file), disk_(folder_.file(kWhole)), file_(create()) {}

  const std::string& target() const { return folder_.target(); }
  H5Disk& disk() { return disk_; }

  /// A property list for create that says nothing but that no times are kept.
  Handle creation() const;
  Handle space(std::span<const hsize_t> sizes, const hsize_t* most = nullptr) const;
  /// A dataset in the root.
  Handle create(const std::string& name, hid_t type, const Handle& space, const Handle& creation) const;
  void add_words(const std::string& name, std::span<const std::string> words) const;
  /// As attributes of a dataset, names where they are not too many.
  void describe(hid_t dataset, std::span<const std::string> names, const std::string& units) const;
  /// Closes the file, after all of its datasets, and puts it in place. What was there before goes, and its parts with it (h5_master.hpp)
  /// unless they are in the folder `own_parts`. `before` is called when all but that is done.
  void publish(const std::string& own_parts = "", const std::function<void()>& before = [] {});

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
  /// Whether HDF5 and the disk had no trouble.
  void require(bool done) const;

 private:
  static constexpr const char* kWhole = "whole.h5";
  Handle create();

  TemporaryFolder folder_;
  H5Disk disk_;
  Handle file_;
};

}  // namespace linden
