// engine/python/scenes.cpp
// Scenes: from files, and from what Python says with the keys of one.
#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "engine/python/bindings.hpp"
#include "engine/python/numbers.hpp"
#include "engine/python/scene_values.hpp"
#include "engine/scene/scene_bytes.hpp"
#include "engine/scene/scene_file.hpp"

using namespace nanobind::literals;

namespace linden::python {
namespace {

std::vector<std::string> joints_of_rows(const Scene& scene, const auto& entries) {
  std::vector<std::string> names;
  for (const auto& entry : entries) names.push_back(scene.model.names.velocity[static_cast<std::size_t>(entry.row)]);
  return names;
}

}  // namespace

void bind_scenes(nb::module_& m) {
  nb::class_<Scene>(m, "Scene", "All that a simulation is: model, effects, start, how to step, for how long.")
      .def_prop_ro("model", [](const std::shared_ptr<Scene>& self) { return std::shared_ptr<Model>(self, &self->model); })
      .def_prop_ro(
          "step", [](const Scene& self) { return self.options.step; }, "h [s].")
      .def_prop_ro("order", [](const Scene& self) { return self.options.order; })
      .def_prop_ro(
          "duration", [](const Scene& self) { return self.duration; }, "[s]")
      .def_prop_ro(
          "gravity", [](const Scene& self) { return fixed_array(std::span<const double>(self.options.gravity)); }, "[3; m/s^2]")
      .def_prop_ro(
          "seed", [](const Scene& self) { return self.seed; }, "Of what is drawn of the start and of `randomize`.")
      .def_prop_ro(
          "files", [](const Scene& self) { return self.files; }, "All that were read for it.")
      .def_prop_ro(
          "q",
          [](const Scene& self) { return fixed_array(self.initial.positions.empty() ? self.model.neutral() : self.initial.positions); },
          "Where it starts [nq].")
      .def_prop_ro(
          "v",
          [](const Scene& self) {
            std::vector<double> v = self.initial.velocities;
            v.resize(static_cast<std::size_t>(self.model.tree.shape.velocities));
            return fixed_array(std::move(v));
          },
          "How fast it starts [nv].")
      .def_prop_ro(
          "servos", [](const Scene& self) { return joints_of_rows(self, self.effects.servos); },
          "Joints that a servo drives, in the order of targets, gains and torques.")
      .def_prop_ro(
          "rubbing_joints", [](const Scene& self) { return joints_of_rows(self, self.effects.friction); },
          "Joints with friction, in the order of `friction`.")
      .def_prop_ro("has_ground", [](const Scene& self) { return self.effects.ground.has_value(); })
      .def_prop_ro(
          "limits",
          [](const Scene& self) {
            std::vector<double> numbers;
            for (const JointLimit& limit : self.effects.limits) {
              numbers.insert(numbers.end(), {static_cast<double>(limit.row), limit.lower, limit.upper});
            }
            return fixed_array(std::move(numbers), {self.effects.limits.size(), 3});
          },
          "Limits in effect [n x 3]: row of v, lower, upper [rad, m].")
      .def("__repr__", [](const Scene& self) {
        return fmt::format("<linden.Scene of \"{}\", step {:g} s>", self.model.names.model, self.options.step);
      });

  m.def(
      "load_scene",
      [](const std::string& file, std::optional<std::uint64_t> seed, std::optional<double> spread, std::optional<double> density) {
        const nb::gil_scoped_release release;
        return std::make_shared<Scene>(load_scene(file, {.seed = seed, .spread = spread, .density = density}));
      },
      "file"_a, "seed"_a = nb::none(), "spread"_a = nb::none(), "density"_a = nb::none());
  m.def(
      "scene_of",
      [](const std::shared_ptr<Model>& model, nb::typed<nb::dict, nb::str, nb::any> settings) {
        const std::shared_ptr<const YamlNode> values = scene_values(settings);
        const nb::gil_scoped_release release;
        return std::make_shared<Scene>(scene_of(values, model ? std::optional(*model) : std::nullopt));
      },
      "model"_a.none(), "settings"_a);

  const auto bytes_of = [](const auto& value) {
    const std::string bytes = to_bytes(value);
    return nb::bytes(bytes.data(), bytes.size());
  };
  m.def(
      "model_to_bytes", [bytes_of](const Model& model) { return bytes_of(model); }, "model"_a);
  m.def(
      "scene_to_bytes", [bytes_of](const Scene& scene) { return bytes_of(scene); }, "scene"_a);
  m.def(
      "model_from_bytes",
      [](nb::bytes bytes) {
        return std::make_shared<Model>(model_from_bytes({bytes.c_str(), bytes.size()}));
      },
      "bytes"_a);
  m.def(
      "scene_from_bytes",
      [](nb::bytes bytes) {
        return std::make_shared<Scene>(scene_from_bytes({bytes.c_str(), bytes.size()}));
      },
      "bytes"_a);
}

}  // namespace linden::python
