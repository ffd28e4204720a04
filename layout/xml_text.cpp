#include "layout/xml_text.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace linden {
namespace {

/// Markup that holds no attributes: how it begins and how it ends. The first that fits counts.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kPassedOver{
    {{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}, {"<!", ">"}}};

/// Takes an element's tag off the front of `rest` and counts its values in quotation marks.
std::size_t attributes_of_tag(std::string_view& rest) {
  std::size_t count = 0;
  for (std::size_t at = rest.find_first_of("\"'>"); at != rest.npos; at = rest.find_first_of("\"'>", at + 1)) {
    if (rest[at] == '>') {
      rest.remove_prefix(at + 1);
      return count;
    }
    ++count;
    at = rest.find(rest[at], at + 1);
    if (at == rest.npos) break;
  }
  rest = {};
  return count;
}

}  // namespace

int line_of_crowded_element(std::string_view xml) {
  std::string_view rest = xml;
  while (true) {
    rest.remove_prefix(std::min(rest.find('<'), rest.size()));
    if (rest.empty()) return 0;
    const auto over = std::ranges::find_if(kPassedOver, [&](const auto& markup) { return rest.starts_with(markup.first); });
    if (over != kPassedOver.end()) {
      const std::size_t end = rest.find(over->second, over->first.size());
      rest.remove_prefix(std::min(end, rest.size()));
      continue;
    }
    const std::string_view before = xml.substr(0, xml.size() - rest.size());
    if (attributes_of_tag(rest) > kMostAttributes) return 1 + static_cast<int>(std::ranges::count(before, '\n'));
  }
}

}  // namespace linden
