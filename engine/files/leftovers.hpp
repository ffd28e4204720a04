// engine/files/leftovers.hpp
// What a process left behind that was killed while it wrote.
//
// An output is written under a hidden name beside it, .NAME.linden.LETTERS.part, a file or a folder, which is locked (flock) as long as the
// process lives: the system gives the lock back when it dies, however it dies. What bears such a name and can be locked is nobody's. On file
// systems that know no locks nothing is held and nothing is removed.
#pragma once

#include <string>
#include <vector>

#include "engine/files/destination.hpp"

namespace linden {

/// An open file or folder is being written from now on, until it is closed. False where somebody took it for a leftover before that.
bool hold(int file);

/// Removes what dead processes left beside the destination that was to become it. Names of what was removed.
std::vector<std::string> remove_leftovers(const Destination& destination);

}  // namespace linden
