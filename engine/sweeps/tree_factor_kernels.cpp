#include "engine/sweeps/tree_kernels.hpp"

namespace linden {

LINDEN_TREE_FACTORS(template, NothingAdded);
LINDEN_TREE_FACTORS(template, JointsAdded);
LINDEN_TREE_FACTORS(template, BodiesAdded);
LINDEN_TREE_FACTORS(template, BothAdded);

}  // namespace linden
