#include "engine/program/live_host.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>

namespace linden {
namespace {

/// Without its port; empty where it is not "name", "name:port" or "[address]:port".
std::string name_of_host(const std::string& header) {
  const std::size_t end = header.starts_with('[') ? header.find(']') + 1 : std::min(header.find(':'), header.size());
  const std::string port = header.substr(end);
  const bool fine = port.empty() || (port.size() > 1 && port.size() <= 6 && port[0] == ':' &&
                                     std::all_of(port.begin() + 1, port.end(), [](unsigned char c) { return std::isdigit(c) != 0; }));
  return fine ? header.substr(0, end) : "";
}

bool is_address(const std::string& name) {
  in6_addr bytes;
  if (inet_pton(AF_INET, name.c_str(), &bytes) == 1) return true;
  return name.size() > 2 && name.front() == '[' && name.back() == ']' && inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), &bytes) == 1;
}

}  // namespace

bool is_own_host(const std::string& header, const std::string& bound, bool loopback) {
  std::string name = name_of_host(header);
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (name == "127.0.0.1" || name == "localhost" || name == "[::1]" || name == bound) return true;
  return !loopback && is_address(name);
}

bool is_own_origin(const std::string& header, const std::string& host) { return header == "http://" + host; }

}  // namespace linden
