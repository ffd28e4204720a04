// A table of numbers has rows of one length, all finite, or is refused.
#include <algorithm>
#include <cmath>

#include "engine/scene/number_table.hpp"
#include "tests/fuzz/input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace linden;
  static const ScratchFolder folder(input_folder());
  folder.write("numbers.csv", text_of(data, size));
  for (const std::size_t columns : {std::size_t{0}, std::size_t{2}}) {
    read_or_refuse([&] {
      const NumberTable table = read_numbers(folder.file("numbers.csv"), columns);
      require(!table.rows.empty() && table.lines.size() == table.rows.size(), "a table without rows");
      for (const std::vector<double>& row : table.rows) {
        require(row.size() == (columns > 0 ? columns : table.rows.front().size()), "a row of another length");
        require(std::ranges::all_of(row, [](double value) { return std::isfinite(value); }), "a number in a table");
      }
    });
  }
  return 0;
}
