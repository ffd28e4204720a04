#include "engine/files/h5_disk.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <utility>

#include "engine/files/held_room.hpp"

namespace linden {

struct H5Disk::Face : H5FD_t {
  explicit Face(H5Disk* of) : H5FD_t{}, disk(of) {}
  H5Disk* disk;
};

H5Disk::H5Disk(const std::string& path) : file_(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (file_ < 0) error_ = errno;
}

H5Disk::~H5Disk() { close(); }

int H5Disk::hold(std::size_t bytes) {
  const std::size_t needed = allocated_ + bytes;
  if (needed <= held_) return 0;
  for (const std::size_t size : {needed + needed / 8, needed}) {  // a call for some rows, not for each
    const int error = allocate(file_, size);
    if (error == 0) held_ = size;
    if (error == 0 || size == needed) return error;
  }
  return 0;
}

void H5Disk::close() {
  const int file = std::exchange(file_, -1);
  if (file >= 0 && ::close(file) != 0 && error_ == 0) error_ = errno;
}

void H5Disk::read(haddr_t at, std::size_t size, std::byte* bytes) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t count = ::pread(file_, bytes + done, size - done, static_cast<off_t>(at + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && error_ == 0) error_ = errno;
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  std::fill(bytes + done, bytes + size, std::byte{0});  // beyond the end
  for (const auto& [place, kept] : kept_) {
    const haddr_t begin = std::max(at, place), end = std::min(at + size, place + kept.size());
    if (begin < end) std::copy_n(kept.data() + (begin - place), end - begin, bytes + (begin - at));
  }
}

void H5Disk::write(haddr_t at, std::size_t size, const std::byte* bytes, bool numbers) {
  end_ = std::max<haddr_t>(end_, at + size);
  for (std::size_t done = 0; done < size && error_ == 0;) {
    const ssize_t count = ::pwrite(file_, bytes + done, size - done, static_cast<off_t>(at + done));
    if (count >= 0) {
      done += static_cast<std::size_t>(count);
    } else if (errno != EINTR) {
      error_ = errno;
    }
  }
  if (error_ != 0 && !numbers) kept_.push_back({at, {bytes, bytes + size}});
}

void H5Disk::resize(haddr_t size) {
  if (size == end_ && size >= held_) return;
  end_ = size;
  held_ = 0;
  if (error_ == 0 && ::ftruncate(file_, static_cast<off_t>(size)) != 0) error_ = errno;
}

H5FD_class_t H5Disk::driver() {
  H5FD_class_t driver{};
#ifdef H5FD_CLASS_VERSION  // since HDF5 1.14
  driver.version = H5FD_CLASS_VERSION;
  driver.value = 256;  // the first number that nobody registers
#endif
  driver.name = "linden";
  driver.maxaddr = static_cast<haddr_t>(std::numeric_limits<off_t>::max());
  driver.fc_degree = H5F_CLOSE_STRONG;
  driver.fapl_size = sizeof(H5Disk*);
  driver.open = [](const char*, unsigned, hid_t access, haddr_t) -> H5FD_t* {
    return new Face(*static_cast<H5Disk* const*>(H5Pget_driver_info(access)));
  };
  driver.close = [](H5FD_t* face) -> herr_t {
    delete static_cast<Face*>(face);
    return 0;
  };
  driver.query = [](const H5FD_t*, unsigned long* features) -> herr_t {
    *features = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE | H5FD_FEAT_AGGREGATE_SMALLDATA |
                H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
    return 0;
  };
  driver.get_eoa = [](const H5FD_t* face, H5FD_mem_t) { return static_cast<const Face*>(face)->disk->allocated_; };
  driver.set_eoa = [](H5FD_t* face, H5FD_mem_t, haddr_t end) -> herr_t {
    static_cast<Face*>(face)->disk->allocated_ = end;
    return 0;
  };
  driver.get_eof = [](const H5FD_t* face, H5FD_mem_t) { return static_cast<const Face*>(face)->disk->end_; };
  driver.read = [](H5FD_t* face, H5FD_mem_t, hid_t, haddr_t at, std::size_t size, void* bytes) -> herr_t {
    static_cast<Face*>(face)->disk->read(at, size, static_cast<std::byte*>(bytes));
    return 0;
  };
  driver.write = [](H5FD_t* face, H5FD_mem_t type, hid_t, haddr_t at, std::size_t size, const void* bytes) -> herr_t {
    static_cast<Face*>(face)->disk->write(at, size, static_cast<const std::byte*>(bytes), type == H5FD_MEM_DRAW);
    return 0;
  };
  driver.truncate = [](H5FD_t* face, hid_t, hbool_t) -> herr_t {
    static_cast<Face*>(face)->disk->resize(static_cast<Face*>(face)->disk->allocated_);
    return 0;
  };
  return driver;
}

hid_t H5Disk::access() {
  static const H5FD_class_t kDriver = driver();
  const hid_t id = H5FDregister(&kDriver), list = H5Pcreate(H5P_FILE_ACCESS);
  H5Disk* const self = this;
  const bool set = id >= 0 && list >= 0 && H5Pset_driver(list, id, &self) >= 0;
  if (id >= 0) H5FDunregister(id);  // the list holds it
  if (list < 0 || set) return list;
  H5Pclose(list);
  return H5I_INVALID_HID;
}

}  // namespace linden
