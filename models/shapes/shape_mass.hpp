// models/shapes/shape_mass.hpp
// Mass and inertia of links that a robot's file gives none, from their shapes and one density. Only where it is asked for.
//
//   sphere     V = 4/3 pi r^3             I = 2/5 m r^2
//   box        V = x y z                  I_xx = m (y^2 + z^2) / 12
//   cylinder   V = pi r^2 l               I_zz = m r^2 / 2, I_xx = m (3 r^2 + l^2) / 12
//   capsule    the cylinder, and a ball in two halves at its ends: I_zz = 2/5 m r^2, I_xx = m (2/5 r^2 + l^2 / 4 + 3/8 l r)
//   mesh       the solid that it encloses where it is closed (models/shapes/mesh_solid.hpp), else the box about it
//
// Shapes of one link add up, also where they overlap. A link's collision shapes are taken, or where these give no mass its visual ones.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "models/build/builder.hpp"
#include "models/shapes/mesh_solid.hpp"

namespace linden {

/// Mass and inertia of one shape that is no mesh, in the frame that its pose is given in. density [kg/m^3]
LinkInertia shape_inertia(const LinkShape& shape, double density);

class ShapeMass {
 public:
  /// `source`: the robot's file, which names of meshes are relative to. Throws InputError for a density that is not above zero and finite.
  ShapeMass(double density, std::string source);

  /// Of a link without inertia; massless where its shapes have no volume or it has none.
  LinkInertia of(const std::string& link, const std::vector<LinkShape>& collision, const std::vector<LinkVisual>& visual);

  /// What was done for all links so far, in one sentence.
  std::string note() const;
  /// Meshes that were not found or could not be read, a sentence each.
  const std::vector<std::string>& troubles() const { return troubles_; }

 private:
  LinkInertia sum_of(const std::string& link, const std::vector<LinkShape>& shapes);
  LinkInertia mesh_inertia(const std::string& link, const LinkShape& shape);

  double density_;
  std::string source_;
  std::vector<std::string> troubles_;
  std::map<std::string, MeshSolid> read_;  // by file and scale: links share meshes
  std::vector<std::string> boxes_;         // meshes that are not closed
  int links_ = 0, of_visuals_ = 0, without_ = 0;
  std::string largest_;
  double largest_mass_ = 0, all_ = 0;
};

}  // namespace linden
