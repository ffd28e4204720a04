// tests/gallery/table.hpp
// The gallery as a table: for people, for the documentation, for spreadsheets.
#pragma once

#include <string>
#include <vector>

#include "tests/gallery/report.hpp"

namespace linden {

struct Shown {
  const Case* shown;
  Report report;
  double seconds;
};

/// One case, as it is printed when it is done.
std::string text_of(const Shown& shown);

/// Case, what is hard, what is promised, what was measured; a column for each other engine that was there. Below: what first
/// failed. Notes are left to the text.
std::string markdown_of(const std::vector<Shown>& gallery);

/// A row a promise: case,what,measured,relation,bound,kept,reason; and a row for each other engine.
std::string csv_of(const std::vector<Shown>& gallery);

}  // namespace linden
