// engine/files/h5_chunks.hpp
// How the numbers of an array [rows, N, ...] lie in the chunks of an HDF5 file, so that both are quick to read: all rows of one instance, and all
// instances of one row.
//
//   shape    about 16 rows of so many instances that it makes 128 KiB (what that is good for: engine/files/README.md)
//   bytes    as they are, or packed by the filters that every HDF5 has, shuffle and deflate. Each chunk tells which; the last rows, which
//            fill no chunk, are always packed, so that they take no more room than they have
#pragma once

#include <hdf5.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace linden {

/// Of an array [rows, N, columns], [rows, N] or [rows], of which those axes that there are not are 1.
class H5Chunks {
 public:
  /// row: sizes of the axes after the first, at most two; element: bytes of a number.
  H5Chunks(std::span<const hsize_t> row, std::size_t element);

  /// Sizes of a chunk, as many axes as the array has.
  std::vector<hsize_t> sizes() const;
  hsize_t rows() const { return chunk_[0]; }
  /// Chunks that lie side by side in the same rows.
  std::size_t beside() const { return static_cast<std::size_t>(parts(1) * parts(2)); }
  std::size_t row_bytes() const { return static_cast<std::size_t>(row_[1] * row_[2]) * element_; }
  /// Bytes on the disk that so many rows of all these chunks take at most.
  std::size_t room(std::size_t rows) const;

  /// What is written of the k-th of them.
  struct Chunk {
    std::vector<hsize_t> place;  // of its first number, in the array
    std::uint32_t skipped;       // filters that it has not gone through, a bit each
    std::string bytes;
  };
  /// block: the first so many rows of these chunks, as they lie in the array; first: which row of the array the first is.
  Chunk chunk(std::size_t k, std::span<const std::byte> block, hsize_t first, bool packed) const;

 private:
  hsize_t parts(std::size_t axis) const { return (row_[axis] + chunk_[axis] - 1) / chunk_[axis]; }
  std::size_t chunk_bytes() const { return static_cast<std::size_t>(chunk_[0] * chunk_[1] * chunk_[2]) * element_; }

  std::array<hsize_t, 3> row_, chunk_;  // row_[0] is not used
  std::size_t axes_, element_;
};

}  // namespace linden
