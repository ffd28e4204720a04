// engine/scene/number_table.hpp
// Numbers from a CSV file: a line a row, commas between, all rows as wide as the first. Empty lines and lines that begin with #
// are passed over; a first line that holds no number is a header. A byte order mark before it all is no part of it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace linden {

struct NumberTable {
  std::vector<std::vector<double>> rows;
  std::vector<int> lines;  // of each row in the file
};

/// A file with as many columns, any number from `least_columns` up where `columns` is 0. Throws InputError: `file:line: what was
/// found; what was expected; what to do`.
NumberTable read_numbers(const std::string& file, std::size_t columns, std::size_t least_columns = 1);

}  // namespace linden
