// tests/everyday/check.hpp
// What an everyday scene has to show. tests/everyday/README.md says why each bound is what it is.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scene.hpp"

namespace linden {

enum class Check : std::uint8_t { refused, position, energy, rest, velocity, bits, observations, contact, blow };
inline constexpr std::array<Check, 9> kChecks{Check::refused,  Check::position, Check::energy,       Check::rest, Check::velocity,
                                              Check::bits,     Check::observations, Check::contact, Check::blow};

std::string_view name(Check check);

struct Difference {
  Check check;
  std::string what;  // kind of difference, for the table: few words, no numbers
  std::string text;  // where, found, expected
};

/// At most one difference of a kind.
std::vector<Difference> differences(const EverydayScene& scene, std::optional<Check> only);

}  // namespace linden
