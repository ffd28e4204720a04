// The .npy format: see engine/files/npz_file.cpp. Its dictionary is Python, of which three keys are read.
#include <fmt/format.h>
#include <zip.h>

#include <charconv>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>

#include "engine/files/array_readers.hpp"
#include "engine/scene/load_model.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

struct CloseZip {
  void operator()(zip_t* zip) const { zip_discard(zip); }
};
struct CloseEntry {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw InputError(fmt::format("{}: {}; expected a .npz file that linden or NumPy wrote", file, what));
}

struct Npy {
  std::string type;
  std::vector<std::int64_t> shape;
  std::string_view data;
};

/// What stands behind 'key': in the dictionary.
std::string_view value_of(std::string_view dictionary, std::string_view key) {
  const std::string quoted_key = fmt::format("'{}':", key);
  const std::size_t at = dictionary.find(quoted_key);
  if (at == dictionary.npos) return "";
  std::string_view rest = dictionary.substr(at + quoted_key.size());
  while (rest.starts_with(' ')) rest.remove_prefix(1);
  return rest;
}

std::optional<Npy> npy_of(std::string_view bytes) {
  if (bytes.size() < 12 || !bytes.starts_with("\x93NUMPY")) return std::nullopt;
  const auto byte = [&](std::size_t at) { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[at])); };
  const bool first_version = bytes[6] == 1;
  const std::size_t begin = first_version ? 10 : 12;
  const std::size_t length = byte(8) | byte(9) << 8 | (first_version ? 0 : byte(10) << 16 | byte(11) << 24);
  if (length > bytes.size() - begin) return std::nullopt;
  const std::string_view dictionary = bytes.substr(begin, length);
  Npy npy;
  npy.data = bytes.substr(begin + length);
  std::string_view type = value_of(dictionary, "descr"), shape = value_of(dictionary, "shape");
  if (!type.starts_with('\'') || !shape.starts_with('(') || !value_of(dictionary, "fortran_order").starts_with("False")) return std::nullopt;
  type.remove_prefix(1);
  npy.type = type.substr(0, type.find('\''));
  shape = shape.substr(1, shape.find(')') - 1);
  while (true) {
    while (shape.starts_with(' ') || shape.starts_with(',')) shape.remove_prefix(1);
    if (shape.empty()) return npy;
    std::int64_t size = 0;
    const auto [rest, error] = std::from_chars(shape.data(), shape.data() + shape.size(), size);
    if (error != std::errc{}) return std::nullopt;
    npy.shape.push_back(size);
    shape.remove_prefix(static_cast<std::size_t>(rest - shape.data()));
  }
}

template <class T>
std::vector<double> numbers_of(std::string_view data, std::size_t count) {
  std::vector<double> numbers(count);
  for (std::size_t k = 0; k < count; ++k) {
    T number;
    std::memcpy(&number, data.data() + k * sizeof(T), sizeof(T));
    numbers[k] = static_cast<double>(number);
  }
  return numbers;
}

/// A code point as UTF-8.
void append_utf8(std::uint32_t point, std::string& text) {
  if (point < 0x80) {
    text += static_cast<char>(point);
  } else if (point < 0x800) {
    text += {static_cast<char>(0xc0 | point >> 6), static_cast<char>(0x80 | (point & 63))};
  } else if (point < 0x10000) {
    text += {static_cast<char>(0xe0 | point >> 12), static_cast<char>(0x80 | (point >> 6 & 63)), static_cast<char>(0x80 | (point & 63))};
  } else {
    text += {static_cast<char>(0xf0 | (point >> 18 & 7)), static_cast<char>(0x80 | (point >> 12 & 63)),
             static_cast<char>(0x80 | (point >> 6 & 63)), static_cast<char>(0x80 | (point & 63))};
  }
}

std::vector<std::string> words_of(std::string_view data, std::size_t count, std::size_t longest) {
  std::vector<std::string> words(count);
  for (std::size_t k = 0; k < count * longest; ++k) {
    std::uint32_t point;
    std::memcpy(&point, data.data() + k * sizeof(point), sizeof(point));
    if (point != 0) append_utf8(point, words[k / longest]);
  }
  return words;
}

/// Takes one array, if it is of a kind that is read.
void add(const std::string& file, const std::string& name, std::string_view bytes, RecordedArrays& arrays) {
  const std::optional<Npy> npy = npy_of(bytes);
  if (!npy) fail(file, fmt::format("{} is no array in C order", quoted(name)));
  const std::size_t count = count_of(file, name, npy->shape);
  const auto require_bytes = [&](std::size_t each) {
    if (npy->data.size() / each < count) fail(file, fmt::format("{} has {} bytes for {} numbers", quoted(name), npy->data.size(), count));
  };
  const auto take = [&]<class T>(T) {
    require_bytes(sizeof(T));
    arrays.numbers[name] = {npy->shape, numbers_of<T>(npy->data, count)};
  };
  const std::string& type = npy->type;
  if (type == "<f8") return take(double{});
  if (type == "<f4") return take(float{});
  if (type == "|u1") return take(std::uint8_t{});
  if (type == "<i8") return take(std::int64_t{});
  if (type == "<i4") return take(std::int32_t{});
  if (!type.starts_with("<U")) {
    arrays.unread[name] = type;
    return;
  }
  std::size_t longest = 0;
  std::from_chars(type.data() + 2, type.data() + type.size(), longest);
  if (longest == 0 || longest > npy->data.size() || count > npy->data.size() / (4 * longest)) {
    fail(file, fmt::format("{} has {} bytes for {} words", quoted(name), npy->data.size(), count));
  }
  arrays.words[name] = words_of(npy->data, count, longest);
}

}  // namespace

RecordedArrays npz_arrays(const std::string& file) {
  (void)open_to_read(file);  // is told to those who must not write over it
  int error = 0;
  const std::unique_ptr<zip_t, CloseZip> zip(zip_open(file.c_str(), ZIP_RDONLY, &error));
  if (!zip) {
    zip_error_t text;
    zip_error_init_with_code(&text, error);
    const std::string reason = zip_error_strerror(&text);
    zip_error_fini(&text);
    fail(file, reason);
  }
  RecordedArrays arrays;
  const auto entries = zip_get_num_entries(zip.get(), 0);
  for (zip_int64_t k = 0; k < entries; ++k) {
    zip_stat_t about;
    const auto index = static_cast<zip_uint64_t>(k);
    if (zip_stat_index(zip.get(), index, 0, &about) != 0) fail(file, "an entry of the archive is damaged");
    std::string name = about.name;
    if (!name.ends_with(".npy")) continue;
    name.resize(name.size() - 4);
    require_memory(fmt::format("{}: {}", file, quoted(name)), 3 * static_cast<double>(about.size));
    std::string bytes(about.size, '\0');
    const std::unique_ptr<zip_file_t, CloseEntry> entry(zip_fopen_index(zip.get(), index, 0));
    if (!entry || zip_fread(entry.get(), bytes.data(), about.size) != static_cast<zip_int64_t>(about.size)) {
      fail(file, fmt::format("{} is damaged", quoted(name)));
    }
    add(file, name, bytes, arrays);
  }
  return arrays;
}

std::size_t count_of(const std::string& file, const std::string& name, const std::vector<std::int64_t>& shape) {
  double count = 1;
  for (const std::int64_t size : shape) {
    if (size < 0) throw InputError(fmt::format("{}: {} has a negative size; expected none", file, quoted(name)));
    count *= static_cast<double>(size);
  }
  require_memory(fmt::format("{}: {}", file, quoted(name)), count * sizeof(double));
  return static_cast<std::size_t>(count);
}

}  // namespace linden
