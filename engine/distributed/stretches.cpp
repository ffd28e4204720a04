#include "engine/distributed/stretches.hpp"

#include <algorithm>
#include <cmath>

namespace linden {

Stretches::Stretches(Ranks& ranks, std::int64_t steps, std::int64_t done) : ranks_(ranks), steps_(steps), end_(std::min(done + 1, steps)) {}

void Stretches::hear(std::int64_t steps) {
  const std::vector<std::int64_t> told = ranks_.end_most();
  signal_ = std::max(signal_, static_cast<int>(told[0]));
  failed_ = failed_ || told[1] != 0;
  due_ = told[3] != 0;
  step_seconds_ = 1e-9 * static_cast<double>(told[2]) / static_cast<double>(steps);
}

bool Stretches::next(double seconds, int signal, bool failed, bool due) {
  constexpr double kAimed = 0.1;  // [s]
  due_ = false;
  if (told_length_ > 0) hear(told_length_);
  const std::int64_t mine[] = {signal, failed ? 1 : 0, std::llround(1e9 * seconds), due ? 1 : 0};
  ranks_.begin_most(mine);
  told_length_ = length_;
  const bool over = end_ == steps_ || signal_ != 0 || failed_;
  if (over || !ranks_.several()) {
    hear(told_length_);
    told_length_ = 0;
  }
  if (over || signal_ != 0 || failed_) return false;
  const double fitting = step_seconds_ > 0 ? kAimed / step_seconds_ : 2.0 * static_cast<double>(length_);
  length_ = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::min(fitting, 1e12)), 1, 2 * length_);
  length_ = std::min(length_, steps_ - end_);
  end_ += length_;
  return true;
}

}  // namespace linden
