// Plain readers of .npz and .h5, through the libraries of their formats.
#pragma once

#include <hdf5.h>
#include <zip.h>

#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace linden {

struct Array {
  std::string type;  // as NumPy has it: <f8, <f4, |u1; "words" for strings
  std::vector<std::int64_t> shape;
  std::string bytes;
  std::vector<std::string> words;
};
using Arrays = std::map<std::string, Array>;

inline std::string between(const std::string& text, const std::string& before, char after) {
  const std::size_t begin = text.find(before);
  REQUIRE(begin != text.npos);
  const std::size_t from = begin + before.size();
  return text.substr(from, text.find(after, from) - from);
}

inline std::string utf8(char32_t point) {
  if (point == 0) return "";
  if (point < 0x80) return {static_cast<char>(point)};
  if (point < 0x800) return {static_cast<char>(0xc0 | point >> 6), static_cast<char>(0x80 | (point & 0x3f))};
  return {static_cast<char>(0xe0 | point >> 12), static_cast<char>(0x80 | (point >> 6 & 0x3f)), static_cast<char>(0x80 | (point & 0x3f))};
}

inline Array npy(const std::string& file) {
  REQUIRE(file.substr(0, 8) == std::string("\x93NUMPY\1\0", 8));
  const std::size_t length = static_cast<unsigned char>(file[8]) + 256u * static_cast<unsigned char>(file[9]);
  REQUIRE((10 + length) % 64 == 0);
  const std::string header = file.substr(10, length);
  REQUIRE(header.back() == '\n');
  REQUIRE_THAT(header, Catch::Matchers::Contains("'fortran_order': False"));
  Array array{.type = between(header, "'descr': '", '\''), .shape = {}, .bytes = file.substr(10 + length), .words = {}};
  std::istringstream sizes(between(header, "'shape': (", ')'));
  for (std::string size; std::getline(sizes, size, ',');) array.shape.push_back(std::stoll(size));
  if (array.type.starts_with("<U")) {
    const std::size_t width = 4 * std::stoul(array.type.substr(2));
    array.type = "words";
    for (std::size_t at = 0; at < array.bytes.size(); at += width) {
      std::string& word = array.words.emplace_back();
      for (std::size_t k = at; k < at + width; k += 4) {
        char32_t point = 0;
        std::memcpy(&point, array.bytes.data() + k, 4);
        word += utf8(point);
      }
    }
  }
  return array;
}

inline Arrays read_npz(const std::string& file) {
  const std::unique_ptr<zip_t, void (*)(zip_t*)> zip(zip_open(file.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, nullptr), zip_discard);
  REQUIRE(zip);
  Arrays arrays;
  for (zip_uint64_t k = 0; k < static_cast<zip_uint64_t>(zip_get_num_entries(zip.get(), 0)); ++k) {
    zip_stat_t entry;
    REQUIRE(zip_stat_index(zip.get(), k, 0, &entry) == 0);
    CHECK(entry.comp_method == ZIP_CM_STORE);
    const std::string name = entry.name;
    REQUIRE_THAT(name, Catch::Matchers::EndsWith(".npy"));
    std::string bytes(entry.size, '\0');
    zip_file_t* const in = zip_fopen_index(zip.get(), k, 0);
    REQUIRE(in);
    CHECK(zip_fread(in, bytes.data(), bytes.size()) == static_cast<zip_int64_t>(bytes.size()));  // checks the sum too
    CHECK(zip_fclose(in) == 0);
    arrays[name.substr(0, name.size() - 4)] = npy(bytes);
  }
  return arrays;
}

struct Dataset {
  Dataset(hid_t file, const std::string& name) : id(H5Dopen2(file, name.c_str(), H5P_DEFAULT)) {
    type = H5Dget_type(id), space = H5Dget_space(id), creation = H5Dget_create_plist(id);
    shape.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    H5Sget_simple_extent_dims(space, shape.data(), nullptr);
  }
  ~Dataset() { H5Pclose(creation), H5Sclose(space), H5Tclose(type), H5Dclose(id); }
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;

  hid_t id, type, space, creation;
  std::vector<hsize_t> shape;
};

struct H5Reader {
  explicit H5Reader(const std::string& name) : file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT)) { REQUIRE(file >= 0); }
  ~H5Reader() { H5Fclose(file); }
  H5Reader(const H5Reader&) = delete;
  H5Reader& operator=(const H5Reader&) = delete;
  hid_t file;
};

inline Arrays read_h5(const std::string& file) {
  const H5Reader reader(file);
  std::vector<std::string> names;
  const auto note = [](hid_t, const char* name, const H5L_info_t*, void* into) -> herr_t {
    static_cast<std::vector<std::string>*>(into)->push_back(name);
    return 0;
  };
  REQUIRE(H5Literate(reader.file, H5_INDEX_NAME, H5_ITER_INC, nullptr, note, &names) >= 0);
  Arrays arrays;
  for (const std::string& name : names) {
    const Dataset dataset(reader.file, name);
    Array& array = arrays[name];
    array.shape.assign(dataset.shape.begin(), dataset.shape.end());
    const std::size_t width = H5Tget_size(dataset.type);
    array.bytes.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(dataset.space)) * width);
    REQUIRE(H5Dread(dataset.id, dataset.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.bytes.data()) >= 0);
    if (H5Tequal(dataset.type, H5T_IEEE_F64LE) > 0) array.type = "<f8";
    if (H5Tequal(dataset.type, H5T_IEEE_F32LE) > 0) array.type = "<f4";
    if (H5Tequal(dataset.type, H5T_STD_U8LE) > 0) array.type = "|u1";
    if (H5Tget_class(dataset.type) == H5T_STRING) {
      array.type = "words";
      CHECK(H5Tget_cset(dataset.type) == H5T_CSET_UTF8);
      for (std::size_t at = 0; at < array.bytes.size(); at += width) array.words.emplace_back(array.bytes.substr(at, width).c_str());
    }
  }
  return arrays;
}

inline Arrays read(const std::string& file) { return file.ends_with(".npz") ? read_npz(file) : read_h5(file); }

}  // namespace linden
