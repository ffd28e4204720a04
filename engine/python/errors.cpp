// engine/python/errors.cpp
// Errors of the engine as exceptions of Python, with the engine's own messages.
#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include "engine/python/bindings.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/step_report.hpp"
#include "layout/support/input_error.hpp"

using namespace nanobind::literals;

namespace linden::python {
namespace {

/// A class of linden/errors.py.
nb::object error_class(const char* name) { return nb::module_::import_("linden.errors").attr(name); }

}  // namespace

void bind_errors(nb::module_& m) {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const linden::MemoryError& error) {
      PyErr_SetString(PyExc_MemoryError, error.what());
    } catch (const InputError& error) {
      PyErr_SetString(error_class("InputError").ptr(), error.what());
    }
  });

  nb::enum_<StepStatus>(m, "Status", nb::is_arithmetic(), "How a step went.")
      .value("converged", StepStatus::converged)
      .value("not_converged", StepStatus::not_converged, "The residual would not go below the tolerance.")
      .value("past_pi", StepStatus::past_pi, "A body would turn by half a turn or more in one step.")
      .value("gains_energy", StepStatus::gains_energy, "The solution found is not the motion's, but another root.")
      .value("not_finite", StepStatus::not_finite, "The residual is NaN or infinite.")
      .value("opens", StepStatus::opens, "A coupling would open: its bodies are moved or held where it cannot follow.");

  nb::class_<StepReport>(m, "StepReport", "How the solve of one step went.")
      .def_ro("status", &StepReport::status)
      .def_prop_ro("ok", &StepReport::ok, "Whether the step was taken.")
      .def_ro("iterations", &StepReport::iterations, "Corrections of the displacement.")
      .def_ro("evaluations", &StepReport::evaluations, "Evaluations of the residual.")
      .def_ro("factorisations", &StepReport::factorisations, "Factors of the Jacobian.")
      .def_ro("backtracks", &StepReport::backtracks, "Corrections that were cut short.")
      .def_ro("blows", &StepReport::blows, "Impulses at which joints met limits.")
      .def_ro("substeps", &StepReport::substeps, "Above 1: the step was split.")
      .def_ro("at_rounding_floor", &StepReport::at_rounding_floor, "Stopped where rounding lets the residual fall no further.")
      .def_ro("residual", &StepReport::residual, "Relative, at the end.")
      .def("__repr__", [](const StepReport& self) {
        return fmt::format("StepReport(ok={}, iterations={}, evaluations={}, residual={:.3g})", self.ok(), self.iterations,
                           self.evaluations, self.residual);
      });

  nb::class_<StepLengths>(m, "StepLengths", "Variable steps since the last start, and the accuracy that they were chosen for.")
      .def_ro("steps", &StepLengths::steps)
      .def_ro("shortest", &StepLengths::shortest, "[s]")
      .def_ro("longest", &StepLengths::longest, "[s]")
      .def_ro("mean", &StepLengths::mean, "[s]")
      .def_ro("retaken", &StepLengths::retaken, "Steps that failed and were taken again, shorter.")
      .def_ro("accuracy", &StepLengths::accuracy, "Asked for.")
      .def_ro("strayed", &StepLengths::strayed, "Band of the energy so far, over the largest kinetic energy.")
      .def_ro("lowered", &StepLengths::lowered, "Times that steps were made shorter for good because it strayed further.")
      .def_prop_ro("kept", &StepLengths::kept, "Whether the band is within the accuracy.");
  nb::class_<StepsReport>(m, "StepsReport", "What several steps took together. The one that failed is not counted.")
      .def_ro("steps", &StepsReport::steps)
      .def_prop_ro("ok", &StepsReport::ok, "Whether all of them were taken.")
      .def_ro("iterations", &StepsReport::iterations)
      .def_ro("evaluations", &StepsReport::evaluations)
      .def_ro("factorisations", &StepsReport::factorisations)
      .def_ro("most_iterations", &StepsReport::most_iterations, "The most in one step.")
      .def_ro("split_steps", &StepsReport::split_steps, "Steps that were split.")
      .def_ro("largest_residual", &StepsReport::largest_residual)
      .def_ro("last", &StepsReport::last, "Of the last step, or of the one that failed.")
      .def("__repr__", [](const StepsReport& self) {
        return fmt::format("StepsReport(ok={}, steps={}, iterations={}, evaluations={})", self.ok(), self.steps, self.iterations,
                           self.evaluations);
      });
}

void raise_step_error(const std::string& message, nb::object report) {
  const nb::object type = error_class("StepError");
  PyErr_SetObject(type.ptr(), type(message, report).ptr());
  throw nb::python_error();
}

}  // namespace linden::python
