#include <stdexcept>

#include "engine/distributed/mpi_ranks.hpp"

namespace linden {

bool has_mpi() { return false; }
std::string mpi_library() { return ""; }
std::unique_ptr<Ranks> mpi_ranks() { throw std::logic_error("linden was built without MPI"); }

}  // namespace linden
