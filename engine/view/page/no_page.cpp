#include "engine/view/page_template.hpp"

namespace linden {

std::string_view page_template() { return {}; }

}  // namespace linden
