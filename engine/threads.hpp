// engine/threads.hpp
// Threads that are there when they are needed. oneTBB starts its own when work is waiting, and where the system has none left it ends the
// program; so they are asked for before.
#pragma once

namespace linden {

/// Allows so many threads to be started, more than the machine has cores too. Throws std::runtime_error where the process cannot have them at
/// once. They are tried once; what was found is remembered.
void require_threads(int threads);

/// Those that a call from here may use.
int threads_here();

}  // namespace linden
