// What a user of the installed library writes: load a robot, step it, look at its energy.
#include <cmath>
#include <cstdio>

#include <linden/engine/simulation.hpp>
#include <linden/models/urdf/urdf.hpp>

#if __has_include("engine/simulation.hpp") || __has_include("layout/model.hpp") || __has_include(<models/urdf/urdf.hpp>)
#error "linden's folders are on the include path under names that anybody may have"
#endif

int main(int, char** arguments) {
  linden::Simulation simulation(linden::load_urdf(arguments[1], linden::Base::fixed), {.step = 1e-3});
  const double before = simulation.energy().total();
  for (int k = 0; k < 1000; ++k) {
    const linden::StepReport report = simulation.step();
    if (!report.ok()) {
      std::fprintf(stderr, "%s\n", simulation.describe(report).c_str());
      return 1;
    }
  }
  const double drift = simulation.energy().total() - before;
  std::printf("%d bodies, energy drift %.2e J in %g s\n", simulation.model().tree.bodies(), drift, simulation.time());
  return std::abs(drift) < 0.1 ? 0 : 1;
}
