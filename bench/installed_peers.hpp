// bench/installed_peers.hpp
// The other engines that a program was built with: targets that link linden_peers know which they are.
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "bench/peer.hpp"

namespace linden {

inline std::vector<Contender> installed_peers() {
  std::vector<Contender> all;
#ifdef LINDEN_WITH_MUJOCO
  std::ranges::move(mujoco_contenders(), std::back_inserter(all));
#endif
#ifdef LINDEN_WITH_DART
  std::ranges::move(dart_contenders(), std::back_inserter(all));
#endif
  return all;
}

}  // namespace linden
