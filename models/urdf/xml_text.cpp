#include "models/urdf/xml_text.hpp"

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

/// Bytes of the first letter; 0 where it is none of UTF-8.
std::size_t length_in_utf8(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  std::size_t length = 1;
  if (first >= 0x80) {
    if (first < 0xc2 || first > 0xf4) return 0;
    length = first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
  }
  if (length > text.size()) return 0;
  for (const char next : text.substr(1, length - 1)) {
    if ((static_cast<unsigned char>(next) & 0xc0) != 0x80) return 0;
  }
  return length;
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

bool is_utf16(std::string_view text) {
  using namespace std::string_view_literals;
  return text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff") || text.starts_with("<\0"sv) || text.starts_with("\0<"sv);
}

int line_not_utf8(std::string_view text) {
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t length = length_in_utf8(text.substr(at));
    if (length == 0) return 1 + static_cast<int>(std::ranges::count(text.substr(0, at), '\n'));
    at += length;
  }
  return 0;
}

std::string utf8_of_latin1(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char letter : text) {
    const auto code = static_cast<unsigned char>(letter);
    if (code < 0x80) {
      result += letter;
    } else {
      result += static_cast<char>(0xc0 | (code >> 6));
      result += static_cast<char>(0x80 | (code & 0x3f));
    }
  }
  return result;
}

}  // namespace linden
