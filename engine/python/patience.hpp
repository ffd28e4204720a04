// engine/python/patience.hpp
// Long calls: other threads of Python go on meanwhile, and Ctrl-C ends them between two steps.
#pragma once

#include <nanobind/nanobind.h>

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace linden::python {

/// Seconds that a part of a long call takes.
inline constexpr double kPart = 0.05;

/// work(part) without the lock of Python's interpreter until the parts make up `count`, the first of `first`, those that follow of some
/// kPart seconds; work returns whether to go on. Throws what a signal's handler raised, KeyboardInterrupt for one, between two parts.
template <class Work>
void in_parts(std::int64_t count, std::int64_t first, const Work& work) {
  using Clock = std::chrono::steady_clock;
  std::int64_t part = std::max<std::int64_t>(first, 1);
  for (std::int64_t done = 0; done < count;) {
    part = std::min(part, count - done);
    const Clock::time_point begin = Clock::now();
    bool goes_on = false;
    {
      const nanobind::gil_scoped_release release;
      goes_on = work(part);
    }
    if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
    if (!goes_on) return;
    done += part;
    const double taken = std::chrono::duration<double>(Clock::now() - begin).count();
    if (2 * taken < kPart) part *= 2;
    if (taken > 2 * kPart) part = std::max<std::int64_t>(1, part / 2);
  }
}

}  // namespace linden::python
