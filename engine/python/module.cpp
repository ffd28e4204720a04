// engine/python/module.cpp
#include <nanobind/stl/string.h>

#include "engine/python/bindings.hpp"
#include "engine/solve/instructions.hpp"

NB_MODULE(LINDEN_MODULE, m) {
  using namespace linden::python;
  m.attr("__name__") = "linden._core";  // whichever it was chosen as: linden/_processor.py
  m.doc() = "What linden's Python package is built on; use `import linden`.";
  bind_errors(m);
  bind_models(m);
  bind_scenes(m);
  bind_queries(m);
  bind_simulations(m);
  bind_observations(m);
  bind_batches(m);
  bind_animations(m);
  m.def(
      "best_instructions", [] { return std::string(linden::name(linden::best_instructions())); },
      "The widest vector instructions that this processor has and that batches are computed with: \"avx512\", \"avx2\", \"baseline\" or "
      "\"scalar\".");
}
