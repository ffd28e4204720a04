#include "engine/program/plot_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace linden::plot {
namespace {

std::string with_minus_signs(const std::string& text) {
  std::string result;
  for (const char c : text) c == '-' ? result += "\u2212" : result += c;
  return result;
}

/// Multiples of a step 1, 2 or 5 times a power of ten, at least `spacing` apart (in the values' unit).
std::vector<std::pair<double, std::string>> round_values(double lo, double hi, double spacing) {
  int power = static_cast<int>(std::floor(std::log10(spacing)));
  const double lead = spacing / std::pow(10, power);
  double digit = lead <= 1 ? 1 : lead <= 2 ? 2 : lead <= 5 ? 5 : 10;
  if (digit > 5) digit = 1, ++power;
  const double step = digit * std::pow(10, power);
  const double first = std::ceil(lo / step - 1e-9), last = std::floor(hi / step + 1e-9);
  const double largest = std::max(std::abs(first), std::abs(last)) * step;
  // one exponent for the whole axis, so that labels compare at a glance
  const bool plain = largest < 0.999e6 && largest > 0.999e-3;
  const int exponent = plain || largest == 0 ? 0 : static_cast<int>(std::floor(std::log10(largest) + 1e-9));
  const int decimals = std::max(0, exponent - power);
  std::vector<std::pair<double, std::string>> values;
  for (double k = first; k <= last; ++k) {
    const std::string digits = fmt::format("{:.{}f}", k * digit * std::pow(10, power - exponent), decimals);
    const std::string suffix = exponent == 0 ? "" : fmt::format("e{}", exponent);
    values.emplace_back(k * step, k == 0 ? "0" : with_minus_signs(digits + suffix));
  }
  return values;
}

void add_linear_ticks(Scale& scale, double spacing) {
  double origin = 0;
  const double range = scale.hi - scale.lo, largest = std::max(std::abs(scale.lo), std::abs(scale.hi));
  if (largest > 1e5 * spacing * range) {
    // the digits that all values share leave the tick labels and are said once
    const double middle = scale.lo + range / 2;
    const int digits = static_cast<int>(std::floor(std::log10(std::abs(middle))) - std::ceil(std::log10(range)));
    const std::string shared = fmt::format("{:.{}e}", middle, std::max(0, digits));
    origin = std::strtod(shared.c_str(), nullptr);
    scale.label += with_minus_signs(fmt::format("{}relative to {}", scale.label.empty() ? "" : ", ", origin));
  }
  for (const auto& [value, label] : round_values(scale.lo - origin, scale.hi - origin, spacing * range))
    scale.ticks.push_back({(value - (scale.lo - origin)) / range, label});
}

void add_log_ticks(Scale& scale, double spacing) {
  const double range = scale.hi - scale.lo;
  int stride = 1;
  for (const int wider : {2, 3, 5, 10, 20, 50, 100})
    if (stride < spacing * range) stride = wider;
  const int first = static_cast<int>(std::floor(scale.lo)), last = static_cast<int>(std::ceil(scale.hi));
  const bool plain = first >= -4 && last <= 6;
  const bool digits_too = range < 2.2;  // too few decades: 2 and 5 get labels as well
  const bool all_digits = 2 * spacing * range <= 1;  // else a decade has room for 2 and 5 alone, or for none
  for (int k = first; k <= last; ++k)
    for (int digit = 1; digit <= (stride == 1 ? 9 : 1); ++digit) {
      if (!all_digits && digit != 1 && digit != 2 && digit != 5) continue;
      const double at = (k + std::log10(digit) - scale.lo) / range;
      if (at < -1e-9 || at > 1 + 1e-9) continue;
      const bool labelled = digit == 1 ? k % stride == 0 : digits_too && (digit == 2 || digit == 5);
      const std::string text = plain    ? fmt::format("{:.{}f}", digit * std::pow(10, k), std::max(0, -k))
                               : k == 0 ? fmt::format("{}", digit)
                                        : with_minus_signs(fmt::format("{}e{}", digit, k));
      scale.ticks.push_back({at, labelled ? text : ""});
    }
  if (std::count_if(scale.ticks.begin(), scale.ticks.end(), [](const Tick& t) { return !t.label.empty(); }) >= 3) return;
  // within part of a decade the axis is nearly linear, and ticks are too
  scale.ticks.clear();
  const double lo = std::pow(10, scale.lo), hi = std::pow(10, scale.hi);
  for (const auto& [value, label] : round_values(lo, hi, spacing * (hi - lo)))
    scale.ticks.push_back({scale(value), label});
}

}  // namespace

Scale make_scale(const Axis& axis, double lo, double hi, double pad, double spacing) {
  Scale scale{axis.log, axis.log ? std::log10(lo) : lo, axis.log ? std::log10(hi) : hi, axis.label, {}};
  const double size = std::max(std::abs(scale.lo), std::abs(scale.hi)), range = scale.hi - scale.lo;
  if (range <= 8 * std::numeric_limits<double>::epsilon() * size || range < 1e-290) {
    // nothing but rounding: showing it at full height would make a drama of it
    const double room = axis.log ? 0.5 : size < 1e-290 ? 1 : 0.1 * size;
    scale.lo -= room, scale.hi += room;
  } else {
    const bool from_zero = !axis.log && lo >= 0 && lo < pad * range;  // padding does not invent negative values
    const bool to_zero = !axis.log && hi <= 0 && -hi < pad * range;
    scale.lo = from_zero ? 0 : scale.lo - pad * range;
    scale.hi = to_zero ? 0 : scale.hi + pad * range;
  }
  axis.log ? add_log_ticks(scale, spacing) : add_linear_ticks(scale, spacing);
  return scale;
}

}  // namespace linden::plot
