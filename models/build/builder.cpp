#include "models/build/builder.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_set>

#include "layout/support/words.hpp"
#include "models/build/dependent_joint.hpp"
#include "models/build/link_check.hpp"
#include "models/build/origin_inertia.hpp"

namespace linden {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A joint is taken to move nothing when the inertia it feels is below this share of what its subtree could have.
constexpr double kMovesNothing = 1e-14;

/// What else there is for links without mass, behind the advice to give them one.
constexpr const char* kWayOut =
    "; links that have shapes and no inertia get one by --density 1000, in a scene by inertia: {density: 1000}";

/// A moving body before sorting: parents are indices into the same list, -1 the world.
struct Body {
  std::string link, joint;
  int parent = -1;
  JointKind kind = JointKind::screw;
  double turn = 0, shift = 0;
  Isometry3d placement;  // body frame at q = 0 in the parent's body frame
  OriginInertia inertia;
  const LinkSpec* spec = nullptr;
};

/// Rotation whose z axis is `axis`; exact for coordinate axes.
Matrix3d frame_with_z(const Vector3d& axis) {
  int largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  const Vector3d helper = Vector3d::Unit((largest + 1) % 3);
  Matrix3d frame;
  frame.col(2) = axis;
  frame.col(0) = (helper - helper.dot(axis) * axis).normalized();
  frame.col(1) = axis.cross(frame.col(0));
  return frame;
}

Isometry3d turned_by(const Matrix3d& rotation) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = rotation;
  return pose;
}

class Build {
 public:
  Build(const std::string& name, const std::string& source, const std::vector<LinkSpec>& links,
        const std::vector<std::string>& warnings, bool may_stand_still)
      : source_(source.empty() ? name : source), links_(links), may_stand_still_(may_stand_still), carrier_(links.size()) {
    model_.names.model = name;
    model_.source = source;
    model_.warnings = warnings;
  }

  Model run() {
    index_names();
    order_links();
    for (const std::size_t link : order_) {
      check(links_[link], source_, model_.warnings);
      place(link);
    }
    if (bodies_.empty() && !may_stand_still_) fail("nothing moves: every joint is fixed; at least one moving joint is needed");
    check_bodies();
    sort_bodies();
    lay_out();
    collect_shapes();
    check_coordinate_names();
    resolve_mimics();
    check_moved_inertia();
    check_independence();
    return std::move(model_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw InputError(source_ + ": " + message); }

  void index_names() {
    for (std::size_t i = 0; i < links_.size(); ++i) {
      if (!link_at_.emplace(links_[i].name, i).second) {
        fail(fmt::format("two links are called {}; names must be unique", quoted(links_[i].name)));
      }
      if (!joint_at_.emplace(links_[i].joint, i).second) {
        fail(fmt::format("two joints are called {}; names must be unique", quoted(links_[i].joint)));
      }
    }
  }

  /// Breadth first from the roots, without recursion.
  void order_links() {
    std::vector<std::vector<std::size_t>> children(links_.size());
    for (std::size_t i = 0; i < links_.size(); ++i) {
      if (links_[i].parent.empty()) {
        order_.push_back(i);
        continue;
      }
      const auto parent = link_at_.find(links_[i].parent);
      if (parent == link_at_.end()) {
        fail(fmt::format("joint {}: its parent link {} does not exist", quoted(links_[i].joint), quoted(links_[i].parent)));
      }
      children[parent->second].push_back(i);
    }
    for (std::size_t next = 0; next < order_.size(); ++next) {
      const std::vector<std::size_t>& below = children[order_[next]];
      order_.insert(order_.end(), below.begin(), below.end());
    }
    if (order_.size() == links_.size()) return;
    std::vector<bool> reached(links_.size(), false);
    for (const std::size_t link : order_) reached[link] = true;
    const auto lost = static_cast<std::size_t>(std::find(reached.begin(), reached.end(), false) - reached.begin());
    fail(fmt::format("link {} hangs in a loop of joints that never reaches the world; cut the loop at one joint",
                     quoted(links_[lost].name)));
  }

  Vector3d unit_axis(const LinkSpec& link) const {
    const double length = link.axis.norm();
    if (!(length > 1e-9)) {
      fail(fmt::format("joint {}: its axis ({} {} {}) has no direction", quoted(link.joint), link.axis.x(), link.axis.y(),
                       link.axis.z()));
    }
    return std::abs(length - 1) < 1e-15 ? link.axis : Vector3d(link.axis / length);
  }

  /// Gives the link a body of its own, or makes it part of its parent's.
  void place(std::size_t at) {
    const LinkSpec& link = links_[at];
    const Carrier parent = link.parent.empty() ? Carrier{} : carrier_[link_at_.at(link.parent)];
    const Isometry3d joint = parent.pose * link.placement;
    if (!joint.matrix().allFinite()) {
      const std::string from = parent.body < 0 ? "the world" : quoted(bodies_[static_cast<std::size_t>(parent.body)].link);
      fail(fmt::format("joint {}: it lies too far from {} for numbers; expected metres; check the origins of the fixed joints "
                       "between them",
                       quoted(link.joint), from));
    }
    if (link.type == JointType::fixed) {
      carrier_[at] = {parent.body, joint};
      if (parent.body >= 0) {
        bodies_[static_cast<std::size_t>(parent.body)].inertia += OriginInertia(link.inertia, joint);
      } else {
        welded_ += OriginInertia(link.inertia, joint);
      }
      return;
    }
    if (link.type == JointType::ball || link.type == JointType::free) {
      append(link, parent.body, joint, link.type == JointType::ball ? JointKind::ball : JointKind::free, 0, 0);
      carry(at, Isometry3d::Identity());
      return;
    }
    const Isometry3d turned = turned_by(frame_with_z(unit_axis(link)));
    if (link.type == JointType::planar) {
      // Slide along x, slide along y, turn about z of the plane's frame. Cyclic turns bring x and y to z exactly.
      const Isometry3d x_up = turned_by(frame_with_z(Vector3d::UnitX()));
      const Isometry3d y_up = turned_by(frame_with_z(Vector3d::UnitY()));
      append(link, parent.body, joint * turned * x_up, JointKind::screw, 0, 1, ".x");
      append(link, last_body(), x_up.inverse() * y_up, JointKind::screw, 0, 1, ".y");
      append(link, last_body(), y_up.inverse(), JointKind::screw, 1, 0, ".turn");
      bodies_.back().link = link.name;
    } else {
      const bool turns = link.type != JointType::prismatic;
      const double shift = link.type == JointType::revolute ? 0 : link.type == JointType::prismatic ? 1 : link.pitch;
      append(link, parent.body, joint * turned, JointKind::screw, turns ? 1 : 0, shift);
    }
    carry(at, turned.inverse());
  }

  /// Inertias are judged once all that is fixed to a body is part of it.
  void check_bodies() const {
    std::vector<double> reach(bodies_.size(), 0);
    for (const Body& body : bodies_) {
      if (body.parent < 0) continue;
      double& farthest = reach[static_cast<std::size_t>(body.parent)];
      farthest = std::max(farthest, body.placement.translation().norm());
    }
    for (std::size_t k = 0; k < bodies_.size(); ++k) check_body(bodies_[k].link, bodies_[k].inertia, reach[k], source_);
  }

  int last_body() const { return static_cast<int>(bodies_.size()) - 1; }

  void append(const LinkSpec& link, int parent, const Isometry3d& placement, JointKind kind, double turn, double shift,
              const std::string& part = "") {
    Body body;
    body.joint = link.joint + part;
    body.link = part.empty() ? link.name : body.joint;  // the massless bodies within a planar joint have no link of their own
    body.parent = parent;
    body.kind = kind;
    body.turn = turn;
    body.shift = shift;
    body.placement = placement;
    body.spec = &link;
    bodies_.push_back(std::move(body));
  }

  /// The last body carries link `at`; `pose` is the link's frame in the body's.
  void carry(std::size_t at, const Isometry3d& pose) {
    carrier_[at] = {last_body(), pose};
    bodies_.back().inertia += OriginInertia(links_[at].inertia, pose);
  }

  void sort_bodies() {
    std::vector<Index> parent;
    std::vector<JointKind> kind;
    for (const Body& body : bodies_) {
      parent.push_back(body.parent);
      kind.push_back(body.kind);
    }
    slot_of_body_.resize(bodies_.size());
    body_in_slot_.assign(1, -1);
    for (const Index body : sorted_bodies(parent, kind)) {
      slot_of_body_[static_cast<std::size_t>(body)] = static_cast<Index>(body_in_slot_.size());
      body_in_slot_.push_back(body);
    }
  }

  Index slot_of(int body) const { return body < 0 ? 0 : slot_of_body_[static_cast<std::size_t>(body)]; }
  const Body& in_slot(Index slot) const {
    return bodies_[static_cast<std::size_t>(body_in_slot_[static_cast<std::size_t>(slot)])];
  }

  void lay_out() {
    const auto slots = static_cast<Index>(body_in_slot_.size());
    std::vector<Index> parent(static_cast<std::size_t>(slots), 0);
    std::vector<JointKind> kind(static_cast<std::size_t>(slots), JointKind::screw);
    for (Index i = 1; i < slots; ++i) {
      parent[static_cast<std::size_t>(i)] = slot_of(in_slot(i).parent);
      kind[static_cast<std::size_t>(i)] = in_slot(i).kind;
    }
    Tree& tree = model_.tree = Tree::from_sorted(parent, kind);
    BodyConstants<double>& constants = model_.constants;
    constants.allocate(tree.shape);
    model_.attributes.allocate(tree.shape);
    Names& names = model_.names;
    names.body.assign(1, "world");
    names.joint.assign(1, "");
    for (int row = 0; row < 3; ++row) constants.tree_placement(0, 4 * row) = 1;
    for (Index i = 1; i < slots; ++i) {
      const Body& body = in_slot(i);
      constants.screw(i, 0) = body.turn;
      constants.screw(i, 1) = body.shift;
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          constants.tree_placement(i, 3 * row + column) = body.placement.linear()(row, column);
        }
        constants.tree_placement(i, 9 + row) = body.placement.translation()[row];
      }
      const std::array<double, 10> inertia = body.inertia.numbers();
      for (int k = 0; k < 10; ++k) constants.inertia(i, k) = inertia[static_cast<std::size_t>(k)];
      names.body.push_back(body.link);
      names.joint.push_back(body.joint);
      name_coordinates(body);
      set_attributes(i, body);
    }
    model_.welded.inertia = welded_.numbers();
    sum_subtree_masses(tree, constants);
    for (std::size_t link = 0; link < links_.size(); ++link) {
      names.link[links_[link].name] = {slot_of(carrier_[link].body), pose_of(carrier_[link].pose)};
      if (links_[link].type != JointType::fixed) names.slot_of_joint[links_[link].joint] = slot_of(carrier_[link].body);
    }
  }

  void collect_shapes() {
    for (std::size_t link = 0; link < links_.size(); ++link) {
      for (const LinkShape& shape : links_[link].shapes) {
        std::optional<BodyShape> placed = carried(link, shape);
        if (!placed) {
          fail(fmt::format("link {}: a collision shape lies too far away for numbers; expected metres; check its origin",
                           quoted(links_[link].name)));
        }
        (placed->slot == 0 ? model_.welded.shapes : model_.shapes).push_back(std::move(*placed));
      }
      for (const LinkVisual& visual : links_[link].visuals) {
        std::optional<BodyShape> placed = carried(link, visual.shape);
        if (!placed) {
          model_.visual_faults.push_back(fmt::format("{}: link {}: a visual lies too far away for numbers; it is left out; check its origin",
                                                     source_, quoted(links_[link].name)));
          continue;
        }
        (placed->slot == 0 ? model_.welded.visuals : model_.visuals).push_back({std::move(*placed), visual.material});
      }
    }
    std::ranges::stable_sort(model_.shapes, {}, &BodyShape::slot);
    std::ranges::stable_sort(model_.visuals, {}, [](const BodyVisual& visual) { return visual.shape.slot; });
  }

  /// A shape of a link on the body that carries it; nothing where its place is no number.
  std::optional<BodyShape> carried(std::size_t link, const LinkShape& shape) const {
    const Isometry3d pose(carrier_[link].pose * isometry(shape.pose));
    if (!pose.matrix().allFinite()) return std::nullopt;
    return BodyShape{slot_of(carrier_[link].body), links_[link].name, pose_of(pose), shape.shape};
  }

  void name_coordinates(const Body& body) {
    const auto extend = [&](std::vector<std::string>& list, std::initializer_list<const char*> endings) {
      for (const char* ending : endings) list.push_back(body.joint + ending);
    };
    Names& names = model_.names;
    if (body.kind == JointKind::screw) {
      names.position.push_back(body.joint);
      names.velocity.push_back(body.joint);
    } else if (body.kind == JointKind::ball) {
      extend(names.position, {".qx", ".qy", ".qz", ".qw"});
      extend(names.velocity, {".wx", ".wy", ".wz"});
    } else {
      extend(names.position, {".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"});
      extend(names.velocity, {".wx", ".wy", ".wz", ".vx", ".vy", ".vz"});
    }
  }

  /// A planar joint "j" beside a joint "j.x" would make two columns of one name.
  void check_coordinate_names() const {
    std::unordered_set<std::string> seen;
    for (const std::string& name : model_.names.position) {
      if (!seen.insert(name).second) fail(fmt::format("two coordinates are called {}; rename one of their joints", quoted(name)));
    }
  }

  void set_attributes(Index slot, const Body& body) {
    const LinkSpec& spec = *body.spec;
    for (Index k = 0; k < velocity_count(body.kind); ++k) {
      const Index row = model_.tree.first_v(slot) + k;
      model_.attributes.lower(row) = spec.limits.lower;
      model_.attributes.upper(row) = spec.limits.upper;
      model_.attributes.max_velocity(row) = spec.limits.velocity;
      model_.attributes.max_effort(row) = spec.limits.effort;
      model_.attributes.damping(row) = spec.damping;
      model_.attributes.friction(row) = spec.friction;
    }
  }

  /// Every joint must feel some inertia: that of its subtree, all joints below held at zero. Of a coordinate that moves several joints
  /// one of them must.
  void check_moved_inertia() const {
    std::vector<OriginInertia> composite(body_in_slot_.size());
    std::vector<bool> moves(body_in_slot_.size(), false);
    std::vector<Index> leader(body_in_slot_.size(), 0);
    for (const Mimic& mimic : model_.mimics) {
      leader[static_cast<std::size_t>(mimic.follower_slot)] = leader[static_cast<std::size_t>(mimic.leader_slot)] = mimic.leader_slot;
    }
    for (Index i = model_.tree.bodies(); i > 0; --i) {
      const Body& body = in_slot(i);
      OriginInertia& whole = composite[static_cast<std::size_t>(i)];
      whole += body.inertia;
      const double scale = whole.about_origin.trace();
      if (!std::isfinite(whole.mass) || !whole.moment.allFinite() || !whole.about_origin.allFinite() || !std::isfinite(scale)) {
        fail(fmt::format("joint {}: link {} and all below it are too heavy or too large for numbers; expected kilograms and "
                         "metres; check their masses, inertias and origins",
                         quoted(body.joint), quoted(body.link)));
      }
      double felt = 0, possible = scale;
      if (body.kind == JointKind::screw) {
        felt = body.turn * body.turn * whole.about_origin(2, 2) + body.shift * body.shift * whole.mass;
        possible = body.turn * body.turn * scale + body.shift * body.shift * whole.mass;
      } else {
        // A free joint turns its body about the centre of mass, a ball joint about the joint.
        Matrix3d about = whole.about_origin;
        if (body.kind == JointKind::free && whole.mass > 0) {
          about -= OriginInertia::parallel_axis(whole.mass, whole.moment / whole.mass);
        }
        felt = Eigen::SelfAdjointEigenSolver<Matrix3d>(about, Eigen::EigenvaluesOnly).eigenvalues()[0];
        if (body.kind == JointKind::free && whole.mass == 0) felt = 0;
      }
      moves[static_cast<std::size_t>(i)] = felt > kMovesNothing * possible;
      if (!moves[static_cast<std::size_t>(i)] && leader[static_cast<std::size_t>(i)] == 0) {
        fail(fmt::format("joint {} moves nothing that resists: link {} and all below it have a mass of {:.3g} kg and an "
                         "inertia of {:.3g} kg m^2 in the direction the joint frees; give the link an inertia, or fix the joint{}",
                         quoted(body.joint), quoted(body.link), whole.mass, std::max(felt, 0.0), kWayOut));
      }
      if (body.parent >= 0) {
        composite[static_cast<std::size_t>(slot_of(body.parent))] += whole.seen_from(body.placement);
      }
    }
    check_moved_coordinates(moves);
  }

  /// `moves`, by slot: whether the joint by itself moves something that resists.
  void check_moved_coordinates(const std::vector<bool>& moves) const {
    std::unordered_set<Index> moving;
    for (const Mimic& mimic : model_.mimics) {
      const bool follower = mimic.multiplier != 0 && moves[static_cast<std::size_t>(mimic.follower_slot)];
      if (follower || moves[static_cast<std::size_t>(mimic.leader_slot)]) moving.insert(mimic.leader_slot);
    }
    for (const Mimic& mimic : model_.mimics) {
      if (moving.contains(mimic.leader_slot)) continue;
      fail(fmt::format("joint {} moves nothing that resists, nor does {} or any other joint that follows it; expected one that moves a "
                       "link with an inertia in the direction the joint frees; give link {} an inertia, or fix the joints{}",
                       quoted(in_slot(mimic.leader_slot).joint), quoted(in_slot(mimic.follower_slot).joint),
                       quoted(in_slot(mimic.leader_slot).link), kWayOut));
    }
  }

  void check_independence() const {
    const Index slot = dependent_joint(model_);
    if (slot == 0) return;
    const Body& body = in_slot(slot);
    const bool leads = std::ranges::any_of(model_.mimics, [&](const Mimic& mimic) { return mimic.leader_slot == slot; });
    if (leads) {
      fail(fmt::format("joint {} and those that follow it move nothing that resists, or nothing that other joints do not move in the "
                       "same way; expected joints that each move something of their own; give link {} an inertia, or fix one of them{}",
                       quoted(body.joint), quoted(body.link), kWayOut));
    }
    fail(fmt::format("joint {} moves nothing that joints below it do not move in the same way, with no inertia between them; expected "
                     "joints that each move something of their own; give link {} an inertia, or fix one of the joints{}",
                     quoted(body.joint), quoted(body.link), kWayOut));
  }

  /// Who leads a joint in the end: q = multiplier q_leader + offset. Who follows nobody leads itself.
  struct Leader {
    std::size_t link;
    double multiplier = 1, offset = 0;
  };

  void resolve_mimics() {
    std::vector<std::optional<Leader>> leaders(links_.size());
    for (std::size_t i = 0; i < links_.size(); ++i) {
      const LinkSpec& link = links_[i];
      if (link.mimic.empty()) continue;
      const Leader leader = leader_in_the_end(i, leaders);
      if (!std::isfinite(leader.multiplier) || !std::isfinite(leader.offset)) {
        fail(fmt::format("joint {} follows {} by a multiplier of {} and an offset of {}, with all mimics between them; "
                         "expected finite numbers; correct them",
                         quoted(link.joint), quoted(links_[leader.link].joint), leader.multiplier, leader.offset));
      }
      const Index follower_slot = screw_slot(link), leader_slot = screw_slot(links_[leader.link]);
      const Tree& tree = model_.tree;
      model_.mimics.push_back({follower_slot, leader_slot, tree.first_v(follower_slot), tree.first_v(leader_slot),
                               tree.first_q(follower_slot), tree.first_q(leader_slot), leader.multiplier, leader.offset});
    }
  }

  /// Each link is walked over once, however long the row of followers.
  Leader leader_in_the_end(std::size_t link, std::vector<std::optional<Leader>>& leaders) const {
    std::vector<std::size_t> followers;
    std::size_t at = link;
    while (!leaders[at] && !links_[at].mimic.empty()) {
      if (followers.size() > links_.size()) {
        fail(fmt::format("joint {}: mimic joints follow each other in a circle", quoted(links_[link].joint)));
      }
      followers.push_back(at);
      at = leader_of(links_[at]);
    }
    Leader leader = leaders[at].value_or(Leader{at});
    for (auto next = followers.rbegin(); next != followers.rend(); ++next) {
      const LinkSpec& follower = links_[*next];
      leader = {leader.link, follower.multiplier * leader.multiplier, follower.multiplier * leader.offset + follower.offset};
      leaders[*next] = leader;
    }
    return leader;
  }

  std::size_t leader_of(const LinkSpec& link) const {
    const auto leader = joint_at_.find(link.mimic);
    if (leader == joint_at_.end()) {
      fail(fmt::format("joint {} mimics {}, which does not exist", quoted(link.joint), quoted(link.mimic)));
    }
    return leader->second;
  }

  Index screw_slot(const LinkSpec& link) const {
    const bool screw = link.type == JointType::revolute || link.type == JointType::prismatic || link.type == JointType::helical;
    if (!screw) {
      fail(fmt::format("joint {} takes part in a mimic but is fixed, planar, ball or free; only turning and sliding joints "
                       "can lead or follow",
                       quoted(link.joint)));
    }
    return model_.names.slot_of_joint.at(link.joint);
  }

  struct Carrier {
    int body = -1;
    Isometry3d pose = Isometry3d::Identity();  // link frame in the body's frame
  };

  std::string source_;
  const std::vector<LinkSpec>& links_;
  bool may_stand_still_;
  std::unordered_map<std::string, std::size_t> link_at_, joint_at_;
  std::vector<std::size_t> order_;
  std::vector<Carrier> carrier_;
  OriginInertia welded_;  // of links fixed to the world
  std::vector<Body> bodies_;
  std::vector<Index> slot_of_body_;
  std::vector<int> body_in_slot_;
  Model model_;
};

}  // namespace

LinkInertia box_inertia(double mass, const Vector3d& size, const Vector3d& center) {
  const Vector3d s = size.cwiseProduct(size);
  return {mass, center, (mass / 12 * Vector3d(s.y() + s.z(), s.x() + s.z(), s.x() + s.y())).asDiagonal()};
}

LinkInertia sphere_inertia(double mass, double radius, const Vector3d& center) {
  return {mass, center, 0.4 * mass * radius * radius * Matrix3d::Identity()};
}

LinkShape box_shape(const Vector3d& size, const Vector3d& center) {
  return {{.shift = {center.x(), center.y(), center.z()}}, {ShapeKind::box, {size.x(), size.y(), size.z()}, ""}};
}

TreeBuilder& TreeBuilder::source(std::string source) {
  source_ = std::move(source);
  return *this;
}

TreeBuilder& TreeBuilder::add(LinkSpec link) {
  links_.push_back(std::move(link));
  return *this;
}

TreeBuilder& TreeBuilder::warn(std::string message) {
  warnings_.push_back(std::move(message));
  return *this;
}

TreeBuilder& TreeBuilder::note(std::string message) {
  notes_.push_back(std::move(message));
  return *this;
}

TreeBuilder& TreeBuilder::visual_fault(std::string message) {
  visual_faults_.push_back(std::move(message));
  return *this;
}

TreeBuilder& TreeBuilder::may_stand_still() {
  may_stand_still_ = true;
  return *this;
}

Model TreeBuilder::build() const {
  Model model = Build(name_, source_, links_, warnings_, may_stand_still_).run();
  model.notes = notes_;
  model.visual_faults.insert(model.visual_faults.begin(), visual_faults_.begin(), visual_faults_.end());
  return model;
}

}  // namespace linden
