// engine/python/observations.cpp
// Rows of numbers by name (engine/queries/observations.hpp).
#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "engine/python/bindings.hpp"
#include "engine/python/numbers.hpp"
#include "engine/queries/observations.hpp"

using namespace nanobind::literals;

namespace linden::python {

void bind_observations(nb::module_& m) {
  nb::class_<Observed>(m, "Observed", "What one name stands for in a row of observations.")
      .def_ro("name", &Observed::name)
      .def_ro("offset", &Observed::offset, "Where its numbers begin in a row.")
      .def_ro("width", &Observed::width, "How many they are.")
      .def_prop_ro(
          "slice", [](const Observed& self) { return nb::slice(self.offset, self.offset + self.width, 1); }, "Its part of a row.")
      .def_ro("rows", &Observed::rows, "What each number is called.")
      .def_ro("units", &Observed::units)
      .def("__repr__", [](const Observed& self) {
        return fmt::format("Observed(\"{}\", columns {} to {})", self.name, self.offset, self.offset + self.width - 1);
      });
  nb::class_<Observations>(m, "Observations")
      .def(
          "__init__",
          [](Observations* self, PySimulation& simulation, const std::vector<std::string>& names) {
            new (self) Observations(simulation.look().model(), simulation.look().effects(), names);
          },
          "simulation"_a, "names"_a)
      .def_prop_ro("width", &Observations::width, "Numbers of a row.")
      .def_prop_ro("entries", &Observations::layout)
      .def(
          "observe",
          [](Observations& self, PySimulation& simulation, nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu> to) {
            simulation.ask([&](Simulation& asked) { self.observe(asked, {to.data(), to.size()}); });
          },
          "simulation"_a, "to"_a);
}

}  // namespace linden::python
