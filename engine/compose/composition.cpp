#include "engine/compose/composition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// First half and middle, mirrored.
template <std::size_t Half>
constexpr std::array<double, 2 * Half - 1> symmetric(const std::array<double, Half>& half) {
  std::array<double, 2 * Half - 1> all{};
  for (std::size_t i = 0; i < Half; ++i) all[i] = all[2 * Half - 2 - i] = half[i];
  return all;
}

constexpr auto kOrder2 = symmetric<1>({1.0});
constexpr auto kOrder4 = symmetric<3>({0.35, 0.49486703894154765960, -0.68973407788309531920});
constexpr auto kOrder6 = symmetric<6>({0.16666666666666666667, 0.2367, 0.21624774592197845472, -0.47452395287969264913,
                                       0.08549441074590189336, 0.53883025909029126877});
constexpr auto kOrder8 = symmetric<9>({0.13020248308889008088, 0.56116298177510838456, -0.38947496264484728641,
                                       0.15884190655515560090, -0.39590389413323757734, 0.18453964097831570709,
                                       0.25837438768632204729, 0.29501172360931029887, -0.60550853383003451170});

}  // namespace

std::span<const double> composition(int order) {
  switch (order) {
    case 2: return kOrder2;
    case 4: return kOrder4;
    case 6: return kOrder6;
    case 8: return kOrder8;
    default: throw InputError(fmt::format("there is no method of order {}; choose 2, 4, 6 or 8", order));
  }
}

std::string irreversible(const Effects& effects) {
  std::vector<std::string_view> refused;
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    if (std::ranges::any_of(entries, one_way<Entry>)) refused.push_back(Entry::facts.name);
  });
  return fmt::format("{}", fmt::join(refused, ", "));
}

std::string sudden(const Effects& effects) {
  std::vector<std::string_view> found;
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    if (std::ranges::any_of(entries, jumps<Entry>)) found.push_back(Entry::facts.sudden);
  });
  return fmt::format("{}", fmt::join(found, ", "));
}

void check_order(int order, const Model& model, const Effects& effects) {
  if (order == 2) return;
  std::string refused = irreversible(effects);
  for (const Coupling& coupling : model.couplings) {
    if (!damps(coupling)) continue;
    refused += fmt::format("{}the damping of coupling {}", refused.empty() ? "" : ", ", quoted(coupling.name));
    break;
  }
  if (refused.empty()) return;
  throw InputError(
      fmt::format("a step of order {} goes back in time between whiles, where effects that take energy would return it and "
                  "those that act at given times have no place; the scene has {}: use order 2, or leave {} out",
                  order, refused, refused.find(',') == refused.npos ? "it" : "them"));
}

}  // namespace linden
