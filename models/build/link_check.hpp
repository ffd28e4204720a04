// models/build/link_check.hpp
// What can be said of a link and its joint alone, before they have a place in a tree: numbers, limits, inertia, shapes. And of a body once
// all that is fixed to it is part of it: its inertia is what moves, and is judged then.
#pragma once

#include <string>
#include <vector>

#include "models/build/builder.hpp"
#include "models/build/origin_inertia.hpp"

namespace linden {

/// Throws InputError, which begins with `source`, for what no link or joint can be; appends to the warnings what no solid body is and yet
/// moves well.
void check(const LinkSpec& link, const std::string& source, std::vector<std::string>& warnings);

/// Throws InputError where the inertia of a body, with all that is fixed to it, is not positive. What is negative by no more than the
/// rounding of mass times size squared is as good as zero. `reach`: from the body's joint to the farthest joint that it carries [m].
void check_body(const std::string& link, const OriginInertia& inertia, double reach, const std::string& source);

}  // namespace linden
