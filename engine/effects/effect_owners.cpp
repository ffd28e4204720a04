#include "engine/effects/effect_owners.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/effects/effect_plan.hpp"

namespace linden {
namespace {

struct Line {
  std::string_view kind;
  std::vector<std::string_view> owners;
};

std::vector<Line> lines_of(std::string_view text) {
  const auto next = [](std::string_view& rest, char end) {
    const std::string_view part = rest.substr(0, rest.find(end));
    rest.remove_prefix(std::min(rest.size(), part.size() + 1));
    return part;
  };
  std::vector<Line> lines;
  while (!text.empty()) {
    std::string_view line = next(text, '\n');
    lines.push_back({next(line, '\0'), {}});
    while (!line.empty()) lines.back().owners.push_back(next(line, '\0'));
  }
  return lines;
}

/// Those that the other has not, in the order of the first; of equal ones as many as there are more.
std::vector<std::string_view> without(const std::vector<std::string_view>& owners, std::vector<std::string_view> other) {
  std::vector<std::string_view> rest;
  for (const std::string_view owner : owners) {
    const auto found = std::ranges::find(other, owner);
    if (found == other.end()) {
      rest.push_back(owner);
    } else {
      other.erase(found);
    }
  }
  return rest;
}

std::string text_of(std::string_view kind, const std::vector<std::string_view>& owners, bool others) {
  constexpr std::size_t kShown = 3;
  if (owners.empty()) return fmt::format("no {}{}", others ? "more " : "", kind);
  const std::size_t shown = std::min(kShown, owners.size());
  std::string text = fmt::format("{} on {}", kind, fmt::join(owners.begin(), owners.begin() + static_cast<std::ptrdiff_t>(shown), ", "));
  if (shown < owners.size()) text += fmt::format(" and {} more", owners.size() - shown);
  return text;
}

}  // namespace

std::string effect_owners(const EffectPlan& plan, const Names& names) {
  std::string text;
  const auto owner = [&](const auto& entry) -> const std::string& {
    if constexpr (requires { entry.row; }) {
      return names.velocity[static_cast<std::size_t>(entry.row)];
    } else {
      return names.body[static_cast<std::size_t>(entry.slot)];
    }
  };
  const auto add = [&](std::string_view kind, const auto& entries) {
    if (entries.empty()) return;
    text += kind;
    for (const auto& entry : entries) text.append(1, '\0').append(owner(entry));
    text += '\n';
  };
  Effects::each(plan.effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    if constexpr (std::is_same_v<Entry, Ground>) {
      add(plan.ground.ground.terrain ? "points of a terrain" : Entry::facts.owners, plan.ground.points);
    } else if constexpr (std::is_same_v<Entry, PairContact>) {
      for (const PairContact& contact : entries) {
        text += Entry::facts.owners;
        for (const auto& [a, b] : contact.pairs) text.append(1, '\0').append(contact.shapes[a].link).append(" and ").append(contact.shapes[b].link);
        text += '\n';
      }
    } else {
      add(Entry::facts.owners, entries);
    }
  });
  return text;
}

std::optional<OwnersDifference> first_difference(std::string_view saved, std::string_view here) {
  const std::vector<Line> then = lines_of(saved), now = lines_of(here);
  const auto owners_in = [](const std::vector<Line>& lines, std::string_view kind) {
    const auto line = std::ranges::find(lines, kind, &Line::kind);
    return line == lines.end() ? std::vector<std::string_view>() : line->owners;
  };
  for (const std::vector<Line>* lines : {&then, &now}) {
    for (const Line& line : *lines) {
      const auto before = owners_in(then, line.kind), after = owners_in(now, line.kind);
      if (before == after) continue;
      const auto only_before = without(before, after), only_after = without(after, before);
      if (only_before.empty() && only_after.empty()) {
        return OwnersDifference{text_of(line.kind, before, false), text_of(line.kind, after, false) + ", in another order"};
      }
      const bool some = only_before.size() < before.size();  // that both have
      return OwnersDifference{text_of(line.kind, only_before, some), text_of(line.kind, only_after, some)};
    }
  }
  return std::nullopt;
}

}  // namespace linden
