#include "models/urdf/urdf_numbers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "layout/support/words.hpp"

namespace linden {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

const XMLAttribute& UrdfNumbers::attribute(const std::string& owner, const XMLElement& element, const char* name) const {
  const XMLAttribute* attribute = element.FindAttribute(name);
  if (!attribute) {
    report_.fail(element.GetLineNum(), fmt::format("{}: <{}> has no {}", owner, element.Name(), name),
                 fmt::format("{}=\"...\"", name), "add it");
  }
  return *attribute;
}

double UrdfNumbers::one(const std::string& owner, const XMLElement& element, const char* name) const {
  const XMLAttribute& text = attribute(owner, element, name);
  const std::vector<std::string_view> words = words_of(text.Value());
  const std::optional<double> value = words.size() == 1 ? number_in(words[0]) : std::nullopt;
  if (!value) {
    report_.fail(text.GetLineNum(), fmt::format("{}: <{}> has {}={}", owner, element.Name(), name, quoted(text.Value())),
                 "one finite number, such as 0.5", "correct it");
  }
  return *value;
}

double UrdfNumbers::one_or(double otherwise, const std::string& owner, const XMLElement& element, const char* name) const {
  return element.FindAttribute(name) ? one(owner, element, name) : otherwise;
}

double UrdfNumbers::one_or_infinity(const std::string& owner, const XMLElement& element, const char* name) const {
  std::string word = attribute(owner, element, name).Value();
  std::erase_if(word, [](unsigned char letter) { return std::isspace(letter) != 0; });
  std::ranges::transform(word, word.begin(), [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (word == "inf" || word == "+inf" || word == "infinity" || word == "+infinity") return kInfinity;
  if (word == "-inf" || word == "-infinity") return -kInfinity;
  return one(owner, element, name);
}

std::array<double, 3> UrdfNumbers::three(const std::string& owner, const XMLElement& element, const char* name) const {
  const XMLAttribute& text = attribute(owner, element, name);
  const std::vector<std::string_view> words = words_of(text.Value());
  std::array<double, 3> result{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::optional<double> value = words.size() == 3 ? number_in(words[k]) : std::nullopt;
    if (!value) {
      report_.fail(text.GetLineNum(), fmt::format("{}: <{}> has {}={}", owner, element.Name(), name, quoted(text.Value())),
                   "three finite numbers, such as \"0 0 0.5\"", "correct it");
    }
    result[k] = *value;
  }
  return result;
}

const XMLElement* UrdfNumbers::origin(const std::string& owner, const XMLElement& parent) const {
  const XMLElement* origin = parent.FirstChildElement("origin");
  if (origin && origin->FindAttribute("quat_xyzw")) {
    report_.fail(origin->GetLineNum(), owner + ": <origin> has quat_xyzw", "rpy, roll pitch yaw in rad",
                 "convert the quaternion");
  }
  return origin;
}

}  // namespace linden
