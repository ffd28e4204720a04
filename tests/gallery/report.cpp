#include "tests/gallery/report.hpp"

#include <algorithm>

namespace linden {

bool Report::kept() const { return !promises_.empty() && std::ranges::all_of(promises_, &Promise::kept); }

}  // namespace linden
