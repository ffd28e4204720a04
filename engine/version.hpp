// engine/version.hpp
#pragma once

namespace linden {

#ifndef LINDEN_VERSION
#define LINDEN_VERSION "0.1.0"
#endif

inline constexpr const char* kVersion = LINDEN_VERSION;

}  // namespace linden
