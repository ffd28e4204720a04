// engine/distributed/mpi_ranks.hpp
// Ranks that MPI connects, where linden is built with it (LINDEN_MPI in CMakeLists.txt): mpi_ranks.cpp, else no_mpi.cpp.
#pragma once

#include <memory>
#include <string>

#include "engine/distributed/ranks.hpp"

namespace linden {

bool has_mpi();
/// "Open MPI 4.1.4"; empty without.
std::string mpi_library();
/// Starts MPI, which ends with what is returned. Once in a process, where has_mpi().
std::unique_ptr<Ranks> mpi_ranks();

}  // namespace linden
