// engine/files/h5_handle.hpp
// What HDF5 gives and takes back, and what it says when it fails.
#pragma once

#include <hdf5.h>

#include <string>
#include <utility>

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
  Handle& operator=(Handle&&) = delete;

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
