// engine/files/h5_handle.hpp
// What HDF5 gives and takes back, and what it says when it fails.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace linden {

/// Unless told not to, HDF5 prints its errors; what it is told holds for the thread.
inline void silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

/// A number that HDF5 gave for something of its own.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);

  Handle(hid_t id, Close closing) : id_(id), close_(closing) {}
  ~Handle() { close(); }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    close();
    id_ = std::exchange(other.id_, H5I_INVALID_HID);
    close_ = other.close_;
    return *this;
  }

  hid_t id() const { return id_; }
  herr_t close() {
    silence();
    const hid_t id = std::exchange(id_, H5I_INVALID_HID);
    return id < 0 ? 0 : close_(id);
  }

 private:
  hid_t id_;
  Close close_;
};

/// Files that the numbers of a virtual dataset lie in, by its creation property list, as it names them; empty for any other.
inline std::vector<std::string> virtual_files(hid_t creation) {
  std::vector<std::string> files;
  std::size_t count = 0;
  if (H5Pget_layout(creation) != H5D_VIRTUAL || H5Pget_virtual_count(creation, &count) < 0) return files;
  for (std::size_t k = 0; k < count; ++k) {
    const ssize_t length = H5Pget_virtual_filename(creation, k, nullptr, 0);
    std::string& name = files.emplace_back(static_cast<std::size_t>(length < 0 ? 0 : length) + 1, '\0');
    if (H5Pget_virtual_filename(creation, k, name.data(), name.size()) >= 0) name.pop_back();
  }
  return files;
}

/// What went wrong first in the call that failed.
inline std::string first_error() {
  std::string text = "HDF5 failed";
  const auto keep_first = [](unsigned depth, const H5E_error2_t* error, void* into) -> herr_t {
    if (depth == 0 && error->desc) *static_cast<std::string*>(into) = error->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first, &text);
  return text;
}

}  // namespace linden
