#include "engine/files/h5_chunks.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstring>

namespace linden {
namespace {

// Every chunk takes a place in an index and a trip to the disk, and is read whole even where a part is asked for.
constexpr hsize_t kRows = 16, kChunkBytes = 1 << 17, kSmallestChunk = 1 << 16, kLargestChunk = 1 << 21;
constexpr hsize_t kMostBuffered = 1 << 24;  // bytes of the rows that wait for their chunk to be full
constexpr int kLevel = 1;                   // of deflate: higher ones take twice the time for a hundredth less of such numbers

hsize_t divided(hsize_t number, hsize_t by) { return (number + by - 1) / by; }
/// The largest part of `whole` that is no larger than `most`, cut into equal ones.
hsize_t even_part(hsize_t whole, hsize_t most) {
  return whole == 0 ? 1 : divided(whole, divided(whole, std::clamp<hsize_t>(most, 1, whole)));
}

/// HDF5's shuffle: of all numbers the first byte, then of all the second, ...
std::string shuffled(const std::string& bytes, std::size_t element) {
  if (element == 1) return bytes;
  const std::size_t count = bytes.size() / element;
  std::string out(bytes.size(), '\0');
  for (std::size_t byte = 0; byte < element; ++byte) {
    char* to = out.data() + byte * count;
    for (std::size_t k = 0; k < count; ++k) to[k] = bytes[k * element + byte];
  }
  return out;
}

/// Empty where it would be no shorter.
std::string deflated(const std::string& bytes) {
  std::string out(bytes.size() - 1, '\0');
  uLongf size = out.size();
  const int done = compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), kLevel);
  out.resize(done == Z_OK ? size : 0);
  return out;
}

}  // namespace

H5Chunks::H5Chunks(std::span<const hsize_t> row, std::size_t element) : row_{1, 1, 1}, chunk_{1, 1, 1}, axes_(row.size() + 1), element_(element) {
  for (std::size_t axis = 0; axis < row.size(); ++axis) row_[axis + 1] = row[axis];
  const hsize_t of_row = std::max<hsize_t>(row_bytes(), 1), of_instance = std::max<hsize_t>(row_[2] * element, 1);
  chunk_[0] = std::max(kRows, divided(kSmallestChunk, of_row));
  chunk_[0] = std::max<hsize_t>(1, std::min({chunk_[0], kMostBuffered / of_row, kLargestChunk / of_instance}));
  chunk_[1] = even_part(row_[1], kChunkBytes / (chunk_[0] * of_instance));
  chunk_[2] = even_part(row_[2], kLargestChunk / (chunk_[0] * chunk_[1] * element));
}

std::vector<hsize_t> H5Chunks::sizes() const { return {chunk_.begin(), chunk_.begin() + static_cast<std::ptrdiff_t>(axes_)}; }

std::size_t H5Chunks::room(std::size_t rows) const {
  constexpr std::size_t kOfStructure = 1 << 14, kOfChunk = 256;  // an index, its nodes half full
  const std::size_t numbers = rows * chunk_bytes() / static_cast<std::size_t>(chunk_[0]) * beside();
  // rows that fill no chunk are packed, which makes numbers that cannot be packed a few hundredths longer
  return numbers + (rows < chunk_[0] ? numbers / 16 : 0) + beside() * kOfChunk + kOfStructure;
}

H5Chunks::Chunk H5Chunks::chunk(std::size_t k, std::span<const std::byte> block, hsize_t first, bool packed) const {
  const std::array<hsize_t, 3> place{first, k / parts(2) * chunk_[1], k % parts(2) * chunk_[2]};
  const std::size_t rows = block.size() / row_bytes();
  const hsize_t instances = std::min(chunk_[1], row_[1] - place[1]), columns = std::min(chunk_[2], row_[2] - place[2]);
  Chunk chunk{{place.begin(), place.begin() + static_cast<std::ptrdiff_t>(axes_)}, 3, std::string(chunk_bytes(), '\0')};
  for (std::size_t row = 0; row < rows; ++row) {
    const bool together = chunk_[2] == row_[2];  // the instances of a row lie together in both
    for (hsize_t i = 0; i < (together ? 1 : instances); ++i) {
      const hsize_t from = (row * row_[1] + place[1] + i) * row_[2] + place[2], to = (row * chunk_[1] + i) * chunk_[2];
      std::memcpy(chunk.bytes.data() + to * element_, block.data() + from * element_, columns * element_ * (together ? instances : 1));
    }
  }
  if (!packed && rows == chunk_[0]) return chunk;
  if (std::string shorter = deflated(shuffled(chunk.bytes, element_)); !shorter.empty()) {
    chunk.bytes = std::move(shorter);
    chunk.skipped = 0;
  }
  return chunk;
}

}  // namespace linden
