// Scenes in which bodies touch each other: solids of all shapes that slide, roll, rest, lean, strike and fall, on what is fixed or on each other, and
// arms that do so.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "models/build/builder.hpp"
#include "models/build/random.hpp"
#include "models/shapes/contacts_of.hpp"
#include "models/shapes/convex_hull.hpp"
#include "models/shapes/pair_contact.hpp"
#include "scene.hpp"
#include "tests/reference/plain_touch.hpp"

namespace linden {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

enum class Deed { slides, rolls, rests, strikes, drops, stack, pushed, wedged, arm, on_ground };
constexpr std::array kDeeds{"slides on a body", "rolls on a body", "rests on a body", "strikes a body",   "drops on a body",
                            "stack",            "is pushed",       "wedged",          "arm that touches", "stack on the ground"};

/// A shape, what it weighs and how it stands when it is laid down.
struct Solid {
  ConvexShape shape;
  double mass = 0;
  Matrix3d turn = Matrix3d::Identity();
  Vector3d at = Vector3d::Zero(), velocity = Vector3d::Zero(), spin = Vector3d::Zero();  // world; where its frame is

  reference::PlainConvex placed() const {
    Isometry T = Isometry::Identity();
    T.linear() = turn;
    T.translation() = at;
    return reference::plain_convex(shape, pose_of(T));
  }
  /// How far it reaches along a direction from its frame.
  double reach(const Vector3d& n) const { return placed().reach(n) - at.dot(n); }
};

class TouchingMaker {
 public:
  TouchingMaker(std::uint64_t seed, std::uint64_t number, std::uint64_t attempt)
      : random_(seed * 982451653 + number + (attempt << 40)), turning_(seed * 472882027 + number + (attempt << 40)) {
    random_.next();
    turning_.next();
    scene_.seed = seed;
    scene_.number = number;
  }

  EverydayScene make() {
    deed_ = static_cast<Deed>(random_.below(kDeeds.size()));
    scene_.kind = kDeeds[static_cast<std::size_t>(deed_)];
    h_ = scene_.options.step = spread(1e-4, 1e-2);
    scene_.horizon = static_cast<std::int64_t>(8 + random_.below(13));
    scene_.sudden = true;
    stiffness_ = spread(1e4, 1e9);
    friction_ = chance(0.2) ? 0 : random_.uniform(0.05, 1);
    if (turning_.uniform(0, 1) < 0.4) {
      const auto length = [this] { return turning_.uniform(0, 1) < 0.3 ? 0 : std::exp(turning_.uniform(std::log(1e-4), std::log(2e-2))); };
      rolling_ = length();
      torsional_ = length();
    }
    if (deed_ == Deed::strikes) scene_.options.gravity = {0, 0, 0};
    switch (deed_) {
      case Deed::slides:
      case Deed::rolls:
      case Deed::rests:
      case Deed::pushed: make_one(); break;
      case Deed::strikes: make_strikes(); break;
      case Deed::drops: make_drops(); break;
      case Deed::stack:
      case Deed::on_ground: make_stack(); break;
      case Deed::wedged: make_wedged(); break;
      case Deed::arm: make_arm(); break;
    }
    stiffen();
    build();
    make_effects();
    const bool ends = deed_ == Deed::rests || deed_ == Deed::stack || deed_ == Deed::wedged || deed_ == Deed::on_ground;
    const double steps = (ends ? spread(150, 1000) : spread(60, 500)) / (1 + 0.3 * static_cast<double>(solids_.size()));
    scene_.steps = std::max<std::int64_t>(scene_.horizon, static_cast<std::int64_t>(steps));
    return std::move(scene_);
  }

 private:
  bool chance(double p) { return random_.uniform(0, 1) < p; }
  double spread(double low, double high) { return std::exp(random_.uniform(std::log(low), std::log(high))); }
  double either_way(double size) { return random_.uniform(-size, size); }
  double length() { return random_.uniform(0.03, 0.15); }
  Matrix3d about(const Vector3d& axis, double angle) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

  ConvexShape shape(ConvexKind kind) {
    ConvexShape result{.kind = kind};
    switch (kind) {
      case ConvexKind::point: result.radius = length(); break;
      case ConvexKind::segment: result.radius = length(), result.half[2] = length(); break;
      case ConvexKind::box: result.half = {length(), length(), length()}; break;
      case ConvexKind::cylinder: result.half = {length(), 0, length()}, result.half[1] = result.half[0]; break;
      case ConvexKind::ellipsoid: result.half = {length(), length(), length()}; break;
      case ConvexKind::hull: {
        // a prism, or points all around
        std::vector<Vector3d> points;
        const Vector3d scale(length(), length(), length());
        const bool prism = chance(0.6);
        const int corners = 3 + static_cast<int>(random_.below(4));
        for (int k = 0; prism && k < 2 * corners; ++k) {
          const double turn = 2 * M_PI * (k / 2) / corners;
          points.push_back(scale.cwiseProduct(Vector3d(std::cos(turn), std::sin(turn), k % 2 == 0 ? 1 : -1)));
        }
        for (int k = 0; !prism && k < 12; ++k) points.push_back(scale.cwiseProduct(random_.rotation() * Vector3d::UnitX()));
        result.hull = convex_hull(points);
        break;
      }
      case ConvexKind::plane:
      case ConvexKind::heights: break;  // without end: no solid is one
    }
    return result;
  }
  ConvexShape any_shape() { return shape(static_cast<ConvexKind>(random_.below(6))); }
  ConvexShape flat_shape() {
    constexpr std::array flat{ConvexKind::box, ConvexKind::box, ConvexKind::cylinder, ConvexKind::hull};
    return shape(flat[random_.below(4)]);
  }

  Solid solid(const ConvexShape& shape, double mass) { return {.shape = shape, .mass = mass}; }

  /// Its frame that far above a plane through `top` with normal n that the gap is `gap`.
  void set_on(Solid& solid, const Vector3d& top, const Vector3d& n, double gap) { solid.at = top + (solid.reach(-n) + gap) * n; }

  /// Just touching, or a little above: what begins within something comes out slowly, which is another motion.
  double small_gap() { return chance(0.6) ? 0 : spread(1e-6, 1e-3); }

  void add_floor(double tilt_most) {
    // beneath all, tilted
    const Vector3d axis = Vector3d(either_way(1), either_way(1), 0).normalized();
    floor_turn_ = about(axis, chance(0.4) ? 0 : random_.uniform(0, tilt_most));
    up_ = floor_turn_ * Vector3d::UnitZ();
    Solid floor = solid({.kind = ConvexKind::box, .half = {2, 2, 0.2}}, 0);
    floor.turn = floor_turn_;
    floor.at = -0.2 * up_;
    fixed_.push_back(floor);
  }

  /// One solid on a floor that is fixed, or heavy and free in space.
  void make_one() {
    add_floor(deed_ == Deed::rests ? 0.8 * std::atan(friction_) : 0.6);
    ConvexShape what;
    if (deed_ == Deed::rolls) {
      constexpr std::array round{ConvexKind::point, ConvexKind::segment, ConvexKind::cylinder, ConvexKind::ellipsoid};
      what = shape(round[random_.below(4)]);
    } else {
      what = chance(0.8) ? flat_shape() : any_shape();
    }
    Solid one = solid(what, spread(0.1, 10));
    const bool lies = deed_ == Deed::rolls && what.kind != ConvexKind::point && what.kind != ConvexKind::ellipsoid;
    one.turn = floor_turn_ * about(Vector3d::UnitZ(), either_way(3)) * (lies ? about(Vector3d::UnitY(), M_PI / 2) : Matrix3d::Identity());
    if (what.kind == ConvexKind::hull) one.turn = one.turn * about(Vector3d::UnitX(), chance(0.5) ? 0 : M_PI / 2);
    set_on(one, Vector3d::Zero(), up_, small_gap());
    if (deed_ == Deed::slides || deed_ == Deed::rolls || (deed_ == Deed::pushed && chance(0.5))) {
      const Vector3d way = floor_turn_ * about(Vector3d::UnitZ(), either_way(3)) * Vector3d::UnitX();
      one.velocity = spread(0.05, 2) * way;
      if (chance(0.4)) one.spin = either_way(5) * up_;
      if (deed_ == Deed::rolls && chance(0.7)) {
        // rolling from the start, or with a slip
        const double share = chance(0.5) ? 1 : random_.uniform(-1, 2), height = one.reach(-up_);
        if (lies) one.velocity = one.velocity.norm() * (one.turn * Vector3d::UnitZ()).cross(up_);
        one.spin = share * up_.cross(one.velocity) / height;
      }
    }
    solids_.push_back(one);
  }

  void make_strikes() {
    const std::uint64_t count = 2 + random_.below(2);
    for (std::uint64_t k = 0; k < count; ++k) {
      Solid one = solid(any_shape(), spread(0.1, 10));
      one.turn = random_.rotation().toRotationMatrix();
      one.spin = either_way(5) * (random_.rotation() * Vector3d::UnitZ());
      one.velocity = either_way(0.2) * (random_.rotation() * Vector3d::UnitZ());
      if (k > 0) {
        // beside the one before, coming
        const Vector3d n = random_.rotation() * Vector3d::UnitZ();
        const Solid& other = solids_.back();
        const double speed = spread(0.05, 3);
        place_beside(one, other, n, speed * h_ * random_.uniform(0.5, 10));
        one.velocity = other.velocity - speed * n;
      }
      solids_.push_back(one);
    }
  }
  /// Along n as far as the gap is `gap`.
  void place_beside(Solid& one, const Solid& other, const Vector3d& n, double gap) {
    double low = 0, high = 2;
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (low + high);
      one.at = other.at + middle * n;
      (reference::signed_distance(other.placed(), one.placed()) < gap ? low : high) = middle;
    }
    one.at = other.at + high * n;
  }

  void make_drops() {
    add_floor(0.3);
    const std::uint64_t count = 1 + random_.below(3);
    for (std::uint64_t k = 0; k < count; ++k) {
      Solid one = solid(any_shape(), spread(0.1, 10));
      one.turn = chance(0.3) ? floor_turn_ : random_.rotation().toRotationMatrix();
      const double speed = spread(0.05, 2), gap = speed * h_ * random_.uniform(0.5, 8);
      one.velocity = -speed * up_;
      if (chance(0.5)) one.velocity += either_way(1) * (floor_turn_ * Vector3d::UnitX());
      if (chance(0.5)) one.spin = either_way(5) * (random_.rotation() * Vector3d::UnitZ());
      if (k == 0) set_on(one, Vector3d::Zero(), up_, gap);
      else place_beside(one, solids_.back(), (up_ + Vector3d(either_way(0.3), either_way(0.3), 0)).normalized(), gap);
      solids_.push_back(one);
    }
  }

  /// Flat things on each other, lighter and heavier, shifted and turned a little; now and then one slides off.
  void make_stack() {
    if (deed_ == Deed::stack) add_floor(0.5 * std::min(0.3, std::atan(friction_)));
    const std::uint64_t count = 2 + random_.below(3);
    Vector3d top = Vector3d::Zero();
    for (std::uint64_t k = 0; k < count; ++k) {
      ConvexShape shape{.kind = chance(0.7) ? ConvexKind::box : ConvexKind::cylinder};
      const double size = random_.uniform(0.08, 0.15) * (1 - 0.15 * static_cast<double>(k));
      shape.half = {size, shape.kind == ConvexKind::cylinder ? size : size * random_.uniform(0.7, 1), random_.uniform(0.02, 0.08)};
      Solid one = solid(shape, spread(0.1, 10));
      one.turn = floor_turn_ * about(Vector3d::UnitZ(), chance(0.3) ? 0 : either_way(0.6));
      set_on(one, top, up_, 0);
      if (k > 0 && chance(0.5)) one.at += floor_turn_ * Vector3d(either_way(0.03), either_way(0.03), 0);
      if (k + 1 == count && chance(0.3)) one.velocity = floor_turn_ * Vector3d(either_way(1), either_way(1), 0);
      top = one.at + one.reach(up_) * up_;
      solids_.push_back(one);
    }
    if (chance(0.3)) solids_.front().velocity = floor_turn_ * Vector3d(either_way(0.5), 0, 0);
  }

  /// In a groove of two walls, or between two that stand.
  void make_wedged() {
    const double angle = random_.uniform(0.3, 1.2);
    for (const double way : {1.0, -1.0}) {
      Solid wall = solid({.kind = ConvexKind::box, .half = {2, 2, 0.2}}, 0);
      wall.turn = about(Vector3d::UnitY(), way * angle);
      wall.at = -0.2 * (wall.turn * Vector3d::UnitZ()) - way * 1.9 * (wall.turn * Vector3d::UnitX());
      fixed_.push_back(wall);
    }
    constexpr std::array fits{ConvexKind::point, ConvexKind::segment, ConvexKind::cylinder, ConvexKind::box, ConvexKind::ellipsoid};
    Solid one = solid(shape(fits[random_.below(5)]), spread(0.1, 10));
    one.turn = one.shape.kind == ConvexKind::box ? about(Vector3d::UnitY(), chance(0.5) ? angle : random_.uniform(0, 1))
                                                 : about(Vector3d::UnitX(), M_PI / 2 + (chance(0.5) ? 0 : either_way(0.2)));
    double low = -1, high = 3;
    const double gap = chance(0.5) ? 0 : spread(1e-6, 1e-3);
    for (int k = 0; k < 50; ++k) {
      one.at.z() = 0.5 * (low + high);
      double least = 1;
      for (const Solid& wall : fixed_) least = std::min(least, reference::signed_distance(wall.placed(), one.placed()));
      (least < gap ? low : high) = one.at.z();
    }
    one.at.z() = high;
    if (chance(0.5)) one.velocity = Vector3d(0, either_way(1), 0);
    if (chance(0.3)) one.spin = Vector3d(0, either_way(5), 0);
    solids_.push_back(one);
  }

  /// Links that come down on a floor, or push a block.
  void make_arm() {
    add_floor(0);
    links_ = 2 + static_cast<int>(random_.below(3));
    Solid one = solid(flat_shape(), spread(0.1, 10));
    one.turn = about(Vector3d::UnitZ(), either_way(3));
    one.at.x() = 0.3 * links_ + 0.3;
    const Vector3d top(one.at.x(), either_way(0.1), 0);
    set_on(one, top, up_, small_gap());
    solids_.push_back(one);
  }

  /// Faces of more than four corners have a stiffness that goes by how many places stand for them: it is to be too high for steps to tell.
  void stiffen() {
    double mass = 0;
    for (const Solid& one : solids_) mass += one.mass;
    const auto many = [](const Solid& one) { return one.shape.kind == ConvexKind::cylinder || one.shape.kind == ConvexKind::hull; };
    if (std::ranges::any_of(solids_, many) || solids_.size() > 1) stiffness_ = std::max(stiffness_, std::min(1e9, 30 * mass / (h_ * h_)));
  }

  void build() {
    TreeBuilder builder(fmt::format("everyday scene {}", scene_.number));
    const auto link_shape = [](const Solid& solid) {
      LinkShape result;
      Isometry pose = Isometry::Identity();
      pose.linear() = solid.turn;
      pose.translation() = solid.at;
      result.pose = pose_of(pose);
      result.shape.kind = ShapeKind::box;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d way = solid.turn.col(axis);
        result.shape.size[static_cast<std::size_t>(axis)] = 2 * solid.reach(way);
      }
      return result;
    };
    LinkSpec world;
    world.name = "floor";
    world.joint = "floor_joint";
    world.type = JointType::fixed;
    for (const Solid& solid : fixed_) world.shapes.push_back(link_shape(solid));
    if (!fixed_.empty()) builder.add(world);
    for (std::size_t k = 0; k < solids_.size(); ++k) {
      Solid here = solids_[k];
      here.turn.setIdentity();
      here.at.setZero();
      LinkSpec link;
      link.name = fmt::format("solid{}", k + 1);
      link.joint = fmt::format("free{}", k + 1);
      link.type = JointType::free;
      link.shapes = {link_shape(here)};
      const std::array<double, 3>& size = link.shapes[0].shape.size;
      const bool round = here.shape.kind != ConvexKind::box && here.shape.kind != ConvexKind::hull && size[0] == size[1] && size[1] == size[2];
      link.inertia = round ? sphere_inertia(here.mass, size[0] / 2, Vector3d::Zero()) : box_inertia(here.mass, Vector3d(size[0], size[1], size[2]), Vector3d::Zero());
      builder.add(link);
    }
    const double drop = links_ > 0 ? random_.uniform(0.05, 0.2) : 0;
    for (int k = 0; k < links_; ++k) {
      LinkSpec link;
      link.name = fmt::format("arm{}", k + 1);
      link.joint = fmt::format("joint{}", k + 1);
      if (k > 0) link.parent = fmt::format("arm{}", k);
      link.placement.translation() = k == 0 ? Vector3d(0, 0, drop) : Vector3d(0.3, 0, 0);
      link.axis = k == 0 && chance(0.5) ? Vector3d::UnitZ() : Vector3d::UnitY();
      LinkShape rod;
      Isometry pose = Isometry::Identity();
      pose.translation() = Vector3d(0.15, 0, 0);
      pose.linear() = about(Vector3d::UnitY(), M_PI / 2);
      rod.pose = pose_of(pose);
      rod.shape.kind = chance(0.5) ? ShapeKind::capsule : ShapeKind::box;
      rod.shape.size = rod.shape.kind == ShapeKind::capsule ? std::array<double, 3>{0.03, 0.2, 0} : std::array<double, 3>{0.05, 0.05, 0.26};
      link.shapes = {rod};
      link.inertia = box_inertia(spread(0.2, 2), Vector3d(0.3, 0.06, 0.06), Vector3d(0.15, 0, 0));
      builder.add(link);
    }
    scene_.model = std::make_shared<const Model>(builder.build());
    const Model& model = *scene_.model;
    std::vector<std::string> notes;
    PairContact contact = pair_contact_of(model, notes);
    contact.materials[0].stiffness = stiffness_;
    contact.materials[0].friction = friction_;
    contact.materials[0].rolling_friction = rolling_;
    contact.materials[0].torsional_friction = torsional_;
    InitialState& start = scene_.start;
    start.positions = model.neutral();
    start.velocities.assign(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
    for (std::size_t k = 0; k < solids_.size(); ++k) {
      const Solid& one = solids_[k];
      const std::string name = fmt::format("solid{}", k + 1);
      const Index slot = model.names.link.at(name).slot;
      for (ConvexBody& body : contact.shapes) {
        if (body.link == name) body.shape = one.shape;
      }
      const auto q = static_cast<std::size_t>(model.tree.first_q(slot)), v = static_cast<std::size_t>(model.tree.first_v(slot));
      const Eigen::Quaterniond turn(one.turn);
      const Vector3d spin = one.turn.transpose() * one.spin, velocity = one.turn.transpose() * one.velocity;
      std::copy_n(one.at.data(), 3, &start.positions[q]);
      std::copy_n(turn.coeffs().data(), 4, &start.positions[q + 3]);
      std::copy_n(spin.data(), 3, &start.velocities[v]);
      std::copy_n(velocity.data(), 3, &start.velocities[v + 3]);
    }
    scene_.effects.contact = std::move(contact);
  }

  void make_effects() {
    const Model& model = *scene_.model;
    Effects& effects = scene_.effects;
    if (deed_ == Deed::pushed || chance(0.1)) {
      const std::size_t k = random_.below(solids_.size());
      BodyWrench wrench;
      wrench.slot = model.names.link.at(fmt::format("solid{}", k + 1)).slot;
      wrench.from = h_ * std::floor(random_.uniform(0, 10));
      wrench.to = wrench.from + h_ * std::ceil(random_.uniform(1, 20));
      const Vector3d way = spread(0.1, 3) * 9.81 * solids_[k].mass * (floor_turn_ * Vector3d(either_way(1), either_way(1), either_way(0.3)));
      std::copy_n(way.data(), 3, wrench.force.begin());
      if (chance(0.3)) wrench.point = {either_way(0.03), either_way(0.03), either_way(0.03)};
      effects.wrenches.push_back(wrench);
      scene_.bends = true;
    }
    if (deed_ != Deed::strikes && chance(0.1)) {
      for (std::size_t k = 0; k < solids_.size(); ++k) {
        effects.drag.push_back({.slot = model.names.link.at(fmt::format("solid{}", k + 1)).slot, .linear = solids_[k].mass * std::min(5.0, 0.2 / h_)});
      }
    }
    for (int k = 0; k < links_; ++k) {
      const Index slot = model.names.link.at(fmt::format("arm{}", k + 1)).slot, row = model.tree.first_v(slot);
      scene_.start.positions[static_cast<std::size_t>(model.tree.first_q(slot))] = k == 0 ? 0 : either_way(0.1);
      scene_.start.velocities[static_cast<std::size_t>(row)] = either_way(1);
      if (chance(0.3)) effects.damping.push_back({row, spread(0.01, 0.3)});
      if (chance(0.2)) effects.friction.push_back({row, spread(0.01, 1)});
      const double rate = std::min(30.0, 0.2 / h_);
      if (chance(0.4)) effects.servos.push_back({.row = row, .stiffness = 0.1 * rate * rate, .damping = 0.1 * rate, .target = either_way(0.4)});
    }
    if (deed_ != Deed::on_ground) return;
    Ground ground;
    std::vector<std::string> notes;
    ground.contacts = contacts_of(model, notes);
    double mass = 0;
    for (const Solid& one : solids_) mass += one.mass;
    const double w = spread(0.1, 0.5) / h_;
    ground.stiffness = std::min(mass * w * w / 4, 1e7);
    ground.damping = 2 * spread(0.1, 1) * std::sqrt(ground.stiffness * mass / 4);
    ground.friction = chance(0.1) ? 0 : random_.uniform(0.1, 1);
    effects.ground = ground;
  }

  Random random_, turning_;  // the second of what resists turning alone
  EverydayScene scene_;
  Deed deed_ = Deed::slides;
  double h_ = 1e-3, stiffness_ = 1e7, friction_ = 0, rolling_ = 0, torsional_ = 0;
  std::vector<Solid> fixed_, solids_;
  Matrix3d floor_turn_ = Matrix3d::Identity();
  Vector3d up_ = Vector3d::UnitZ();
  int links_ = 0;
};

/// No bodies begin within each other.
bool starts_apart(const EverydayScene& scene) {
  const reference::PlainTree tree = reference::plain_tree(*scene.model);
  const auto vector_of = [](const std::vector<double>& numbers) { return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()))); };
  const auto motions = reference::body_motions(tree, vector_of(scene.start.positions), vector_of(scene.start.velocities));
  constexpr double kTouchRounding = 1e-8;  // [m]
  std::vector<Vector3d> directions;
  const auto places = reference::PlainTouching(*scene.effects.contact).places(motions, 0, directions);
  return std::ranges::none_of(places, [](const reference::PlainTouch& touch) { return touch.gap < -kTouchRounding; });
}

}  // namespace

bool touches(std::uint64_t number) { return number % 6 == 3; }

EverydayScene touching_scene(std::uint64_t seed, std::uint64_t number) {
  for (std::uint64_t attempt = 0;; ++attempt) {
    EverydayScene scene = TouchingMaker(seed, number, attempt).make();
    if (starts_apart(scene)) return scene;
  }
}

}  // namespace linden
