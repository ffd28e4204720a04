#include "engine/sweeps/tree_kernels.hpp"

namespace linden {

LINDEN_TREE_KERNELS(template);

}  // namespace linden
