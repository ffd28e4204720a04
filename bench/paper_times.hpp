// bench/paper_times.hpp
// Figure 3 of the paper: time of a frame over degrees of freedom, every evaluation with every root finder; and its headline figures beside
// those.
#pragma once

#include "bench/paper_contenders.hpp"

namespace linden::paper {

/// Writes the tables `times` and `ratios` and the figure `times`. budget: processor time of each point at most [s].
void measure_times(const Place& place, double budget);

}  // namespace linden::paper
