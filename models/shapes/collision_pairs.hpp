// models/shapes/collision_pairs.hpp
// Which links may touch each other. Not looked at are
//
//   - links of one body
//   - neighbours in the tree: the bodies on both sides of a joint, of any kind but a free one, which overlap where it sits; so what is fixed to the
//     world and a body that hangs on the world; but shapes that stand there of themselves (models/build/world_shapes.hpp) have no neighbours
//   - bodies that a coupling ties; gears tie coordinates, cables, rods and springs run between bodies, so these do not
//     count
//   - links that a caller names, as SRDF files do
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "layout/model.hpp"

namespace linden {

using LinkPairs = std::vector<std::pair<std::string, std::string>>;

/// The pairs that an SRDF file disables: <disable_collisions link1="" link2=""/>. All else in it is left aside. Throws InputError for a file that is
/// not there or is no XML, and for such an element without both names.
LinkPairs srdf_disabled_pairs(const std::string& file);

class CollisionPairs {
 public:
  /// Throws InputError, with the nearest name, where a pair names a link that the model does not have.
  explicit CollisionPairs(const Model& model, const LinkPairs& disabled = {});

  /// Whether shapes of these links, on bodies of these slots, may touch.
  bool may_touch(Index slot_a, const std::string& link_a, Index slot_b, const std::string& link_b) const;

 private:
  std::vector<Index> parent_;
  std::set<std::pair<Index, Index>> tied_;                      // the lower slot first
  std::set<std::pair<std::string, std::string>> disabled_;  // in the order of the alphabet
};

}  // namespace linden
