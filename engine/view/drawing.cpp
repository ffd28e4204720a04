#include "engine/view/drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>

#include "engine/view/drawer.hpp"
#include "engine/view/ground_mesh.hpp"
#include "engine/view/inertia_box.hpp"
#include "engine/view/rods.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

constexpr Colour kPlain{0.72F, 0.72F, 0.74F, 1}, kJoint{0.27F, 0.29F, 0.33F, 1}, kGround{0.68F, 0.68F, 0.66F, 1};
constexpr Colour kCollision{0.2F, 0.5F, 0.85F, 0.35F}, kInertia{0.93F, 0.58F, 0.2F, 0.35F};

/// Of groups whose source gives no colour, one after the other; muted, and of a lightness that stands out from white and from black.
constexpr std::array<Colour, 6> kGroupColours{{{0.36F, 0.50F, 0.67F, 1},
                                              {0.78F, 0.49F, 0.37F, 1},
                                              {0.49F, 0.62F, 0.45F, 1},
                                              {0.80F, 0.65F, 0.38F, 1},
                                              {0.57F, 0.47F, 0.62F, 1},
                                              {0.34F, 0.59F, 0.60F, 1}}};
constexpr float kLighter = 0.4F;  // of the way to white, of every other body up a tree

constexpr double kJointBall = 1.25;  // radius over that of the rod that begins there
constexpr double kLeastReach = 2, kGroundReach = 4;  // [m], and times the reach of the model

class Picture {
 public:
  explicit Picture(const Model& model)
      : model_(model),
        drawer_(model.source, model.tree.bodies()),
        slots_(static_cast<std::size_t>(model.tree.shape.slots)),
        tree_of_(slots_),
        group_of_(slots_),
        shapes_on_(slots_),
        visuals_on_(slots_),
        shown_(slots_, false) {
    Index trees = 0;
    for (Index i = 1; i < model.tree.shape.slots; ++i) {
      const Index parent = model.tree.parent(i);
      tree_of_[at(i)] = parent == 0 ? ++trees : tree_of_[at(parent)];
      group_of_[at(i)] = group_of(model.names.body[at(i)], i);
    }
    for (const std::vector<BodyShape>* shapes : {&model.welded.shapes, &model.shapes}) {
      for (const BodyShape& shape : *shapes) {
        if (shape.shape.kind == ShapeKind::plane || shape.shape.kind == ShapeKind::heights) endless_.push_back(&shape);
        else note(shape, shapes_on_, Looks::shapes);
      }
    }
    for (const std::vector<BodyVisual>* visuals : {&model.welded.visuals, &model.visuals}) {
      for (const BodyVisual& visual : *visuals) note(visual, visuals_on_, Looks::visuals);
    }
  }

  Drawing run(const Effects& effects) {
    for (const std::string& fault : model_.visual_faults) drawer_.tell(fault);
    for (Index slot = 0; slot < model_.tree.shape.slots; ++slot) {
      draw_visuals(slot);
      draw_shapes(slot);
    }
    draw_rods();
    for (Index slot = 0; slot < model_.tree.shape.slots; ++slot) {
      for (const BodyShape* shape : shapes_on_[at(slot)]) {
        if (!drawer_.add(*shape, Layer::collision, kCollision)) drawer_.tell_missing(*shape, "this collision shape is not drawn");
      }
      if (slot > 0) draw_inertia(slot, Layer::inertia, kInertia);
    }
    if (effects.ground) draw_ground(*effects.ground);
    for (const BodyShape* shape : endless_) draw_endless(*shape);
    return drawer_.result();
  }

 private:
  /// What there is to be seen of a group.
  enum class Looks : std::uint8_t { rods, shapes, visuals };

  static std::size_t at(Index slot) { return static_cast<std::size_t>(slot); }
  static const BodyShape& shape_of(const BodyShape& shape) { return shape; }
  static const BodyShape& shape_of(const BodyVisual& visual) { return visual.shape; }

  /// Links of one tree, or fixed to the world, that were one model: merged models call theirs "model/link" (models/build/merged_models.hpp).
  std::size_t group_of(const std::string& link, Index slot) {
    const std::size_t slash = link.find('/');
    const std::string model = slash == link.npos ? "" : link.substr(0, slash);
    const auto [group, is_new] = group_called_.try_emplace({tree_of_[at(slot)], model}, looks_.size());
    if (is_new) looks_.push_back(Looks::rods);
    return group->second;
  }

  template <class Entry>
  void note(const Entry& entry, std::vector<std::vector<const Entry*>>& list, Looks looks) {
    const BodyShape& shape = shape_of(entry);
    list[at(shape.slot)].push_back(&entry);
    Looks& best = looks_[group_of(shape.link, shape.slot)];
    best = std::max(best, looks);
  }

  void draw_visuals(Index slot) {
    std::unordered_map<std::string, std::vector<const BodyVisual*>> missing;  // by link
    std::vector<const BodyVisual*> first_missing;                             // of each link
    for (const BodyVisual* visual : visuals_on_[at(slot)]) {
      if (drawer_.add(visual->shape, Layer::visual, colour_of(visual->material))) {
        shown_[at(slot)] = true;
        continue;
      }
      std::vector<const BodyVisual*>& of_link = missing[visual->shape.link];
      if (of_link.empty()) first_missing.push_back(visual);
      of_link.push_back(visual);
    }
    for (const BodyVisual* visual : first_missing) {
      const std::string instead = draw_instead(visual->shape, colour_of(visual->material));
      for (const BodyVisual* each : missing[visual->shape.link]) drawer_.tell_missing(each->shape, instead);
    }
  }

  /// For visuals of a link that cannot be drawn. Says what was drawn.
  std::string draw_instead(const BodyShape& visual, const Colour& colour) {
    bool drawn = false;
    for (const BodyShape* shape : shapes_on_[at(visual.slot)]) {
      if (shape->link == visual.link && drawer_.add(*shape, Layer::visual, colour)) drawn = true;
    }
    if (drawn) {
      shown_[at(visual.slot)] = true;
      return "its collision shapes are drawn in its place";
    }
    return draw_box_instead(visual.slot, colour);
  }

  std::string draw_box_instead(Index slot, const Colour& colour) {
    if (shown_[at(slot)] || slot == 0 || !draw_inertia(slot, Layer::visual, colour)) return "nothing is drawn in its place";
    shown_[at(slot)] = true;
    return "the box of its body's inertia is drawn in its place";
  }

  void draw_shapes(Index slot) {
    const Colour colour = own_colour(slot);
    std::vector<const BodyShape*> missing;
    for (const BodyShape* shape : shapes_on_[at(slot)]) {
      if (looks_[group_of(shape->link, slot)] != Looks::shapes) continue;
      if (drawer_.add(*shape, Layer::visual, colour)) {
        shown_[at(slot)] = true;
      } else {
        missing.push_back(shape);
      }
    }
    for (const BodyShape* shape : missing) drawer_.tell_missing(*shape, draw_box_instead(slot, colour));
  }

  Colour colour_of(const Material& material) {
    if (!material.texture.empty()) drawer_.tell(fmt::format("texture {} is not drawn", quoted(material.texture)));
    if (!material.rgba) {
      if (!material.name.empty() && material.texture.empty()) {
        drawer_.tell(fmt::format("material {} has no colour and is drawn grey; expected <color rgba=\"...\"/> where it is defined",
                                 quoted(material.name)));
      }
      return kPlain;
    }
    Colour colour;
    std::ranges::transform(*material.rgba, colour.begin(), [](double part) { return static_cast<float>(part); });
    return colour;
  }

  /// Of a body whose source gives none: that of its group, every other one up the tree lighter.
  Colour own_colour(Index slot) const {
    if (slot == 0) return kPlain;
    Colour colour = kGroupColours[group_of_[at(slot)] % kGroupColours.size()];
    for (std::size_t k = 0; k < 3 && model_.tree.level(slot) % 2 == 0; ++k) colour[k] += kLighter * (1 - colour[k]);
    return colour;
  }

  bool draw_inertia(Index slot, Layer layer, const Colour& colour) {
    std::array<double, 10> inertia{};
    for (int k = 0; k < 10; ++k) inertia[static_cast<std::size_t>(k)] = model_.constants.inertia(slot, k);
    const std::optional<InertiaBox> box = inertia_box(inertia);
    if (!box) return false;
    const Seen seen{model_.names.body[at(slot)], slot, layer, colour};
    drawer_.add(Solid::box, seen, isometry(box->pose), {box->edges[0], box->edges[1], box->edges[2]});
    return true;
  }

  void draw_rods() {
    std::vector<std::vector<Index>> children(slots_);
    for (Index i = 1; i < model_.tree.shape.slots; ++i) children[at(model_.tree.parent(i))].push_back(i);
    for (Index i = 1; i < model_.tree.shape.slots; ++i) {
      if (looks_[group_of_[at(i)]] == Looks::rods) draw_rods_of(i, rods_of(model_, i, children[at(i)]));
    }
  }

  void draw_rods_of(Index slot, const BodyRods& rods) {
    const Colour colour = own_colour(slot);
    const Seen rod{model_.names.body[at(slot)], slot, Layer::visual, colour};
    Seen joint = rod;
    if (model_.tree.kind(slot) != JointKind::free) joint.colour = kJoint;
    drawer_.add(Solid::sphere, joint, Isometry::Identity(), Vector3d::Constant(kJointBall * rods.radius));
    for (const Vector3d& end : rods.ends) {
      Isometry pose = Isometry::Identity();
      pose.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), end).toRotationMatrix();
      pose.translation() = end / 2;
      drawer_.add(Solid::cylinder, rod, pose, {rods.radius, rods.radius, end.norm()});
      if (rods.carries) continue;
      pose.translation() = end;
      drawer_.add(Solid::sphere, rod, pose, Vector3d::Constant(rods.radius));
    }
  }

  /// How far what has no end is drawn [m].
  double ground_reach() const {
    std::vector<double> reach(slots_, 0);
    double farthest = kLeastReach;
    for (Index i = 1; i < model_.tree.shape.slots; ++i) {
      const BodyConstants<double>& constants = model_.constants;
      reach[at(i)] = reach[at(model_.tree.parent(i))] +
                     Vector3d(constants.tree_placement(i, 9), constants.tree_placement(i, 10), constants.tree_placement(i, 11)).norm();
      farthest = std::max(farthest, reach[at(i)]);
    }
    return kGroundReach * farthest;
  }

  void draw_ground(const Ground& ground) {
    GroundMesh mesh = ground_mesh(ground, ground_reach());
    if (mesh.step > 1) drawer_.tell(fmt::format("the terrain is drawn by one in {} of its points along x and y", mesh.step));
    drawer_.add(std::move(mesh.mesh), {"ground", 0, Layer::ground, kGround}, isometry(mesh.pose));
  }

  /// A plane about its place that is nearest to the world's origin, heights where they are.
  void draw_endless(const BodyShape& shape) {
    Ground ground;
    const std::array<double, 9>& R = shape.pose.rotation;
    const std::array<double, 3>& p = shape.pose.shift;
    ground.normal = {R[2], R[5], R[8]};
    ground.height = R[2] * p[0] + R[5] * p[1] + R[8] * p[2];
    if (shape.shape.heights) ground.terrain = *shape.shape.heights;
    GroundMesh mesh = ground_mesh(ground, ground_reach());
    if (mesh.step > 1) drawer_.tell(fmt::format("{} is drawn by one in {} of its points along x and y", shape.link, mesh.step));
    drawer_.add(std::move(mesh.mesh), {shape.link, 0, Layer::ground, kGround}, isometry(shape.shape.heights ? shape.pose : mesh.pose));
  }

  const Model& model_;
  Drawer drawer_;
  std::size_t slots_;
  std::vector<Index> tree_of_;         // [slots] 1, 2, ...; 0: fixed to the world
  std::vector<std::size_t> group_of_;  // [slots] of the body; none of slot 0
  std::vector<Looks> looks_;           // [groups]
  std::map<std::pair<Index, std::string>, std::size_t> group_called_;
  std::vector<std::vector<const BodyShape*>> shapes_on_;    // [slots]; not those without end
  std::vector<const BodyShape*> endless_;
  std::vector<std::vector<const BodyVisual*>> visuals_on_;  // [slots]
  std::vector<bool> shown_;  // [slots] something of it is in the visual layer
};

}  // namespace

Drawing drawing_of(const Model& model, const Effects& effects) { return Picture(model).run(effects); }

}  // namespace linden
