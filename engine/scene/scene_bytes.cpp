#include "engine/scene/scene_bytes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "layout/archive.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

template <>
inline constexpr JointKind kLastOf<JointKind> = JointKind::free;
template <>
inline constexpr CouplingKind kLastOf<CouplingKind> = static_cast<CouplingKind>(kCouplingKinds - 1);
template <>
inline constexpr ShapeKind kLastOf<ShapeKind> = ShapeKind::heights;
template <>
inline constexpr ConvexKind kLastOf<ConvexKind> = ConvexKind::heights;
template <>
inline constexpr Solver kLastOf<Solver> = Solver::riqn;
template <>
inline constexpr FirstGuess kLastOf<FirstGuess> = FirstGuess::ig3;
template <>
inline constexpr StopTest kLastOf<StopTest> = StopTest::absolute;

namespace {

constexpr std::string_view kModelLine = "linden model 4\n", kAnyModel = "linden model ";
constexpr std::string_view kSceneLine = "linden scene 5\n", kAnyScene = "linden scene ";

template <class T>
std::string bytes_of(const T& value) {
  BytesOut out;
  out.add(value);
  return out.bytes();
}

/// What every model that was built keeps, and its sweeps rely on.
class ModelCheck {
 public:
  ModelCheck(const Model& model, const std::string& name) : model_(model), name_(name), tree_(model.tree) {}

  void run() const {
    check_tree();
    each_field(model_.constants, [](double value) { return std::isfinite(value); });
    each_field(model_.attributes, [](double value) { return !std::isnan(value); });
    check_names();
    check_mimics();
    check_couplings();
    for (const BodyShape& shape : model_.shapes) check_shape(shape);
    for (const BodyVisual& visual : model_.visuals) check_shape(visual.shape);
    for (const BodyShape& shape : model_.welded.shapes) check_welded_shape(shape);
    for (const BodyVisual& visual : model_.welded.visuals) check_welded_shape(visual.shape);
  }

 private:
  void require(bool holds, const char* what) const {
    if (!holds) throw InputError(fmt::format("{}: the bytes hold {}; expected a model that to_bytes wrote; write it again", name_, what));
  }
  void check_place(const Pose& pose) const {
    const auto is_finite = [](double number) { return std::isfinite(number); };
    require(std::ranges::all_of(pose.rotation, is_finite) && std::ranges::all_of(pose.shift, is_finite), "a place that is not finite");
  }
  void check_shape(const BodyShape& shape) const {
    require(moves(shape.slot), "a shape of a body that there is not");
    require(!is_of_world_alone(shape.shape.kind), "a shape of the world on a body that moves");
    check_place(shape.pose);
  }
  void check_welded_shape(const BodyShape& shape) const {
    require(shape.slot == 0, "a fixed shape on a body that moves");
    require((shape.shape.kind == ShapeKind::heights) == (shape.shape.heights != nullptr), "heights of a shape that has none, or the other way round");
    require(!shape.shape.heights || is_whole(*shape.shape.heights), "heights that are no grid");
    check_place(shape.pose);
  }
  bool moves(Index slot) const { return slot > 0 && slot < tree_.shape.slots; }

  /// The tree follows from parents and kinds of joints.
  void check_tree() const {
    std::vector<JointKind> kinds{JointKind::screw};
    for (const Run& run : tree_.runs) {
      const bool follows = run.begin == static_cast<Index>(kinds.size()) && run.end > run.begin && run.end <= tree_.parent.rows();
      require(follows, "joints out of order");
      kinds.resize(static_cast<std::size_t>(run.end), run.kind);
    }
    const std::vector<Index> parents(tree_.parent.flat().begin(), tree_.parent.flat().end());
    require(parents.size() == kinds.size(), "another number of joints than of bodies");
    for (std::size_t i = 1; i < parents.size(); ++i) {
      require(parents[i] >= 0 && parents[i] < static_cast<Index>(i), "a body that comes before the one it hangs on");
    }
    require(bytes_of(tree_) == bytes_of(Tree::from_sorted(parents, kinds)), "a tree that does not follow from its joints");
  }
  template <class Structure, class Sound>
  void each_field(const Structure& structure, const Sound& sound) const {
    Structure::each(structure, [&](const char* name, const auto& field, Rows rows, const char*) {
      require(field.rows() == tree_.shape.rows(rows), name);
      require(std::ranges::all_of(field.flat(), sound), name);
    });
  }
  void check_names() const {
    const Names& names = model_.names;
    const auto count = [](const auto& list) { return static_cast<Index>(list.size()); };
    require(count(names.body) == tree_.shape.slots && count(names.joint) == tree_.shape.slots, "another number of names than of bodies");
    require(count(names.position) == tree_.shape.positions, "another number of names than of positions");
    require(count(names.velocity) == tree_.shape.velocities, "another number of names than of velocities");
    for (const auto& [link, place] : names.link) {
      require(place.slot == 0 || moves(place.slot), "a link on a body that there is not");
      check_place(place.in_body);
    }
    for (const auto& [joint, slot] : names.slot_of_joint) require(moves(slot), "a joint of a body that there is not");
  }
  void check_mimics() const {
    const auto is_screw = [&](Index slot, Index v, Index q) {
      return moves(slot) && tree_.kind(slot) == JointKind::screw && tree_.first_v(slot) == v && tree_.first_q(slot) == q;
    };
    std::set<Index> followers;
    for (const Mimic& mimic : model_.mimics) {
      require(is_screw(mimic.follower_slot, mimic.follower_v, mimic.follower_q), "a tie of a joint that there is not");
      require(is_screw(mimic.leader_slot, mimic.leader_v, mimic.leader_q), "a tie to a joint that there is not");
      require(std::isfinite(mimic.multiplier) && std::isfinite(mimic.offset), "a tie with a number that is not finite");
      require(followers.insert(mimic.follower_slot).second, "a joint that follows twice");
    }
    for (const Mimic& mimic : model_.mimics) require(!followers.contains(mimic.leader_slot), "a joint that follows one that follows");
  }
  void check_couplings() const {
    for (const Coupling& coupling : model_.couplings) {
      const bool cable = coupling.kind == CouplingKind::cable, gear = coupling.kind == CouplingKind::gear || cable;
      require(gear != coupling.terms.empty() && (!cable || (coupling.terms.size() == 1 && coupling.points.size() > 1)), "a coupling without what it couples");
      for (const CablePoint& point : coupling.points) {
        require(point.slot == 0 || moves(point.slot), "a cable through a body that there is not");
        for (const double number : point.at) require(std::isfinite(number), "a cable through a point that is not finite");
      }
      for (const Index slot : {coupling.slot_a, coupling.slot_b}) require(slot == 0 || moves(slot), "a coupling of a body that there is not");
      require(gear || coupling.slot_a != coupling.slot_b, "a coupling of a body with itself");
      check_place(coupling.frame_a);
      check_place(coupling.frame_b);
      require(std::isfinite(coupling.length) && std::isfinite(coupling.offset), "a coupling with a number that is not finite");
      for (const Compliances* laws : {&coupling.shift, &coupling.turn}) {
        const auto is_sound = [](const Compliance& law) { return law.stiffness >= 0 && law.damping >= 0 && std::isfinite(law.stiffness + law.damping); };
        require(std::ranges::all_of(*laws, is_sound), "a spring or damper of a coupling that is below zero or not finite");
      }
      require(!rows_of(coupling).empty(), "a coupling that holds nothing");
      for (const GearTerm& term : coupling.terms) {
        bool is_screw = false;
        for (Index i = 1; i < tree_.shape.slots; ++i) {
          is_screw |= tree_.kind(i) == JointKind::screw && tree_.first_v(i) == term.v_row && tree_.first_q(i) == term.q_row;
        }
        require(is_screw && std::isfinite(term.ratio) && term.ratio != 0, "a gear or cable of a joint that there is not");
      }
    }
  }

  const Model& model_;
  const std::string& name_;
  const Tree& tree_;
};

template <class T>
T value_from(std::string_view bytes, const std::string& name) {
  T value{};
  BytesIn in(bytes, name);
  in.read(value);
  in.end();
  return value;
}

}  // namespace

std::string to_bytes(const Model& model) { return sealed(kModelLine, bytes_of(model)); }

std::string to_bytes(const Scene& scene) { return sealed(kSceneLine, bytes_of(scene)); }

Model model_from_bytes(std::string_view bytes, const std::string& name) {
  Model model = value_from<Model>(unsealed(kModelLine, kAnyModel, "model", bytes, name), name);
  ModelCheck(model, name).run();
  return model;
}

Scene scene_from_bytes(std::string_view bytes, const std::string& name) {
  Scene scene = value_from<Scene>(unsealed(kSceneLine, kAnyScene, "scene", bytes, name), name);
  ModelCheck(scene.model, name).run();
  check(scene.options);
  check(scene.effects, scene.model);
  return scene;
}

}  // namespace linden
