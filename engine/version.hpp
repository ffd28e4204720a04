// engine/version.hpp
// The version that CMakeLists.txt states.
#pragma once

namespace linden {

inline constexpr const char* kVersion = LINDEN_VERSION;

}  // namespace linden
