// engine/queries/proximity.hpp
// How far links are apart, which of them touch, and where: of the collision shapes of the robot's file, meshes as their convex hulls.
//
//   const Proximity shapes(model);                               once: it reads the meshes
//   shapes.distance(now, "left_hand", "torso").distance;         now: a Kinematics
//   for (const NearPair& pair : shapes.near(now, 0.01)) ...      all that are less than a centimetre apart, and where
//
// These are questions: bodies push each other where a scene says `contact` (layout/effects/contact.hpp).
//
// The distance of two shapes is that of their nearest points, or less than zero by the least shift that would part them; of links that of the
// nearest pair of their shapes. Only near() leaves pairs out (models/shapes/collision_pairs.hpp): neighbours in the tree, which overlap by design,
// and others like them. Heights of the world, which are not convex, have no one distance: near() tells what is near them, a pair for each normal of
// their surface there.
//
// cost    distance: every pair of shapes of the two links; near: O(n log n) of all shapes and each pair whose boxes meet
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "models/shapes/collision_pairs.hpp"

namespace linden {

/// All in the world's frame.
struct LinkDistance {
  double distance;               // [m]; negative where they overlap
  std::array<double, 3> normal;  // from a to b, unit length
  std::array<double, 3> on_a, on_b;  // the nearest places; where they overlap those that reach the farthest into the other [m]
};

struct NearPoint {
  std::array<double, 3> place;  // midway between both surfaces, world frame [m]
  double gap;                   // along the normal; negative where they overlap [m]
  std::uint64_t feature;        // which corners, edges, faces meet: the same as long as these do
};

/// Two shapes: links that have several may be in more than one of these, and so may one that is near heights of the world along several normals.
struct NearPair {
  std::string link_a, link_b;
  Index slot_a, slot_b;          // bodies that carry them
  std::size_t shape_a, shape_b;  // places among the shapes of the model, those fixed to the world first
  double distance;               // [m]
  std::array<double, 3> normal;  // from a to b, unit length, world frame
  std::vector<NearPoint> points;  // one to four, of heights to 16, those with a gap of no more than the margin, by feature
};

class Proximity {
 public:
  /// Throws InputError, with the nearest name, where `disabled` names a link that the model does not have.
  explicit Proximity(const Model& model, const LinkPairs& disabled = {});
  ~Proximity();
  Proximity(Proximity&&) noexcept;
  Proximity& operator=(Proximity&&) noexcept;

  /// Of two links, neighbours and disabled ones too. Throws InputError for an unknown link, with the nearest name, for one that has no collision
  /// shape, for a link and itself, for two planes, and for heights. state: of the model that this was made of, or an equal one.
  LinkDistance distance(const Kinematics& state, const std::string& link_a, const std::string& link_b) const;

  /// All pairs of shapes that are no farther apart than the margin [m], in the order of their places. Throws InputError for a margin that is
  /// negative or not finite.
  std::vector<NearPair> near(const Kinematics& state, double margin) const;

  /// Which meshes were not found or not read, and so touch nothing, and how many stand as their hulls.
  const std::vector<std::string>& notes() const;

 private:
  struct Shapes;
  std::unique_ptr<Shapes> shapes_;
};

}  // namespace linden
