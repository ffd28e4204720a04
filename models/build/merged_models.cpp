#include "models/build/merged_models.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/build/origin_inertia.hpp"
#include "models/build/vectors.hpp"
#include "models/shapes/mesh_path.hpp"

namespace linden {
namespace {

/// A body before and after.
struct Origin {
  std::size_t part;
  Index slot;
  JointKind kind;
};

class Merger {
 public:
  Merger(const std::vector<PlacedModel>& parts, const std::string& name) : parts_(parts) { model_.names.model = name; }

  Model run() {
    if (parts_.empty()) throw InputError("no models to merge; expected one or more; add a model");
    for (const PlacedModel& part : parts_) {
      if (isometry(part.pose).matrix().allFinite()) continue;
      throw InputError(fmt::format("the pose of model {} is not finite; expected numbers; check its position and rotation", quoted(part.name)));
    }
    hang();
    sort_bodies();
    lay_out();
    for (std::size_t part = 0; part < parts_.size(); ++part) add_names_of_all(part);
    add_shapes();
    return std::move(model_);
  }

 private:
  const Model& model_of(const Origin& origin) const { return parts_[origin.part].model; }
  std::string prefixed(std::size_t part, const std::string& name) const {
    return parts_[part].name.empty() ? name : parts_[part].name + "/" + name;
  }
  Index slot_of(std::size_t part, Index slot) const { return new_slot_[part][static_cast<std::size_t>(slot)]; }
  /// The same where slot 0 is what the model hangs from.
  Index carrying_slot(std::size_t part, Index slot) const {
    return slot == 0 ? slot_of(ground_[part].part, ground_[part].slot) : slot_of(part, slot);
  }

  /// What a model takes for the world: a body of another, or the world itself, and its pose there.
  struct Ground {
    std::size_t part = 0;
    Index slot = 0;
    Isometry pose = Isometry::Identity();
  };

  void hang() {
    std::unordered_map<std::string, Ground> link_of;
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      for (const auto& [link, place] : parts_[part].model.names.link) link_of.emplace(prefixed(part, link), Ground{part, place.slot, isometry(place.in_body)});
    }
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const std::string& parent = parts_[part].parent;
      if (parent.empty()) {
        ground_.push_back({part, 0, Isometry::Identity()});
        continue;
      }
      const auto found = link_of.find(parent);
      if (found == link_of.end())
        fail_to_hang(part, fmt::format("there is no link {}", quoted(parent)), "a link of another model", advice(parent, link_of));
      ground_.push_back(found->second);
      const Tree& tree = parts_[part].model.tree;
      if (std::ranges::any_of(tree.roots(), [&](Index root) { return tree.kind(root) == JointKind::free; }))
        fail_to_hang(part, "its base floats", "a fixed base", "write base: fixed, or let it stand in the world");
    }
    refuse_rings();
    std::vector<bool> placed(parts_.size(), false);
    for (std::size_t part = 0; part < parts_.size(); ++part) place_ground(part, placed);
  }

  /// No chain of models that hang from one another may come back to where it began.
  void refuse_rings() const {
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      std::size_t at = part;
      for (std::size_t count = 0; !parts_[at].parent.empty(); ++count) {
        if (count == parts_.size()) fail_to_hang(part, "it hangs from itself", "a link of another model", "change one parent");
        at = ground_[at].part;
      }
    }
  }

  /// From the link that a model hangs from to the body that carries it: what hangs from a link that is fixed to its model's world hangs
  /// from what that hangs from.
  void place_ground(std::size_t part, std::vector<bool>& placed) {
    if (placed[part]) return;
    Ground& ground = ground_[part];
    if (!parts_[part].parent.empty()) place_ground(ground.part, placed);
    if (!parts_[part].parent.empty() && ground.slot == 0) {
      const Ground& below = ground_[ground.part];
      ground = {below.part, below.slot, below.pose * ground.pose};
    }
    ground.pose = ground.pose * isometry(parts_[part].pose);
    placed[part] = true;
    part_order_.push_back(part);
  }

  template <class Links>
  static std::string advice(const std::string& parent, const Links& link_of) {
    std::vector<std::string> known;
    for (const auto& [link, where] : link_of) known.push_back(link);
    std::ranges::sort(known);
    const std::string guess = nearest(parent, known);
    return guess.empty() ? "write the model's name, a slash and the link" : fmt::format("did you mean {}?", quoted(guess));
  }
  [[noreturn]] void fail_to_hang(std::size_t part, const std::string& found, const char* expected, const std::string& what) const {
    throw InputError(fmt::format("model {} hangs from {}: {}; expected {}; {}", quoted(parts_[part].name), quoted(parts_[part].parent), found,
                                 expected, what));
  }

  void sort_bodies() {
    std::vector<Index> before(parts_.size());
    Index count = 0;
    for (const std::size_t part : part_order_) {
      before[part] = count;
      count += parts_[part].model.tree.bodies();
    }
    new_slot_.resize(parts_.size());
    std::vector<Origin> bodies;
    std::vector<Index> parent;
    std::vector<JointKind> kind;
    for (const std::size_t part : part_order_) {
      const Tree& tree = parts_[part].model.tree;
      new_slot_[part].resize(static_cast<std::size_t>(tree.shape.slots), 0);
      const auto body_of = [&](std::size_t of, Index slot) { return slot == 0 ? -1 : before[of] + slot - 1; };
      for (Index i = 1; i < tree.shape.slots; ++i) {
        bodies.push_back({part, i, tree.kind(i)});
        parent.push_back(tree.parent(i) == 0 ? body_of(ground_[part].part, ground_[part].slot) : body_of(part, tree.parent(i)));
        kind.push_back(tree.kind(i));
      }
    }
    for (const Index body : sorted_bodies(parent, kind)) {
      const Origin& origin = bodies[static_cast<std::size_t>(body)];
      order_.push_back(origin);
      new_slot_[origin.part][static_cast<std::size_t>(origin.slot)] = static_cast<Index>(order_.size());
    }
  }

  void lay_out() {
    std::vector<Index> parent(1, 0);
    std::vector<JointKind> kind(1, JointKind::screw);
    for (const Origin& origin : order_) {
      parent.push_back(carrying_slot(origin.part, model_of(origin).tree.parent(origin.slot)));
      kind.push_back(origin.kind);
    }
    Tree& tree = model_.tree = Tree::from_sorted(parent, kind);
    model_.constants.allocate(tree.shape);
    model_.attributes.allocate(tree.shape);
    for (int row = 0; row < 3; ++row) model_.constants.tree_placement(0, 4 * row) = 1;
    model_.names.body.assign(1, "world");
    model_.names.joint.assign(1, "");
    for (std::size_t k = 0; k < order_.size(); ++k) add_body(order_[k], static_cast<Index>(k) + 1);
    for (std::size_t part = 0; part < parts_.size(); ++part) add_welded(part);
    sum_subtree_masses(tree, model_.constants);
  }

  void add_body(const Origin& origin, Index slot) {
    const Model& from = model_of(origin);
    copy_rows(from.constants, model_.constants, origin.slot, slot, 1);
    if (from.tree.parent(origin.slot) == 0) place_root(ground_[origin.part].pose, slot);
    const Index old_v = from.tree.first_v(origin.slot), old_q = from.tree.first_q(origin.slot);
    copy_rows(from.attributes, model_.attributes, old_v, model_.tree.first_v(slot), velocity_count(origin.kind));

    Names& names = model_.names;
    const auto at = static_cast<std::size_t>(origin.slot);
    names.body.push_back(prefixed(origin.part, from.names.body[at]));
    names.joint.push_back(prefixed(origin.part, from.names.joint[at]));
    for (Index k = 0; k < position_count(origin.kind); ++k) {
      add_coordinate(prefixed(origin.part, from.names.position[static_cast<std::size_t>(old_q + k)]));
    }
    for (Index k = 0; k < velocity_count(origin.kind); ++k) {
      names.velocity.push_back(prefixed(origin.part, from.names.velocity[static_cast<std::size_t>(old_v + k)]));
    }
  }

  static Index slot_of_row(const Tree& tree, Index v_row) {
    Index slot = 1;
    while (tree.first_v(slot) != v_row) ++slot;
    return slot;
  }

  /// What is fixed to a model's world becomes part of what that is.
  void add_welded(std::size_t part) {
    const Index slot = carrying_slot(part, 0);
    const OriginInertia added = OriginInertia(parts_[part].model.welded.inertia).seen_from(Eigen::Isometry3d(ground_[part].pose));
    std::array<double, 10> sum = model_.welded.inertia;
    for (int k = 0; slot > 0 && k < 10; ++k) sum[static_cast<std::size_t>(k)] = model_.constants.inertia(slot, k);
    OriginInertia whole(sum);
    sum = (whole += added).numbers();
    if (slot == 0) model_.welded.inertia = sum;
    for (int k = 0; slot > 0 && k < 10; ++k) model_.constants.inertia(slot, k) = sum[static_cast<std::size_t>(k)];
  }

  /// Rows `from` on of every field of one structure to rows `to` on of another.
  template <class Fields>
  static void copy_rows(const Fields& source, Fields& target, Index from, Index to, Index count) {
    std::vector<const double*> begins;
    Fields::each(source, [&](const char*, const auto& field, Rows, const char*) { begins.push_back(field.flat().data()); });
    std::size_t next = 0;
    Fields::each(target, [&](const char*, auto& field, Rows, const char*) {
      constexpr auto width = static_cast<Index>(std::remove_reference_t<decltype(field)>::components);
      std::copy_n(begins[next++] + from * width, count * width, field.flat().data() + to * width);
    });
  }

  void place_root(const Isometry& pose, Index slot) {
    BodyConstants<double>& constants = model_.constants;
    Isometry root = Isometry::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) root.linear()(row, column) = constants.tree_placement(slot, 3 * row + column);
      root.translation()[row] = constants.tree_placement(slot, 9 + row);
    }
    const Isometry placed = pose * root;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) constants.tree_placement(slot, 3 * row + column) = placed.linear()(row, column);
      constants.tree_placement(slot, 9 + row) = placed.translation()[row];
    }
  }

  void add_coordinate(const std::string& name) {
    if (!coordinates_.insert(name).second) fail("coordinates", name);
    model_.names.position.push_back(name);
  }

  void add_names_of_all(std::size_t part) {
    const Model& from = parts_[part].model;
    for (const auto& [link, place] : from.names.link) {
      // what is fixed to the world moves with the model's idea of it
      const Pose pose = place.slot == 0 ? pose_of(ground_[part].pose * isometry(place.in_body)) : place.in_body;
      const std::string name = prefixed(part, link);
      if (!model_.names.link.emplace(name, LinkPlace{carrying_slot(part, place.slot), pose}).second) fail("links", name);
    }
    for (const auto& [joint, slot] : from.names.slot_of_joint) {
      const std::string name = prefixed(part, joint);
      if (!model_.names.slot_of_joint.emplace(name, slot_of(part, slot)).second) fail("joints", name);
    }
    for (const Mimic& mimic : from.mimics) {
      const Index follower = slot_of(part, mimic.follower_slot), leader = slot_of(part, mimic.leader_slot);
      const Tree& tree = model_.tree;
      model_.mimics.push_back({follower, leader, tree.first_v(follower), tree.first_v(leader), tree.first_q(follower),
                               tree.first_q(leader), mimic.multiplier, mimic.offset});
    }
    for (Coupling coupling : from.couplings) {
      coupling.name = prefixed(part, coupling.name);
      for (const auto& [slot, frame] : {std::pair(&coupling.slot_a, &coupling.frame_a), std::pair(&coupling.slot_b, &coupling.frame_b)}) {
        if (*slot == 0 && coupling.terms.empty()) *frame = pose_of(ground_[part].pose * isometry(*frame));
        *slot = carrying_slot(part, *slot);
      }
      for (CablePoint& point : coupling.points) {
        if (point.slot == 0) point.at = array_of(ground_[part].pose * vector_of(point.at));
        point.slot = carrying_slot(part, point.slot);
      }
      for (GearTerm& term : coupling.terms) {
        const Index slot = slot_of(part, slot_of_row(from.tree, term.v_row));
        term.q_row = model_.tree.first_q(slot);
        term.v_row = model_.tree.first_v(slot);
      }
      model_.couplings.push_back(std::move(coupling));
    }
    const auto said = [&](const std::string& text) { return parts_[part].name.empty() ? text : parts_[part].name + ": " + text; };
    for (const std::string& warning : from.warnings) model_.warnings.push_back(said(warning));
    for (const std::string& fault : from.visual_faults) model_.visual_faults.push_back(said(fault));
    for (const std::string& note : from.notes) model_.notes.push_back(said(note));
  }

  void add_shapes() {
    const std::string& source = parts_.front().model.source;
    const bool one_source = std::ranges::all_of(parts_, [&](const PlacedModel& part) { return part.model.source == source; });
    if (one_source) model_.source = source;
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const Model& from = parts_[part].model;
      const auto own = [&](BodyShape shape) { return carried(std::move(shape), part, !one_source); };
      for (const std::vector<BodyShape>* shapes : {&from.shapes, &from.welded.shapes}) {
        for (const BodyShape& shape : *shapes) {
          BodyShape placed = own(shape);
          (placed.slot == 0 ? model_.welded.shapes : model_.shapes).push_back(std::move(placed));
        }
      }
      for (const std::vector<BodyVisual>* visuals : {&from.visuals, &from.welded.visuals}) {
        for (const BodyVisual& visual : *visuals) {
          BodyShape placed = own(visual.shape);
          (placed.slot == 0 ? model_.welded.visuals : model_.visuals).push_back({std::move(placed), visual.material});
        }
      }
    }
    std::ranges::stable_sort(model_.shapes, {}, &BodyShape::slot);
    std::ranges::stable_sort(model_.visuals, {}, [](const BodyVisual& visual) { return visual.shape.slot; });
  }

  /// A shape of a part on the body that carries it now. `whole_path`: its file is no longer found from the source's name.
  BodyShape carried(BodyShape shape, std::size_t part, bool whole_path) const {
    if (shape.slot == 0) shape.pose = pose_of(ground_[part].pose * isometry(shape.pose));
    shape.slot = carrying_slot(part, shape.slot);
    shape.link = prefixed(part, shape.link);
    if (whole_path && shape.shape.kind == ShapeKind::mesh) {
      if (const std::optional<std::string> file = find_mesh(shape.shape.mesh, parts_[part].model.source)) shape.shape.mesh = *file;
    }
    return shape;
  }

  [[noreturn]] static void fail(const char* what, const std::string& name) {
    throw InputError(
        fmt::format("two {} are called {}; names must be unique; give each model a name of its own", what, quoted(name)));
  }

  const std::vector<PlacedModel>& parts_;
  std::vector<Ground> ground_;           // [part]
  std::vector<std::size_t> part_order_;  // as in the list, but each after what it hangs from
  std::vector<Origin> order_;
  std::vector<std::vector<Index>> new_slot_;  // [part][slot]
  std::unordered_set<std::string> coordinates_;
  Model model_;
};

}  // namespace

Model merged(const std::vector<PlacedModel>& parts, const std::string& name) { return Merger(parts, name).run(); }

}  // namespace linden
