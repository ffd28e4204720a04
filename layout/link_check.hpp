// layout/link_check.hpp
// What can be said of a link and its joint alone, before they have a place in a tree: numbers, limits, inertia, shapes.
#pragma once

#include <string>
#include <vector>

#include "layout/builder.hpp"

namespace linden {

/// Throws InputError, which begins with `source`, for what no link or joint can be; appends to the warnings what no solid body is and yet
/// moves well.
void check(const LinkSpec& link, const std::string& source, std::vector<std::string>& warnings);

}  // namespace linden
