#include "engine/scene/scene_time_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "engine/scene/number_table.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

using Kind = SceneValue::Kind;

/// Times and one list beside them a name.
struct Columns {
  std::vector<double> times;
  std::vector<std::vector<double>> lists;
};

/// Of a file with `least` to `most` numbers beside the time.
Columns columns_of_file(const SceneValue& at, const std::string& folder, std::size_t least, std::size_t most) {
  const std::string file = scene_path(at, folder);
  const NumberTable table = at.located([&] { return read_numbers(file, least == most ? least + 1 : 0, least + 1); });
  const std::size_t width = table.rows.front().size();
  if (width > most + 1)
    at.fail(fmt::format("{}:{}: {} numbers", file, table.lines.front(), width), fmt::format("{} to {} in every row", least + 1, most + 1),
            "remove some");
  Columns result{{}, std::vector<std::vector<double>>(width - 1)};
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    const double time = table.rows[k][0];
    if (k > 0 && time < result.times.back()) {
      at.fail(fmt::format("{}:{}: time {} s comes after {} s", file, table.lines[k], time, result.times.back()), "times that ascend",
              "sort its lines");
    }
    result.times.push_back(time);
    for (std::size_t j = 0; j + 1 < width; ++j) result.lists[j].push_back(table.rows[k][j + 1]);
  }
  return result;
}

/// names: of the lists beside the times, of which the first has to be there.
Columns columns_of_map(const SceneValue& at, const std::vector<std::string>& names) {
  std::vector<std::string> keys{"times"};
  keys.insert(keys.end(), names.begin(), names.end());
  at.entries_of(keys);
  const auto times = at.find("times");
  if (!times || !at.find(names[0]))
    at.fail(fmt::format("{} has no {}", at.path(), times ? names[0] : "times"), fmt::format("times and {}", names[0]), "add a list");
  Columns result{times->numbers(), {}};
  for (const std::string& name : names) {
    const auto values = at.find(name);
    if (!values) break;
    result.lists.push_back(values->numbers());
    if (result.times.empty() || result.times.size() != result.lists.back().size()) {
      values->fail(fmt::format("{} has {} times and {} {}", at.path(), result.times.size(), result.lists.back().size(), name),
                   "one a time, one or more", "add what is missing");
    }
  }
  for (std::size_t k = 1; k < result.times.size(); ++k) {
    if (result.times[k] < result.times[k - 1])
      times->fail(fmt::format("time {} s comes after {} s", result.times[k], result.times[k - 1]), "times that ascend", "sort them");
  }
  return result;
}

Columns read_columns(const SceneValue& at, const std::string& folder, const std::vector<std::string>& names) {
  if (!at.is(Kind::text)) return columns_of_map(at, names);
  const std::string& word = at.text("a number or FILE.csv");
  if (number_in(word)) return {{0}, {{at.number()}}};
  if (!word.ends_with(".csv")) at.refuse("a number, FILE.csv or {times, values}", "write for example 0.5");
  return columns_of_file(at, folder, 1, names.size());
}

}  // namespace

std::string scene_path(const SceneValue& at, const std::string& folder) {
  return (std::filesystem::path(folder) / at.text("a CSV file")).string();
}

TimeTable read_time_table(const SceneValue& at, const std::string& folder) {
  Columns columns = read_columns(at, folder, {"values"});
  return {std::move(columns.times), std::move(columns.lists[0])};
}

TimeTable read_time_table_file(const SceneValue& at, const std::string& folder) {
  Columns columns = columns_of_file(at, folder, 1, 1);
  return {std::move(columns.times), std::move(columns.lists[0])};
}

JointMotion read_motion(const SceneValue& at, Index row, const std::string& folder) {
  Columns columns = read_columns(at, folder, {"values", "velocities"});
  const auto twice = std::ranges::adjacent_find(columns.times);
  if (twice != columns.times.end())
    at.fail(fmt::format("{} is at two places at {} s", at.path(), *twice), "one position a time",
            "leave one out; a servo can have a target that jumps");
  columns.lists.resize(2);
  return {row, {std::move(columns.times), std::move(columns.lists[0])}, std::move(columns.lists[1])};
}

}  // namespace linden
