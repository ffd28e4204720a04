// engine/view/base64.hpp
// Bytes as text, RFC 4648 section 4.
#pragma once

#include <string>
#include <string_view>

namespace linden {

std::string base64(std::string_view bytes);
/// Throws std::runtime_error for what is no such text.
std::string from_base64(std::string_view text);

}  // namespace linden
