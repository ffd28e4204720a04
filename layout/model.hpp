// layout/model.hpp
// A tree ready to be simulated: topology, constants, names. Immutable once built; shared by any number of simulations.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "layout/attributes.hpp"
#include "layout/body_constants.hpp"
#include "layout/couplings.hpp"
#include "layout/names.hpp"
#include "layout/shapes.hpp"
#include "layout/tree.hpp"

namespace linden {

/// What is fixed to the world, in its frame: it moves nothing and is no part of subtree_mass, but where the model is hung from a link that
/// moves (models/build/merged_models.hpp).
struct Welded {
  std::array<double, 10> inertia{};  // m [kg], m c [kg m], xx xy xz yy yz zz about the origin [kg m^2]
  std::vector<BodyShape> shapes;     // of slot 0
  std::vector<BodyVisual> visuals;   // of slot 0

  double mass() const { return inertia[0]; }
};

struct Model {
  Tree tree;
  BodyConstants<double> constants;
  Attributes attributes;
  std::vector<Mimic> mimics;
  std::vector<Coupling> couplings;
  Names names;
  std::string source;                      // file it was read from, which names of meshes are relative to; empty = made in code
  std::vector<BodyShape> shapes;           // sorted by slot; none of slot 0
  std::vector<BodyVisual> visuals;         // sorted by slot; none of slot 0
  std::vector<std::string> warnings;       // what the source said that was read with a grain of salt
  std::vector<std::string> visual_faults;  // what the source said of visuals and was left out: to be told where the model is looked at
  std::vector<std::string> notes;          // what was done because it was asked for, such as mass from a density
  Welded welded;                           // links fixed to the world

  /// Free coordinates: velocities less the mimic joints.
  Index degrees_of_freedom() const { return tree.shape.velocities - static_cast<Index>(mimics.size()); }

  /// Zero configuration [nq]: zeros, identity quaternions, mimic joints at their offsets, cables at their lengths.
  std::vector<double> neutral() const;

  /// Hash of everything the motion depends on (topology, constants, mimics, couplings): a checkpoint belongs to one hash. Shapes and
  /// visuals move nothing by themselves and are not in it.
  std::uint64_t hash() const;
};

/// Throws InputError with the first warning of a model that has any.
void refuse_warnings(const Model& model);

}  // namespace linden
