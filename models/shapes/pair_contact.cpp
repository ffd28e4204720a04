#include "models/shapes/pair_contact.hpp"

#include <algorithm>
#include <set>

#include "layout/effects.hpp"
#include "models/shapes/convex_of.hpp"

namespace linden {

PairContact pair_contact_of(const Model& model, std::vector<std::string>& notes, const LinkPairs& disabled, const LinkPairs& only) {
  PairContact contact;
  contact.shapes = convex_of(model, notes);
  const CollisionPairs pairs(model, disabled);
  std::set<std::pair<std::string, std::string>> named;
  for (const auto& [one, other] : only) {
    place_of(model, one);
    place_of(model, other);
    named.emplace(std::min(one, other), std::max(one, other));
  }
  for (std::uint32_t a = 0; a < contact.shapes.size(); ++a) {
    for (std::uint32_t b = a + 1; b < contact.shapes.size(); ++b) {
      const ConvexBody &one = contact.shapes[a], &other = contact.shapes[b];
      if (one.slot == other.slot) continue;
      const bool touch = named.empty() ? pairs.may_touch(one.slot, one.link, other.slot, other.link)
                                       : named.contains({std::min(one.link, other.link), std::max(one.link, other.link)});
      if (touch) contact.pairs.emplace_back(a, b);
    }
  }
  return contact;
}

}  // namespace linden
