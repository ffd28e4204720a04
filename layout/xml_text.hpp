// layout/xml_text.hpp
// What XML text must not hold before tinyxml2 may read it.
//
// tinyxml2 compares each attribute of an element with all before it: an element of 40,000 attributes, 400 kB of text, takes it
// 20 s. Other lengths and depths it takes in linear time, or refuses.
#pragma once

#include <cstddef>
#include <string_view>

namespace linden {

/// Some ten times as many as there are in any element of URDF or COLLADA.
inline constexpr std::size_t kMostAttributes = 200;

/// Line of the first element with more attributes than that; 0 where there is none. One pass, comments and the like left aside.
int line_of_crowded_element(std::string_view xml);

}  // namespace linden
