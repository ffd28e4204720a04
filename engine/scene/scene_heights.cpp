#include "engine/scene/scene_heights.hpp"

#include <fmt/format.h>

#include <vector>

#include "engine/scene/number_table.hpp"
#include "engine/scene/scene_time_table.hpp"

namespace linden {

HeightField read_heights(const SceneValue& at, const std::string& folder) {
  const auto file = at.find("file"), spacing = at.find("spacing"), origin = at.find("origin");
  if (!file || !spacing) at.fail(fmt::format("{} has no {}", at.path(), file ? "spacing" : "file"), "file and spacing", "add it");
  const std::vector<double> apart = spacing->numbers(2, "[dx, dy] in m");
  if (!(apart[0] > 0) || !(apart[1] > 0)) {
    spacing->fail(fmt::format("{} holds {} and {}", spacing->path(), apart[0], apart[1]), "two numbers above zero", "change them");
  }
  const std::vector<double> begin = origin ? origin->numbers(2, "[x, y] in m") : std::vector<double>{0, 0};
  const std::string path = scene_path(*file, folder);
  const NumberTable table = file->located([&] { return read_numbers(path, 0, 2); });
  if (table.rows.size() < 2) file->fail(fmt::format("{} has one row", path), "two or more, each along x", "add heights");
  HeightField field{.columns = static_cast<Index>(table.rows.front().size()),
                    .rows = static_cast<Index>(table.rows.size()),
                    .spacing_x = apart[0],
                    .spacing_y = apart[1],
                    .origin_x = begin[0],
                    .origin_y = begin[1],
                    .heights = {}};
  for (const std::vector<double>& row : table.rows) field.heights.insert(field.heights.end(), row.begin(), row.end());
  return field;
}

}  // namespace linden
