// The .npy format, version 1.0: "\x93NUMPY", 1, 0, length of what follows (uint16, little endian), a Python dictionary of type, order and
// shape, padded with blanks to 64 bytes, then the numbers. Source: numpy.lib.format. Room is kept for the most rows there can be.
#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <limits>
#include <numeric>
#include <string_view>
#include <utility>

#include "engine/files/array_file.hpp"
#include "engine/files/growing_file.hpp"
#include "engine/files/held_room.hpp"
#include "engine/files/temporary_folder.hpp"

namespace linden {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory, their types say little endian");

constexpr std::uint16_t kFirstDay = 1 << 5 | 1;  // 1 January 1980, the first date a zip can hold: numpy.savez writes it too

struct DiscardZip {
  void operator()(zip_t* zip) const { zip_discard(zip); }
};

std::string npy_header(std::string_view type, std::int64_t rows, const std::vector<std::int64_t>& row) {
  const auto dictionary = [&](std::int64_t first) {
    const std::string rest = row.empty() ? "" : fmt::format(" {}", fmt::join(row, ", "));
    return fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({},{}), }}", type, first, rest);
  };
  constexpr std::size_t kBefore = 10, kUnit = 64;
  const std::size_t longest = kBefore + dictionary(std::numeric_limits<std::int64_t>::max()).size() + 1;
  const std::size_t length = (longest + kUnit - 1) / kUnit * kUnit - kBefore;
  std::string header("\x93NUMPY\1\0", 8);
  header += {static_cast<char>(length & 0xff), static_cast<char>(length >> 8)};
  return header + fmt::format("{:<{}}\n", dictionary(rows), length - 1);
}

/// Bytes that are no UTF-8 become U+FFFD.
std::u32string code_points(std::string_view utf8) {
  constexpr char32_t kReplacement = 0xfffd, kLast = 0x10ffff;
  constexpr char32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};  // that takes so many bytes
  std::u32string points;
  while (!utf8.empty()) {
    const auto first = static_cast<unsigned char>(utf8[0]);
    const int ones = std::countl_one(first);
    const std::size_t length = ones == 0 ? 1 : static_cast<std::size_t>(ones);
    char32_t point = ones == 0 ? first : first & (0x7fu >> ones);
    bool good = ones != 1 && length <= 4 && length <= utf8.size();
    for (std::size_t k = 1; good && k < length; ++k) {
      const auto next = static_cast<unsigned char>(utf8[k]);
      good = next >> 6 == 2;
      point = point << 6 | (next & 0x3fu);
    }
    good = good && point >= kSmallest[length] && point <= kLast && point >> 11 != 0x1b;  // 0xd800 to 0xdfff are halves of characters
    points.push_back(good ? point : kReplacement);
    utf8.remove_prefix(good ? length : 1);
  }
  return points;
}

class NpzFile final : public ArrayFile {
 public:
  explicit NpzFile(const std::string& file) : folder_(file), held_(folder_.file("room")) {}

  void add_numbers(const std::string& name, ElementType type, std::vector<std::int64_t> row, std::vector<std::string>) override {
    constexpr std::pair<const char*, std::int64_t> kTypes[] = {{"<f4", 4}, {"<f8", 8}, {"|u1", 1}};
    const auto [code, size] = kTypes[static_cast<std::size_t>(type)];
    const std::int64_t bytes = std::accumulate(row.begin(), row.end(), size, std::multiplies<>());
    numbers_.push_back(arrays_.size());
    begin(name, code, std::move(row), static_cast<std::size_t>(bytes));
  }

  void add_fixed(const std::string& name, std::vector<std::int64_t> shape, std::span<const double> numbers) override {
    const std::int64_t rows = shape.front();
    shape.erase(shape.begin());
    const std::int64_t bytes = std::accumulate(shape.begin(), shape.end(), static_cast<std::int64_t>(sizeof(double)), std::multiplies<>());
    Array& array = begin(name, "<f8", std::move(shape), static_cast<std::size_t>(bytes));
    array.out.append({reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()});
    array.rows = rows;
  }

  void add_words(const std::string& name, std::span<const std::string> words) override {
    std::vector<std::u32string> decoded(words.size());
    std::ranges::transform(words, decoded.begin(), code_points);
    std::size_t longest = 1;
    for (const std::u32string& word : decoded) longest = std::max(longest, word.size());
    Array& array = begin(name, fmt::format("<U{}", longest), {}, longest * sizeof(char32_t));
    for (std::u32string& word : decoded) {
      word.resize(longest);
      array.out.append({reinterpret_cast<const char*>(word.data()), array.row_bytes});
    }
    array.rows = static_cast<std::int64_t>(words.size());
  }

  void append(std::span<const void* const> rows) override {
    hold_room(rows_ + 1);
    try {
      for (std::size_t k = 0; k < rows.size(); ++k) arrays_[numbers_[k]].out.append({static_cast<const char*>(rows[k]), arrays_[numbers_[k]].row_bytes});
    } catch (...) {
      keep_whole_rows();
      throw;
    }
    rows_ += 1;
  }

  std::int64_t rows() const override { return rows_; }

  void commit() override {
    held_.release();
    for (const std::size_t k : numbers_) arrays_[k].rows = rows_;
    const std::int64_t all = std::exchange(rows_, 0);
    for (Array& array : arrays_) {
      array.out.rewrite(array.header());
      array.out.flush();
    }
    assemble();
    folder_.publish(kWhole);
    rows_ = all;
  }

 private:
  struct Array {
    std::string name, type;
    std::vector<std::int64_t> row;  // shape
    std::size_t row_bytes;
    GrowingFile out;
    std::int64_t rows = 0;

    std::string file() const { return name + ".npy"; }
    std::string header() const { return npy_header(type, rows, row); }
  };
  static constexpr const char* kWhole = "whole.npz";

  Array& begin(const std::string& name, std::string type, std::vector<std::int64_t> row, std::size_t row_bytes) {
    GrowingFile out(folder_.file(name + ".npy"), folder_.target());
    Array& array = arrays_.emplace_back(Array{name, std::move(type), std::move(row), row_bytes, std::move(out)});
    array.out.append(array.header());
    return array;
  }

  /// Room for the packed file with so many rows, and for what is still to be written of its parts.
  void hold_room(std::int64_t rows) {
    constexpr std::size_t kOfEntry = 512;  // of a zip, at most: its headers and its name twice
    std::size_t bytes = kOfEntry;
    for (const Array& array : arrays_) bytes += kOfEntry + 2 * array.out.buffered() + array.header().size() + static_cast<std::size_t>(array.rows) * array.row_bytes;
    for (const std::size_t k : numbers_) bytes += (static_cast<std::size_t>(rows) - static_cast<std::size_t>(arrays_[k].rows)) * arrays_[k].row_bytes;
    if (const int error = held_.grow(bytes)) cannot_be_written(folder_.target(), error);
  }

  /// Where the disk was full although room was held: the rows that every array has.
  void keep_whole_rows() {
    held_.release();
    for (const std::size_t k : numbers_) {
      arrays_[k].out.settle();
      rows_ = std::min(rows_, arrays_[k].out.records() - 1);
    }
    for (const std::size_t k : numbers_) {
      arrays_[k].out.cut(static_cast<std::int64_t>(arrays_[k].header().size() + static_cast<std::size_t>(rows_) * arrays_[k].row_bytes), rows_ + 1);
    }
  }

  void assemble() {
    int code = 0;
    std::unique_ptr<zip_t, DiscardZip> zip(zip_open(folder_.file(kWhole).c_str(), ZIP_CREATE | ZIP_EXCL, &code));
    if (!zip) {
      zip_error_t error;
      zip_error_init_with_code(&error, code);
      fail(error);
    }
    for (const Array& array : arrays_) {
      zip_source_t* const source = zip_source_file(zip.get(), folder_.file(array.file()).c_str(), 0, -1);
      if (!source) fail(*zip_get_error(zip.get()));
      const zip_int64_t added = zip_file_add(zip.get(), array.file().c_str(), source, 0);
      if (added < 0) {
        zip_source_free(source);
        fail(*zip_get_error(zip.get()));
      }
      const auto entry = static_cast<zip_uint64_t>(added);
      if (zip_set_file_compression(zip.get(), entry, ZIP_CM_STORE, 0) != 0 ||
          zip_file_set_dostime(zip.get(), entry, 0, kFirstDay, 0) != 0) {
        fail(*zip_get_error(zip.get()));
      }
    }
    if (zip_close(zip.get()) != 0) fail(*zip_get_error(zip.get()));
    static_cast<void>(zip.release());
  }

  [[noreturn]] void fail(zip_error_t& error) const {
    const int system = zip_error_system_type(&error) == ZIP_ET_SYS ? zip_error_code_system(&error) : 0;
    if (system != 0) cannot_be_written(folder_.target(), system);
    cannot_be_written(folder_.target(), zip_error_strerror(&error));
  }

  TemporaryFolder folder_;
  HeldRoom held_;
  std::vector<Array> arrays_;
  std::vector<std::size_t> numbers_;  // places in arrays_ of those that grow
  std::int64_t rows_ = 0;             // that they all have
};

}  // namespace

std::unique_ptr<ArrayFile> npz_file(const std::string& file) { return std::make_unique<NpzFile>(file); }

}  // namespace linden
