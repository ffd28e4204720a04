#include "tests/gallery/scenario.hpp"

namespace linden {

void run_beside(Report&, const Scenario&, double) {}

}  // namespace linden
