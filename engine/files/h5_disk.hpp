// engine/files/h5_disk.hpp
// The file under an HDF5 file, which to HDF5 can always be written. HDF5 cannot close a file whose disk is full and ends the program by a
// signal for it; so the first error of the disk is kept here, to be asked for after every call, and HDF5 is told that all is well. What it
// writes from then on stays in memory as long as it takes to close the file: structure, which it may read again, but no numbers.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace linden {

class H5Disk {
 public:
  /// A new file.
  explicit H5Disk(const std::string& path);
  ~H5Disk();
  H5Disk(const H5Disk&) = delete;
  H5Disk& operator=(const H5Disk&) = delete;

  /// A list of properties for H5Fcreate, which with it creates the file here, whatever its name. The caller closes the list (H5Pclose) and
  /// the file before the disk is gone. Negative where HDF5 failed.
  hid_t access();
  /// The errno of what failed first; 0 = all is well.
  int error() const { return error_; }
  /// Gives the file room on the disk for so many bytes beyond those that HDF5 has given out. Returns an errno, 0 where it has it or the
  /// file system cannot do that.
  int hold(std::size_t bytes);
  /// After the HDF5 file.
  void close();

 private:
  struct Face;  // what HDF5 holds of it
  static H5FD_class_t driver();

  void read(haddr_t at, std::size_t size, std::byte* bytes);
  void write(haddr_t at, std::size_t size, const std::byte* bytes, bool numbers);
  void resize(haddr_t size);

  int file_, error_ = 0;
  haddr_t end_ = 0, allocated_ = 0, held_ = 0;  // bytes: written, given out by HDF5, taken of the disk ahead
  std::vector<std::pair<haddr_t, std::vector<std::byte>>> kept_;  // places and bytes, the latest last
};

}  // namespace linden
