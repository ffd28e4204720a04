// engine/program/live_host.hpp
// Whom a request takes this machine for. A page of a stranger whose name leads to 127.0.0.1 (DNS rebinding) has that name for its host and
// can have no other; so whatever asks for a name that is not this machine's own is refused.
#pragma once

#include <string>

namespace linden {

/// Whether a Host header, "localhost:8470", names this machine: 127.0.0.1, localhost, [::1], or the address that it listens at; where that
/// is no loopback address any address in numbers. bound: as addresses have it, 10.0.0.7 or [fe80::1]. Ports are not looked at, they may be
/// forwarded.
bool is_own_host(const std::string& header, const std::string& bound, bool loopback);

/// Whether an Origin header is that of pages that this host serves.
bool is_own_origin(const std::string& header, const std::string& host);

}  // namespace linden
