// models/urdf/xml_text.hpp
// What XML text must be before tinyxml2 may read it, which takes all of it for UTF-8.
//
// tinyxml2 compares each attribute of an element with all before it: an element of 40,000 attributes, 400 kB of text, takes it
// 20 s. Other lengths and depths it takes in linear time, or refuses.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace linden {

/// Some ten times as many as there are in any element of URDF or COLLADA.
inline constexpr std::size_t kMostAttributes = 200;

/// Line of the first element with more attributes than that; 0 where there is none. One pass, comments and the like left aside.
int line_of_crowded_element(std::string_view xml);

/// UTF-16 or UTF-32, by the mark at its beginning or by the zeros beside its first letter.
bool is_utf16(std::string_view text);

/// Line of the first letter that UTF-8 does not write so; 0 where there is none.
int line_not_utf8(std::string_view text);

/// Text in which every byte is a letter of ISO 8859-1, in UTF-8.
std::string utf8_of_latin1(std::string_view text);

}  // namespace linden
