#include "engine/files/recorded_arrays.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "engine/files/rollout_file.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/generators.hpp"
#include "tests/engine/folder.hpp"

namespace linden::recorded_arrays_test {
namespace {

void write(const std::string& file, const Names& names, std::int64_t instances) {
  RolloutFile<double> out(file, names, instances);
  const std::size_t nq = names.position.size(), nv = names.velocity.size();
  for (int frame = 0; frame < 3; ++frame) {
    std::vector<double> q, v;
    for (std::size_t k = 0; k < nq * static_cast<std::size_t>(instances); ++k) q.push_back(frame + 0.1 * static_cast<double>(k) + 1e-13);
    for (std::size_t k = 0; k < nv * static_cast<std::size_t>(instances); ++k) v.push_back(-static_cast<double>(k));
    out.add(0.25 * frame, q, v, std::vector<double>(static_cast<std::size_t>(instances), 5.0),
            std::vector<std::uint8_t>(static_cast<std::size_t>(instances)));
  }
  out.commit();
}

TEST_CASE("a recording is read back to the bit, whatever its format") {
  const Model model = chain(4);
  for (const char* const ending : {".npz", ".h5"}) {
    const Folder folder;
    const std::string file = folder.file(std::string("recorded") + ending);
    write(file, model.names, 2);
    const RecordedArrays arrays = read_recording(file);
    INFO(ending);
    CHECK(arrays.numbers.at("time").numbers == std::vector<double>{0, 0.25, 0.5});
    CHECK(arrays.numbers.at("q").shape == std::vector<std::int64_t>{3, 2, 4});
    CHECK(arrays.numbers.at("q").numbers[8 + 4 + 2] == 1 + 0.1 * 6 + 1e-13);
    CHECK(arrays.numbers.at("v").numbers[7] == -7);
    CHECK(arrays.numbers.at("status").numbers[0] == 0);
    CHECK(arrays.words.at("positions") == model.names.position);
  }
  const Folder folder;
  const std::string table = folder.file("recorded.csv");
  write(table, model.names, 1);
  const RecordedArrays arrays = read_recording(table);
  CHECK(arrays.numbers.at("time").numbers == std::vector<double>{0, 0.25, 0.5});
  const auto& columns = arrays.words.at("positions");
  const auto at = static_cast<std::size_t>(std::ranges::find(columns, model.names.position[2]) - columns.begin());
  REQUIRE(at < columns.size());
  CHECK(arrays.numbers.at("q").numbers[columns.size() + at] == 1 + 0.1 * 2 + 1e-13);
}

TEST_CASE("names with commas, quotes and other letters are read back") {
  Model model = chain(2);
  model.names.position = {"a,\"b\"", "\u00e4\u6f22"};
  for (const char* const ending : {".npz", ".h5", ".csv"}) {
    const Folder folder;
    const std::string file = folder.file(std::string("names") + ending);
    write(file, model.names, 1);
    const auto words = read_recording(file).words.at("positions");
    INFO(ending);
    CHECK(std::ranges::find(words, "a,\"b\"") != words.end());
    CHECK(std::ranges::find(words, "\u00e4\u6f22") != words.end());
  }
}

TEST_CASE("what is no recording is refused by name") {
  CHECK_THROWS_WITH(read_recording("nowhere.npz"), Catch::Contains("nowhere.npz"));
  CHECK_THROWS_WITH(read_recording("nowhere.h5"), Catch::Contains("nowhere.h5"));
  for (const char* const ending : {".npz", ".h5", ".csv"}) {
    const Folder folder;
    const std::string file = folder.file(std::string("noise") + ending);
    std::ofstream(file) << "this is text,\nand no recording";
    INFO(ending);
    CHECK_THROWS_AS(read_recording(file), InputError);
    CHECK_THROWS_WITH(read_recording(file), Catch::Contains(file));
  }
  const Folder folder;
  const std::string table = folder.file("cells.csv");
  std::ofstream(table) << "time,a\n0,1\n1,x\n";
  CHECK_THROWS_WITH(read_recording(table), Catch::Contains(":3:") && Catch::Contains("x"));
  std::ofstream(table) << "time,a\n0,1\n1\n";
  CHECK_THROWS_WITH(read_recording(table), Catch::Contains(":3:") && Catch::Contains("1 cells"));
}

TEST_CASE("a recording that is cut or changed is read or refused, and never more than it is") {
  const Model model = chain(4);
  for (const char* const ending : {".npz", ".h5"}) {
    const Folder folder;
    const std::string whole = folder.file(std::string("whole") + ending), part = folder.file(std::string("part") + ending);
    write(whole, model.names, 2);
    std::ifstream in(whole, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    for (std::size_t k = 0; k < 200; ++k) {
      std::string changed = k % 2 == 0 ? bytes.substr(0, bytes.size() * k / 200) : bytes;
      if (k % 2 == 1) changed[bytes.size() * k / 200] = static_cast<char>(changed[bytes.size() * k / 200] ^ (1 << k % 8));
      std::ofstream(part, std::ios::binary | std::ios::trunc) << changed;
      try {
        (void)read_recording(part);
      } catch (const InputError&) {
      }
    }
    SUCCEED();
  }
}

}  // namespace
}  // namespace linden::recorded_arrays_test
