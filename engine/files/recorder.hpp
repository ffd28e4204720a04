// engine/files/recorder.hpp
// The motion as a table: FILE.csv with the columns time, energy and one a coordinate, named as in Names::position.
//
// Numbers have 17 significant digits: they read back to the same doubles. A name that holds a comma or a quote is quoted (RFC 4180).
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/files/output_file.hpp"
#include "layout/names.hpp"

namespace linden {

/// No two are alike: a name that another column had before, such as that of a joint "time", is followed by _2, or by _3 and so on where
/// there is a column called that.
std::vector<std::string> recorded_columns(const Names& names);

class Recorder {
 public:
  /// Writes the header. Throws std::runtime_error, as do add and commit, where the file cannot be written.
  Recorder(const std::string& file, const Names& names);

  /// Where that fails the rows before stay, whole, and nothing can be added.
  void add(double time, double energy, std::span<const double> positions);
  /// Until then there is no file of that name. Where the last rows do not fit the others are put in place before it throws.
  void commit();

  /// That are kept.
  std::int64_t rows() const { return out_.records() - 1; }

 private:
  OutputFile out_;
  fmt::memory_buffer text_;
};

}  // namespace linden
