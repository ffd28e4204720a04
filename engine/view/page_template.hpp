// engine/view/page_template.hpp
// The page that shows a motion, as it is before data is put in: engine/view/page/ bundled with three.js when linden is built.
#pragma once

#include <string_view>

namespace linden {

/// Text of HTML with one line "<!-- linden data -->" in place of the data (engine/view/page.hpp). Empty where linden was built without it
/// (LINDEN_VIEW=OFF).
std::string_view page_template();

}  // namespace linden
