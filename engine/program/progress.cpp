#include "engine/program/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <string>

#include "engine/standard_streams.hpp"

namespace linden {
namespace {

constexpr std::chrono::milliseconds kQuietAtFirst{1000}, kBetween{100};
constexpr int kBarWidth = 24;

std::string clock_text(double seconds) {
  const auto whole = static_cast<std::int64_t>(std::min(seconds, 3.6e9) + 0.5);
  return whole < 3600 ? fmt::format("{}:{:02}", whole / 60, whole % 60)
                      : fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace

Progress::Progress(std::int64_t steps, double step, const char* unit) : steps_(steps), step_(step), unit_(unit), begin_(Clock::now()) {
  due_ = ::isatty(STDERR_FILENO) == 1 ? begin_ + kQuietAtFirst : Clock::time_point::max();
}

void Progress::draw(std::int64_t done, Clock::time_point now) {
  due_ = now + kBetween;
  const double share = static_cast<double>(done) / static_cast<double>(steps_);
  const double elapsed = seconds(now - begin_);
  const auto filled = static_cast<std::size_t>(share * kBarWidth);
  const std::string eta = done > 0 ? clock_text(elapsed * (1 - share) / share) : "?";
  show_text(fmt::format("\r\033[K{:3.0f} % [{:<{}}] {:.4g} of {:.4g} {}, {} left", 100 * share, std::string(filled, '#'), kBarWidth,
                        static_cast<double>(done) * step_, static_cast<double>(steps_) * step_, unit_, eta));
  shown_ = true;
}

void Progress::erase() {
  if (!shown_) return;
  show_text("\r\033[K");
  shown_ = false;
}

}  // namespace linden
