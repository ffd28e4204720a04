#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <utility>

#include "engine/python/bindings.hpp"
#include "engine/python/numbers.hpp"
#include "engine/view/animation_recorder.hpp"
#include "engine/view/curves.hpp"
#include "engine/view/gltf.hpp"
#include "engine/view/page.hpp"

namespace linden::python {
namespace {

/// A motion that is collected; the scene lives as long as it does.
class PyAnimation {
 public:
  PyAnimation(std::shared_ptr<Scene> scene, std::string title, std::int64_t instances)
      : scene_(std::move(scene)), instances_(instances), recorder_(scene_->model, scene_->effects, std::move(title), instances) {
    constexpr std::int64_t kMostCurves = 2000;
    if (instances * scene_->model.tree.shape.positions > kMostCurves) return;
    for (std::int64_t i = 0; i < instances; ++i) recorder_.add_curves(position_curves(scene_->model, i));
    with_curves_ = true;
  }

  void add(double time, const Numbers& q, std::vector<DrawnForce> forces = {}) {
    recorder_.add(time, q, with_curves_ ? std::span<const double>(q) : std::span<const double>(), std::move(forces));
  }
  void add(double time, const Simulation& now) {
    recorder_.add(time, now.positions(), with_curves_ ? now.positions() : std::span<const double>(), forces_of(now, 0));
  }
  std::int64_t instances() const { return instances_; }
  Index positions() const { return scene_->model.tree.shape.positions; }
  AnimationRecorder& recorder() { return recorder_; }

 private:
  std::shared_ptr<Scene> scene_;
  std::int64_t instances_;
  bool with_curves_ = false;
  AnimationRecorder recorder_;
};

}  // namespace

void bind_animations(nb::module_& m) {
  nb::class_<PyAnimation>(m, "AnimationRecorder", "A motion to be looked at, collected frame by frame; what people call is linden.view.")
      .def(nb::init<std::shared_ptr<Scene>, std::string, std::int64_t>(), nb::arg("scene"), nb::arg("title"), nb::arg("instances") = 1)
      .def(
          "add",
          [](PyAnimation& self, double time, nb::object q) {
            self.add(time, Numbers(q, "q", {static_cast<std::ptrdiff_t>(self.instances()), self.positions()}));
          },
          nb::arg("time"), nb::arg("q"), "A frame at a time [s] behind those before it: positions [instances, nq].")
      .def(
          "add_simulation",
          [](PyAnimation& self, double time, PySimulation& simulation) {
            const Simulation& now = simulation.look();
            self.add(time, now);
          },
          nb::arg("time"), nb::arg("simulation"), "A frame of one instance, with the pushes of the ground where they are kept.")
      .def(
          "note", [](PyAnimation& self, std::string text) { self.recorder().add_note(std::move(text)); }, nb::arg("text"),
          "A sentence for those who look.")
      .def_prop_ro(
          "warnings", [](PyAnimation& self) { return self.recorder().animation().drawing.warnings; },
          "What could not be drawn as the model says, a sentence each.")
      .def(
          "page",
          [](PyAnimation& self) {
            const nb::gil_scoped_release release;
            return page_of(self.recorder().animation());
          },
          "The page that shows it, a whole HTML file.")
      .def(
          "gltf",
          [](PyAnimation& self) {
            std::string bytes;
            {
              const nb::gil_scoped_release release;
              bytes = glb_of(self.recorder().animation());
            }
            return nb::bytes(bytes.data(), bytes.size());
          },
          "It as binary glTF 2.0.");
}

}  // namespace linden::python
