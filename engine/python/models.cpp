// engine/python/models.cpp
// Models: from files, from text and generated; what they are made of.
#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "engine/python/bindings.hpp"
#include "engine/python/numbers.hpp"
#include "engine/scene/load_model.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

using namespace nanobind::literals;

namespace linden::python {
namespace {

std::optional<Base> base_of_text(const std::optional<std::string>& text) { return text ? std::optional(base_from(*text)) : std::nullopt; }

std::vector<std::string> link_names(const Model& model) {
  std::vector<std::pair<Index, std::string>> found;
  for (const auto& [name, place] : model.names.link) found.emplace_back(place.slot, name);
  std::ranges::sort(found);
  std::vector<std::string> names;
  for (auto& [slot, name] : found) names.push_back(std::move(name));
  return names;
}

/// Of bodies 1, 2, ...
std::vector<std::string> without_world(const std::vector<std::string>& names) { return {names.begin() + 1, names.end()}; }

std::vector<Index> parents(const Model& model) {
  std::vector<Index> result;
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) result.push_back(model.tree.parent(slot) - 1);
  return result;
}

std::vector<double> masses(const Model& model) {
  std::vector<double> result;
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) result.push_back(model.constants.inertia(slot, 0));
  return result;
}

}  // namespace

void bind_models(nb::module_& m) {
  nb::class_<Model>(m, "Model",
                    "A tree of bodies, ready to be simulated: what it is made of, not how it moves. It does not change, and any number of "
                    "simulations may share it.")
      .def_prop_ro("name", [](const Model& self) { return self.names.model; })
      .def_prop_ro(
          "nq", [](const Model& self) { return self.tree.shape.positions; }, "Numbers of a configuration q.")
      .def_prop_ro(
          "nv", [](const Model& self) { return self.tree.shape.velocities; }, "Numbers of velocities v.")
      .def_prop_ro("degrees_of_freedom", &Model::degrees_of_freedom, "nv less the joints that follow others.")
      .def_prop_ro(
          "bodies", [](const Model& self) { return without_world(self.names.body); },
          "Names of the bodies in the order of the tree: each is called after the link at its joint.")
      .def_prop_ro(
          "joints", [](const Model& self) { return without_world(self.names.joint); },
          "Names of the moving joints, each that which carries the body of the same place in `bodies`.")
      .def_prop_ro("links", &link_names, "Names of all links, those that are fixed to another body too.")
      .def_prop_ro(
          "q_names", [](const Model& self) { return self.names.position; }, "What each number of q is called [nq].")
      .def_prop_ro(
          "v_names", [](const Model& self) { return self.names.velocity; }, "What each number of v is called [nv].")
      .def_prop_ro("parents", &parents, "Place in `bodies` of the body that carries each; -1: the world.")
      .def_prop_ro(
          "masses", [](const Model& self) { return fixed_array(masses(self)); }, "Of each body [kg].")
      .def_prop_ro(
          "mass", [](const Model& self) { return self.constants.subtree_mass(0); }, "Of all that moves [kg].")
      .def_prop_ro(
          "neutral", [](const Model& self) { return fixed_array(self.neutral()); },
          "The zero configuration [nq]: zeros, quaternions of no turn, mimic joints at their offsets.")
      .def_prop_ro(
          "lower", [](const Model& self) { return fixed_array(self.attributes.lower.flat()); },
          "Lower limits as the file has them [nv; rad, m]; -inf where there is none. They act where a scene names `limits`.")
      .def_prop_ro(
          "upper", [](const Model& self) { return fixed_array(self.attributes.upper.flat()); }, "Upper limits, likewise.")
      .def_prop_ro(
          "max_velocity", [](const Model& self) { return fixed_array(self.attributes.max_velocity.flat()); },
          "Limits of velocity as the file has them [nv; rad/s, m/s].")
      .def_prop_ro(
          "max_effort", [](const Model& self) { return fixed_array(self.attributes.max_effort.flat()); },
          "Limits of effort as the file has them [nv; N m, N].")
      .def_ro("warnings", &Model::warnings, "What the file said that was read with a grain of salt.")
      .def_ro("notes", &Model::notes, "What was done because it was asked for, such as mass from a density.")
      .def("__repr__", [](const Model& self) {
        return fmt::format("<linden.Model \"{}\": {} bodies, nq {}, nv {}>", self.names.model, self.tree.bodies(),
                           self.tree.shape.positions, self.tree.shape.velocities);
      });

  m.def(
      "load_model",
      [](const std::string& name, const std::optional<std::string>& base, std::optional<double> density) {
        const std::optional<Base> root = base_of_text(base);
        const nb::gil_scoped_release release;
        return std::make_shared<Model>(load_model(name, root, density));
      },
      "name"_a, "base"_a = nb::none(), "density"_a = nb::none());
  m.def("needs_contact", &needs_contact, "name"_a);
  m.def(
      "parse_urdf",
      [](const std::string& text, const std::string& source, const std::string& base, std::optional<double> density) {
        const Base root = base_from(base);
        const nb::gil_scoped_release release;
        return std::make_shared<Model>(parse_urdf(text, source, root, Reading::lenient, density));
      },
      "text"_a, "source"_a, "base"_a, "density"_a = nb::none());
}

}  // namespace linden::python
