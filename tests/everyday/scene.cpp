#include "scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "layout/contacts.hpp"
#include "models/build/builder.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/random.hpp"
#include "models/shapes/contacts_of.hpp"
#include "tests/reference/plain_scene.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Kinds of couplings that are drawn, the first so many: cables are made by themselves.
constexpr int kDrawnKinds = 10;
static_assert(kDrawnKinds == static_cast<int>(CouplingKind::cable));

enum Kind { swing, settle, servo, friction, limits, push, torque, drag, rest_on_ground, drop, anything, kinds };
constexpr std::array<const char*, kinds> kNames{"swing",  "settle", "servo", "friction",       "limits", "push",
                                                "torque", "drag",   "rest on ground", "drop", "anything"};

class Maker {
 public:
  Maker(std::uint64_t seed, std::uint64_t number) : random_(seed * 0x100000001b3ull + number) {
    random_.next();
    scene_.seed = seed;
    scene_.number = number;
  }

  EverydayScene make() {
    kind_ = static_cast<Kind>(random_.below(kinds));
    scene_.kind = kNames[kind_];
    scene_.stiff = chance(0.12);
    h_ = scene_.options.step = spread(1e-4, 1e-2);
    scene_.horizon = static_cast<std::int64_t>(16 + random_.below(25));
    if (!wants(0.85, kind_ == settle || kind_ == rest_on_ground || kind_ == drop)) {
      scene_.options.gravity = {0, 0, 0};
    } else if (chance(0.06)) {
      const Vector3d g = 9.81 * (random_.rotation() * Vector3d::UnitZ());
      if (!on_ground()) scene_.options.gravity = {g.x(), g.y(), g.z()};
    }
    make_model();
    make_start();
    if (scene_.number % 6 == 4) make_couplings();
    if (scene_.number % 6 == 1 || scene_.number % 12 == 10) make_springs();
    if (scene_.number % 12 == 2) make_cable();
    measure();
    make_effects();
    if (cable_) hold_cable();
    choose_length();
    scene_.sudden = !scene_.effects.friction.empty() || !scene_.effects.limits.empty() || scene_.effects.ground;
    return std::move(scene_);
  }

 private:
  bool chance(double p) { return random_.uniform(0, 1) < p; }
  /// Log-uniform.
  double spread(double low, double high) { return std::exp(random_.uniform(std::log(low), std::log(high))); }
  double either_way(double size) { return random_.uniform(-size, size); }
  bool on_ground() const { return kind_ == rest_on_ground || kind_ == drop; }
  /// Always where the scene is about it, else by chance: often in scenes of anything.
  bool wants(double p, bool about) { return about || chance(kind_ == anything ? std::max(p, 0.3) : p); }
  /// A rate [1/s] that the step resolves, or, in a stiff scene, may not.
  double rate() { return std::min(spread(0.005, scene_.stiff ? 4 : 0.3) / h_, scene_.stiff ? 1e4 : 500); }
  /// How far from rest something may start that swings at a rate w: joints of robots move at some rad/s.
  double swing_of(Index slot, double w) { return either_way(std::min(slides(slot) ? 0.1 : 0.8, (slides(slot) ? 1.0 : 5.0) / w)); }
  double position_of(Index slot) const { return scene_.start.positions[static_cast<std::size_t>(model().tree.first_q(slot))]; }

  void make_model() {
    const std::array<Index, 10> sizes{1, 1, 2, 2, 3, 4, 5, 6, 8, 12};
    const Index joints = std::max<Index>(1, sizes[random_.below(10)] - (chance(0.3) ? 1 : 0));
    const bool floating = on_ground() || chance(0.3);
    const double shape = random_.uniform(0, 1);
    TreeBuilder builder(fmt::format("everyday scene {}", scene_.number));
    std::vector<double> length;
    std::vector<Index> screws;
    std::vector<JointType> types;
    for (Index i = 0; i < joints; ++i) {
      LinkSpec link;
      link.name = fmt::format("link{}", i + 1);
      link.joint = fmt::format("joint{}", i + 1);
      const bool root = i == 0 || chance(0.03);
      length.push_back(spread(0.05, 0.5));
      const double width = length.back() * random_.uniform(0.1, 0.6), mass = spread(0.05, 10);
      const bool round = chance(on_ground() ? 0.5 : 0.3);
      if (root && floating) {
        link.type = JointType::free;
        link.placement.translation() = Vector3d(0, 2.0 * i, 0);
      } else {
        const double what = random_.uniform(0, 1);
        link.type = what < 0.58   ? JointType::revolute
                    : what < 0.73 ? JointType::prismatic
                    : what < 0.81 ? JointType::helical
                    : what < 0.97 ? JointType::ball
                                  : JointType::planar;
        if (chance(0.4)) link.placement.linear() = random_.rotation().toRotationMatrix();
        const std::array<Vector3d, 3> axes{Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
        link.axis = chance(0.6) ? axes[1 + random_.below(2)] : Vector3d(random_.rotation() * Vector3d::UnitZ());
        link.pitch = (chance(0.5) ? 1 : -1) * spread(0.003, 0.1);
      }
      if (!root) {
        const auto any = static_cast<Index>(random_.below(static_cast<std::uint64_t>(i)));
        const Index parent = shape < 0.5 ? i - 1 : shape < 0.85 ? any : 0;
        link.parent = fmt::format("link{}", parent + 1);
        link.placement.translation() = Vector3d(length[static_cast<std::size_t>(parent)], 0, 0);
      }
      // centred where nothing carries it, else behind its joint
      const Vector3d center = link.type == JointType::free ? Vector3d(Vector3d::Zero()) : Vector3d(0.5 * length.back(), 0, 0);
      const Vector3d size(length.back(), width, width * random_.uniform(0.5, 1));
      link.inertia = round ? sphere_inertia(mass, 0.5 * width, center) : box_inertia(mass, size, center);
      if (link.type == JointType::free || chance(0.4)) {
        if (round) {
          LinkShape ball;
          Isometry pose(Eigen::Translation3d{center});
          ball.shape.kind = ShapeKind::sphere;
          ball.shape.size = {0.5 * width, 0, 0};
          if (chance(0.5)) {
            // a cylinder, lying or standing
            ball.shape.kind = ShapeKind::cylinder;
            ball.shape.size[1] = width * random_.uniform(0.2, 2);
            if (chance(0.7)) pose.linear() = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
          }
          ball.pose = pose_of(pose);
          link.shapes = {ball};
        } else {
          link.shapes = {box_shape(size, center)};
        }
      }
      const bool screw = link.type == JointType::revolute || link.type == JointType::prismatic || link.type == JointType::helical;
      if (screw && !screws.empty() && chance(0.12)) {
        link.mimic = fmt::format("joint{}", screws[random_.below(screws.size())] + 1);
        link.multiplier = (chance(0.5) ? 1 : -1) * spread(0.5, 2);
        link.offset = chance(0.5) ? 0 : either_way(0.2);
      } else if (screw) {
        screws.push_back(i);
      }
      builder.add(std::move(link));
    }
    scene_.model = std::make_shared<const Model>(builder.build());
    find_followers();
  }

  const Model& model() const { return *scene_.model; }
  void find_followers() {
    followers_.clear();
    for (const Mimic& mimic : model().mimics) followers_.insert(mimic.follower_v);
  }
  template <class Visit>
  void each_screw(const Visit& visit) const {
    for (Index i = 1; i < model().tree.shape.slots; ++i) {
      const Index row = model().tree.first_v(i);
      if (model().tree.kind(i) == JointKind::screw && !followers_.contains(row)) visit(i, row);
    }
  }
  bool slides(Index slot) const { return model().constants.screw(slot, 0) == 0; }

  void make_start() {
    InitialState& start = scene_.start;
    start.positions = model().neutral();
    start.velocities.assign(static_cast<std::size_t>(model().tree.shape.velocities), 0.0);
    const bool bent = chance(0.7), moves = kind_ == swing || kind_ == drag || chance(kind_ == rest_on_ground ? 0.4 : 0.5);
    const double fast = chance(0.1) ? 8 : 2;
    for (Index i = 1; i < model().tree.shape.slots; ++i) {
      const JointKind joint = model().tree.kind(i);
      double* q = &start.positions[static_cast<std::size_t>(model().tree.first_q(i))];
      double* v = &start.velocities[static_cast<std::size_t>(model().tree.first_v(i))];
      const Eigen::Quaterniond turn = random_.rotation().slerp(random_.uniform(0, 1), Eigen::Quaterniond::Identity());
      if (joint == JointKind::screw) {
        if (bent) q[0] = either_way(slides(i) ? 0.2 : 1.2);
        if (moves) v[0] = either_way(slides(i) ? 0.3 : fast);
        continue;
      }
      const bool flat = on_ground() && joint == JointKind::free && (kind_ == rest_on_ground || chance(0.3));
      double* quaternion = joint == JointKind::free ? q + 3 : q;
      if (bent && !flat) std::copy_n(turn.coeffs().data(), 4, quaternion);
      if (!moves) continue;
      for (Index k = 0; k < 3; ++k) v[k] = flat && k != 1 ? 0 : either_way(fast);
      for (Index k = 3; k < velocity_count(joint); ++k) v[k] = flat && k == 5 ? 0 : either_way(1);
    }
  }

  /// Bodies are tied to each other, or to the world, as they stand at the start: as many rows as leave a coordinate or two free; now and then
  /// one coupling twice, whose rows follow from each other. In every other scene the first that turns or slides has a coordinate. Numbers of its
  /// own, so that all else is as it would be without.
  void make_couplings() {
    Random random(scene_.seed * 32452843 + scene_.number);
    const Index bodies = model().tree.bodies();
    Index free = model().degrees_of_freedom() - 1;
    std::vector<CouplingSpec> specs;
    const std::vector<Isometry> poses = poses_at_start();
    for (int tries = 0; tries < 6 && specs.size() < 3; ++tries) {
      const auto kind = static_cast<CouplingKind>(random.below(kDrawnKinds));
      const auto rows = static_cast<Index>(rows_of(kind).size());
      const auto a = static_cast<Index>(random.below(static_cast<std::uint64_t>(bodies) + 1));
      const auto b = static_cast<Index>(1 + random.below(static_cast<std::uint64_t>(bodies)));
      const auto is_link = [&](Index slot) { return slot == 0 || model().names.link.contains(model().names.body[static_cast<std::size_t>(slot)]); };
      if (a == b || rows > free || !is_link(a) || !is_link(b)) continue;
      if (kind == CouplingKind::gear) {
        CouplingSpec spec;
        spec.name = fmt::format("coupling{}", specs.size() + 1);
        spec.kind = kind;
        each_screw([&](Index slot, Index) {
          const std::string& name = model().names.joint[static_cast<std::size_t>(slot)];
          if (random.uniform(0, 1) < 0.5 || spec.joints.size() == 3 || !model().names.slot_of_joint.contains(name)) return;
          const double ratio = (random.uniform(0, 1) < 0.5 ? 1 : -1) * random.uniform(0.3, 2);
          spec.joints.push_back({name, ratio});
          spec.offset -= ratio * position_of(slot);
        });
        if (spec.joints.size() < 2) continue;
        specs.push_back(spec);
        free -= 1;
        continue;
      }
      specs.push_back(coupling_at_start(random, poses, kind, a, b));
      specs.back().name = fmt::format("coupling{}", specs.size());
      free -= rows;
      const bool moves = kind == CouplingKind::hinge || kind == CouplingKind::slider;
      if (moves && scene_.number % 12 == 4 && std::ranges::none_of(specs, [](const CouplingSpec& spec) { return spec.joint.has_value(); })) {
        specs.back().joint = ClosingJoint{.name = "closing"};
        continue;
      }
      if (random.uniform(0, 1) < 0.15) {
        specs.push_back(specs.back());
        specs.back().name = fmt::format("coupling{}", specs.size());
      }
    }
    if (specs.empty()) return;
    auto tied = std::make_shared<const Model>(coupled(*scene_.model, specs));
    InitialState start = start_in(*tied);
    if (starts_singular(*tied, start.positions, random)) return;
    scene_.model = std::move(tied);
    find_followers();
    scene_.start = std::move(start);
    scene_.coupled = true;
  }
  /// The start in a model that may have a joint more, which is at zero.
  InitialState start_in(const Model& to) const {
    InitialState start{to.neutral(), std::vector<double>(static_cast<std::size_t>(to.tree.shape.velocities), 0.0)};
    const Tree& tree = model().tree;
    for (Index i = 1; i < tree.shape.slots; ++i) {
      const auto place = std::ranges::find(to.names.body, model().names.body[static_cast<std::size_t>(i)]);
      const auto slot = static_cast<Index>(place - to.names.body.begin());
      for (Index k = 0; k < position_count(tree.kind(i)); ++k) {
        start.positions[static_cast<std::size_t>(to.tree.first_q(slot) + k)] = scene_.start.positions[static_cast<std::size_t>(tree.first_q(i) + k)];
      }
      for (Index k = 0; k < velocity_count(tree.kind(i)); ++k) {
        start.velocities[static_cast<std::size_t>(to.tree.first_v(slot) + k)] = scene_.start.velocities[static_cast<std::size_t>(tree.first_v(i) + k)];
      }
    }
    return start;
  }

  /// One to three couplings that give way: springs between points, some damped, bushings, soft joints of all kinds; stretched at the start where
  /// they have a length. Numbers of its own, likewise.
  void make_springs() {
    Random random(scene_.seed * 86028121 + scene_.number), uneven(scene_.seed * 15485863 + scene_.number);
    const auto log_uniform = [&](double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); };
    const std::vector<Isometry> poses = poses_at_start();
    const Index bodies = model().tree.bodies();
    const auto is_link = [&](Index slot) { return slot == 0 || model().names.link.contains(model().names.body[static_cast<std::size_t>(slot)]); };
    std::vector<CouplingSpec> specs;
    for (int tries = 0; tries < 6 && specs.size() < 1 + scene_.number % 3; ++tries) {
      const CouplingKind drawn = random.uniform(0, 1) < 0.5 ? CouplingKind::rod : static_cast<CouplingKind>(random.below(kDrawnKinds - 1));
      const CouplingKind kind = drawn == CouplingKind::weld && uneven.uniform(0, 1) < 0.7 ? CouplingKind::bushing : drawn;
      const auto a = static_cast<Index>(random.below(static_cast<std::uint64_t>(bodies) + 1));
      const auto b = static_cast<Index>(1 + random.below(static_cast<std::uint64_t>(bodies)));
      if (a == b || !is_link(a) || !is_link(b)) continue;
      CouplingSpec spec = coupling_at_start(random, poses, kind, a, b);
      spec.name = fmt::format("spring{}", specs.size() + 1);
      if (kind == CouplingKind::rod) spec.length *= random.uniform(0.7, 1.3);
      // gains follow from what the rows move
      const auto turns = [](const GapRow& row) { return row.kind == GapKind::product || row.kind == GapKind::angle; };
      for (const GapRow& row : rows_of(kind)) (turns(row) ? spec.turn : spec.shift) = {1, 0};
      const Model sprung = coupled(*scene_.model, {spec});
      const reference::PlainTree tree = reference::plain_tree(sprung);
      const reference::PlainCouplings rows(tree, sprung.couplings, reference::Rows::giving_way);
      const reference::PlainScene at = plain();
      const Eigen::MatrixXd C = rows.opening(at.q);
      const VectorXd moved = (C * at.mass_matrix().ldlt().solve(C.transpose())).diagonal().tail(static_cast<Eigen::Index>(rows_of(kind).size()));
      if (!(moved.minCoeff() > 1e-9)) continue;  // they cannot open
      const double w = std::min(log_uniform(0.01, scene_.stiff ? 4 : 0.3) / h_, scene_.stiff ? 1e4 : 500);
      const double damped = random.uniform(0, 1) < 0.5 ? 0 : std::min(2 * log_uniform(0.02, 1), (scene_.stiff ? 4 : 0.3) / (w * h_));
      double shift = 0, turn = 0;  // what moves most
      for (Eigen::Index row = 0; row < moved.size(); ++row) {
        double& most = turns(rows_of(kind)[static_cast<std::size_t>(row)]) ? turn : shift;
        most = std::max(most, moved[row]);
      }
      spec.shift = shift > 0 ? Springs(w * w / shift, damped * w / shift) : Springs();
      spec.turn = turn > 0 ? Springs(w * w / turn, damped * w / turn) : Springs();
      if (kind == CouplingKind::bushing) {
        // softer about some axes, free about some
        for (Springs* springs : {&spec.shift, &spec.turn}) {
          for (std::size_t axis = 1; axis < 3; ++axis) {
            const double share = uneven.uniform(0, 1) < 0.2 ? 0 : uneven.uniform(0.1, 1);
            springs->along[axis] = {share * springs->along[axis].stiffness, share * springs->along[axis].damping};
          }
        }
      }
      specs.push_back(spec);
    }
    if (!specs.empty()) scene_.model = std::make_shared<const Model>(coupled(*scene_.model, specs));
  }

  /// A cable through two to four points of bodies, or of the world. Numbers of its own, likewise.
  void make_cable() {
    Random random(scene_.seed * 49979687 + scene_.number);
    const Index bodies = model().tree.bodies();
    CouplingSpec spec;
    spec.name = "cable";
    spec.kind = CouplingKind::cable;
    const std::size_t count = 2 + random.below(3);
    std::set<Index> through;
    for (int tries = 0; tries < 12 && spec.through.size() < count; ++tries) {
      const auto slot = static_cast<Index>(random.below(static_cast<std::uint64_t>(bodies) + 1));
      const Eigen::Vector3d point(random.uniform(0, 0.3), random.uniform(-0.2, 0.2), slot == 0 ? random.uniform(0.3, 1.5) : random.uniform(-0.2, 0.2));
      if (slot != 0 && !model().names.link.contains(model().names.body[static_cast<std::size_t>(slot)])) continue;
      spec.through.push_back({slot == 0 ? "world" : model().names.body[static_cast<std::size_t>(slot)], point});
      through.insert(slot);
    }
    if (spec.through.size() < 2 || through.size() < 2) return;
    const auto tied = std::make_shared<const Model>(coupled(*scene_.model, {spec}));
    scene_.start = start_in(*tied);
    scene_.model = tied;
    find_followers();
    cable_ = tied->couplings.back().terms.front();
    scene_.coupled = true;
    measure_cable();
  }
  /// Its length, and how fast that changes, at the start.
  void measure_cable() {
    InitialState& start = scene_.start;
    const auto q = [&](Index row) -> double& { return start.positions[static_cast<std::size_t>(row)]; };
    const auto v = [&](Index row) -> double& { return start.velocities[static_cast<std::size_t>(row)]; };
    for (const Mimic& mimic : model().mimics) {
      q(mimic.follower_q) = mimic.multiplier * q(mimic.leader_q) + mimic.offset;
      v(mimic.follower_v) = mimic.multiplier * v(mimic.leader_v);
    }
    const reference::PlainTree tree = reference::plain_tree(model());
    const reference::PlainCouplings rows(tree, model().couplings);
    const auto vector_of = [](const std::vector<double>& numbers) { return VectorXd(Eigen::Map<const VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()))); };
    q(cable_->q_row) += rows.gaps(vector_of(start.positions))[0];
    v(cable_->v_row) = 0;
    v(cable_->v_row) = (rows.opening(vector_of(start.positions)) * vector_of(start.velocities))[0];
  }
  /// It does not stretch beyond a length that it has at the start, or later, or it pulls like a spring from there on.
  void hold_cable() {
    Random random(scene_.seed * 67867967 + scene_.number);
    const auto log_uniform = [&](double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); };
    const Index row = cable_->v_row;
    Effects& effects = scene_.effects;
    const auto of_it = [row](const auto& entry) { return entry.row == row; };
    // effects may have moved the start
    const auto given = std::ranges::find(effects.motions, row, &JointMotion::row);
    measure_cable();
    if (given != effects.motions.end()) {
      given->position.values.front() = scene_.start.positions[static_cast<std::size_t>(cable_->q_row)];
      return;
    }
    std::erase_if(effects.limits, of_it);
    std::erase_if(effects.dead_zone_springs, of_it);
    const double now = scene_.start.positions[static_cast<std::size_t>(cable_->q_row)];
    const double most = now * (random.uniform(0, 1) < 0.4 ? 1 : random.uniform(1, 1.3));
    if (random.uniform(0, 1) < 0.6) {
      effects.limits.push_back({.row = row, .upper = most, .restitution = random.uniform(0, 1) < 0.3 ? random.uniform(0, 1) : 0});
      return;
    }
    // gains follow from what the cable moves
    const reference::PlainTree tree = reference::plain_tree(model());
    const reference::PlainScene at = plain();
    Eigen::MatrixXd C = reference::PlainCouplings(tree, model().couplings).opening(at.q);
    C.col(row).setZero();
    const double moved = (C * at.mass_matrix().ldlt().solve(C.transpose()))(0, 0);
    if (!(moved > 1e-9)) return;
    const double w = std::min(log_uniform(0.01, scene_.stiff ? 100 : 0.3) / h_, scene_.stiff ? 1e5 : 500);
    effects.dead_zone_springs.push_back({.row = row, .stiffness = w * w / moved, .half_width = most / 2, .rest = most / 2});
    scene_.bends = true;
  }

  /// A coupling of two bodies, closed at the start; of a rod as far apart as they are.
  CouplingSpec coupling_at_start(Random& random, const std::vector<Isometry>& poses, CouplingKind kind, Index a, Index b) const {
    CouplingSpec spec;
    spec.kind = kind;
    spec.link_a = a == 0 ? "world" : model().names.body[static_cast<std::size_t>(a)];
    spec.link_b = model().names.body[static_cast<std::size_t>(b)];
    Isometry where = Isometry::Identity();
    where.linear() = random.rotation().toRotationMatrix();
    where.translation() = poses[static_cast<std::size_t>(b)] * Vector3d(random.uniform(0, 0.3), random.uniform(-0.1, 0.1), 0);
    Isometry other = where;
    if (kind == CouplingKind::rod) {
      const Vector3d apart = random.uniform(0.1, 0.5) * (random.rotation() * Vector3d::UnitZ());
      other.translation() += apart;
      spec.length = apart.norm();
    }
    const auto in_link = [&](Index slot, const std::string& link, const Isometry& frame) {
      const Isometry in_body = slot == 0 ? Isometry(Isometry::Identity()) : isometry(model().names.link.at(link).in_body);
      return Isometry((poses[static_cast<std::size_t>(slot)] * in_body).inverse() * frame);
    };
    spec.frame_a = in_link(a, spec.link_a, other);
    spec.frame_b = in_link(b, spec.link_b, where);
    return spec;
  }

  /// Whether rows of couplings follow from each other at the start that do not elsewhere: a structure that gives way there at first, and then
  /// no more.
  bool starts_singular(const Model& tied, const std::vector<double>& positions, Random& random) const {
    const reference::PlainTree tree = reference::plain_tree(tied);
    const reference::PlainCouplings couplings(tree, tied.couplings);
    const auto rank = [&](const VectorXd& q) {
      Eigen::MatrixXd C = couplings.opening(q);
      for (const Mimic& mimic : tied.mimics) {
        C.col(mimic.leader_v) += mimic.multiplier * C.col(mimic.follower_v);
        C.col(mimic.follower_v).setZero();
      }
      Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor;
      factor.setThreshold(1e-6);
      return factor.compute(C).rank();
    };
    const VectorXd start = Eigen::Map<const VectorXd>(positions.data(), static_cast<Eigen::Index>(positions.size()));
    VectorXd away(tree.velocities);
    for (double& moved : away) moved = random.uniform(-0.5, 0.5);
    return rank(start) < rank(reference::advanced(tree, start, away));
  }

  std::vector<Isometry> poses_at_start() const {
    const reference::PlainScene scene = plain();
    std::vector<Isometry> all;
    for (const reference::Matrix4<double>& pose : reference::poses(scene.tree(), scene.q)) {
      all.push_back(Isometry::Identity());
      all.back().matrix() = pose;
    }
    return all;
  }

  reference::PlainScene plain() const {
    reference::PlainScene result(model(), scene_.effects, scene_.options.gravity);
    result.start(Eigen::Map<const VectorXd>(scene_.start.positions.data(), static_cast<Eigen::Index>(scene_.start.positions.size())),
                 Eigen::Map<const VectorXd>(scene_.start.velocities.data(), static_cast<Eigen::Index>(scene_.start.velocities.size())));
    return result;
  }

  /// What rows weigh and what pulls at them: gains are chosen by it.
  void measure() {
    const reference::PlainScene scene = plain();
    inertia_ = scene.row_inertia();
    load_ = (inertia_.array() * scene.acceleration().array().abs()).matrix();
    for (Index row = 0; row < load_.size(); ++row) load_[row] = std::max(load_[row], 0.3 * inertia_[row]);
  }
  double inertia(Index row) const { return inertia_[row]; }
  double load(Index row) const { return load_[row]; }

  void make_effects() {
    Effects& effects = scene_.effects;
    if (chance(0.2)) {
      const double share = spread(0.02, 2);
      each_screw([&](Index, Index row) { effects.armature.push_back({row, share * inertia(row)}); });
      if (!effects.armature.empty()) measure();
    }
    if (wants(0.15, kind_ == swing && chance(0.4))) {
      each_screw([&](Index slot, Index row) {
        const double w = rate();
        if (chance(0.7)) effects.springs.push_back({row, inertia(row) * w * w, position_of(slot) + swing_of(slot, w)});
      });
      for (Index i = 1; i < model().tree.shape.slots; ++i) {
        if (model().tree.kind(i) != JointKind::ball) continue;
        const double w = rate();
        const double* now = &scene_.start.positions[static_cast<std::size_t>(model().tree.first_q(i))];
        const Eigen::Quaterniond rest =
            Eigen::Quaterniond(now[3], now[0], now[1], now[2]) *
            Eigen::AngleAxisd(std::min(1.0, 5 / w) * random_.uniform(0, 1), random_.rotation() * Vector3d::UnitZ());
        effects.ball_springs.push_back({i, inertia(model().tree.first_v(i)) * w * w, {rest.x(), rest.y(), rest.z(), rest.w()}});
      }
    }
    if (wants(0.2, kind_ == settle)) {
      const double r = kind_ == settle ? std::min(spread(0.03, 0.3) / h_, 1e4) : rate();
      for (const JointDamping& damper : damping_everywhere(model(), 1)) {
        effects.damping.push_back({damper.row, r * inertia(damper.row) * random_.uniform(0.5, 1)});
      }
    }
    if (wants(0.12, kind_ == servo)) make_servos();
    if (wants(0.12, kind_ == friction)) {
      const double share = spread(0.1, 4);
      each_screw([&](Index, Index row) {
        if (chance(0.8)) effects.friction.push_back({row, share * load(row) * random_.uniform(0.5, 1)});
      });
    }
    if (wants(0.08, kind_ == limits)) make_limits();
    if (wants(0.08, kind_ == push)) make_pushes();
    if (wants(0.08, kind_ == torque)) make_torques();
    if (wants(0.08, kind_ == drag)) make_drag();
    if (scene_.number % 5 == 2) make_motion();
    if (scene_.number % 7 == 5) make_dead_zones();
    if (on_ground()) make_ground();
  }

  /// A joint is moved: held, to and fro, or on its way now and then; only held where couplings leave a coordinate or two, which can follow no
  /// farther than they reach. Numbers of its own, so that all else is as it would be without.
  void make_motion() {
    std::vector<std::pair<Index, Index>> screws;
    each_screw([&](Index slot, Index row) { screws.push_back({slot, row}); });
    if (screws.empty() || model().degrees_of_freedom() < 2) return;
    Random random(scene_.seed * 104729 + scene_.number);
    const auto [slot, row] = screws[random.below(screws.size())];
    double& q = scene_.start.positions[static_cast<std::size_t>(model().tree.first_q(slot))];
    double& v = scene_.start.velocities[static_cast<std::size_t>(row)];
    JointMotion motion{row, {{0}, {q}}};
    TimeTable& table = motion.position;
    const double kind = scene_.coupled ? 0 : random.uniform(0, 1), apart = h_ * 2 * std::pow(10.0, random.uniform(0, 1));
    const double w = random.uniform(0.02, 0.3) / apart, size = random.uniform(0.2, 1) * std::min(slides(slot) ? 0.1 : 0.8, (slides(slot) ? 0.5 : 3.0) / w);
    const double phase = random.uniform(0, 2 * std::numbers::pi);
    const bool with_velocities = kind > 0.2 && kind <= 0.4;
    if (with_velocities) motion.velocities.push_back(size * w * std::cos(phase));
    for (int k = 1; kind > 0.2 && k < 400; ++k) {
      table.times.push_back(k * apart);
      const bool stands = kind > 0.6 && k / 25 % 2 == 0;
      const double more = stands ? 0 : size * (std::sin(w * k * apart + phase) - std::sin(w * (k - 1) * apart + phase));
      table.values.push_back(table.values.back() + more);
      if (with_velocities) motion.velocities.push_back(size * w * std::cos(w * k * apart + phase));
    }
    v = reference::PlainCurve(motion).derivative(1, 0);
    scene_.effects.motions.push_back(std::move(motion));
    const auto of_it = [row = row](const auto& entry) { return entry.row == row; };
    std::erase_if(scene_.effects.friction, of_it);
    std::erase_if(scene_.effects.limits, of_it);
    scene_.bends = true;
  }

  /// Joints with play, between springs: they start within their zones or beyond. Numbers of its own, as above.
  void make_dead_zones() {
    Random random(scene_.seed * 15485863 + scene_.number);
    const auto log_uniform = [&](double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); };
    each_screw([&](Index slot, Index row) {
      const double w = std::min(log_uniform(0.005, scene_.stiff ? 100 : 0.3) / h_, scene_.stiff ? 1e5 : 500);
      const double size = slides(slot) ? 0.1 : 0.8, beyond = std::min(size, (slides(slot) ? 1.0 : 5.0) / w);
      const double half_width = size * log_uniform(0.01, 1), away = random.uniform(-1, 1) * (half_width + beyond);
      const bool moved = std::ranges::any_of(scene_.effects.motions, [&](const JointMotion& motion) { return motion.row == row; });
      if (moved || random.uniform(0, 1) < 0.3) return;
      scene_.effects.dead_zone_springs.push_back(
          {.row = row, .stiffness = inertia(row) * w * w, .half_width = half_width, .rest = position_of(slot) - away});
    });
    scene_.bends = scene_.bends || !scene_.effects.dead_zone_springs.empty();
  }

  void make_servos() {
    const bool limited = chance(0.4), stays = chance(0.3), moves = chance(0.25);
    each_screw([&](Index slot, Index row) {
      const double w = rate(), at = position_of(slot);
      const double damping = std::min(2 * w * spread(0.1, 2), (scene_.stiff ? 4 : 0.5) / h_);
      scene_.effects.servos.push_back({.row = row,
                                       .stiffness = inertia(row) * w * w,
                                       .damping = inertia(row) * damping,
                                       .target = stays ? at : at + swing_of(slot, w),
                                       .max_force = limited ? load(row) * spread(0.3, 5) : kInfinity});
      if (moves) make_tables(scene_.effects.servos.back(), slot, w);
    });
    scene_.bends = scene_.bends || limited || moves;
  }

  /// Targets over time that end, with their speeds or with a force beside, or without.
  void make_tables(Servo& servo, Index slot, double w) {
    TimeTable table{{}, {}}, speed{{}, {}};
    double t = 0, at = servo.target;
    const double stretch = h_ * spread(0.7, 8);
    for (int k = 0; k < 12; ++k) {
      const double next = k == 11 ? at : at + 0.2 * swing_of(slot, w);
      table.times.push_back(t);
      table.values.push_back(at);
      // a speed that jumps where the target bends
      speed.times.insert(speed.times.end(), {t, t + stretch});
      speed.values.insert(speed.values.end(), 2, k == 11 ? 0 : (next - at) / stretch);
      t += stretch;
      at = next;
    }
    servo.target_over_time = table;
    if (chance(0.5)) servo.target_velocity = speed;
    if (chance(0.3)) servo.feedforward = {{0, t}, {either_way(load(servo.row)), 0}};
  }

  void make_limits() {
    const std::array<double, 4> shares{0, 0.5, 1, random_.uniform(0, 1)};
    const double restitution = shares[random_.below(4)];
    each_screw([&](Index slot, Index row) {
      const auto at = static_cast<std::size_t>(row);
      const double q = position_of(slot);
      double& v = scene_.start.velocities[at];
      if (chance(0.25)) return;
      // on the limit, within a step of it, or some steps away and moving towards it
      if (v == 0 && chance(0.6)) v = either_way(slides(slot) ? 0.3 : 2);
      const double away = std::abs(v) * h_ * (chance(0.15) ? 0 : chance(0.2) ? random_.uniform(0, 1) : random_.uniform(1, 12));
      const double room = spread(0.05, 1);
      JointLimit limit{.row = row, .lower = q - room, .upper = q + room, .restitution = restitution};
      (v < 0 ? limit.lower : limit.upper) = v < 0 ? q - away : q + away;
      if (chance(0.3)) (v < 0 ? limit.upper : limit.lower) = v < 0 ? kInfinity : -kInfinity;
      if (chance(0.2)) limit.velocity = std::max(std::abs(v), slides(slot) ? 0.05 : 0.3) * random_.uniform(1, 2);
      scene_.effects.limits.push_back(limit);
    });
  }

  /// Times within the steps, or on them.
  double moment(double low, double high) {
    const double t = random_.uniform(low, high);
    return h_ * (chance(0.4) ? std::floor(t) : t);
  }

  void make_pushes() {
    scene_.bends = true;
    const auto count = 1 + random_.below(2);
    for (std::uint64_t k = 0; k < count; ++k) {
      BodyWrench wrench;
      do {
        wrench.slot = static_cast<Index>(1 + random_.below(static_cast<std::uint64_t>(model().tree.bodies())));
      } while (!(model().constants.inertia(wrench.slot, 0) > 0));
      const double mass = model().constants.inertia(wrench.slot, 0), steps = chance(0.3) ? random_.uniform(0.1, 1) : random_.uniform(1, 6);
      wrench.from = moment(0, 10);
      wrench.to = chance(0.4) ? wrench.from + h_ * std::ceil(steps) : wrench.from + h_ * steps;
      const double force = mass * spread(0.05, 1) / (wrench.to - wrench.from);
      const Vector3d way = random_.rotation() * Vector3d::UnitZ();
      for (std::size_t axis = 0; axis < 3; ++axis) wrench.force[axis] = force * way[static_cast<Eigen::Index>(axis)];
      if (chance(0.3)) wrench.moment = {0, 0, 0.02 * force};
      wrench.point = {either_way(0.05), either_way(0.05), 0};
      wrench.in_world = chance(0.7);
      scene_.effects.wrenches.push_back(wrench);
    }
    std::ranges::sort(scene_.effects.wrenches, {}, &BodyWrench::slot);
  }

  void make_torques() {
    each_screw([&](Index, Index row) {
      if (chance(0.3)) return;
      TimeTable table{{}, {}};
      const double most = load(row) * spread(0.3, 5);
      const int shape = static_cast<int>(random_.below(3));
      double t = 0;
      for (int k = 0; k < 40; ++k) {
        const double value = either_way(most);
        table.times.push_back(t);
        table.values.push_back(value);
        // held for a step and then jumping; straight from step to step; bent anywhere
        t += shape == 2 ? h_ * random_.uniform(0.2, 3) : h_;
        if (shape == 0) {
          table.times.push_back(t);
          table.values.push_back(value);
        }
      }
      if (chance(0.5)) table.values.back() = 0;
      if (shape != 1) scene_.bends = true;
      scene_.effects.torques.push_back({row, table});
    });
    scene_.bends = scene_.bends || !scene_.effects.torques.empty();
  }

  void make_drag() {
    for (Index i = 1; i < model().tree.shape.slots; ++i) {
      const double mass = model().constants.inertia(i, 0);
      if (!(mass > 0) || chance(0.3)) continue;
      const double r = std::min(rate(), 0.3 / h_);
      const double linear = chance(0.7) ? mass * r : 0, quadratic = chance(0.5) ? mass * std::min(r, 3.0) : 0;
      scene_.effects.drag.push_back({.slot = i, .linear = linear, .quadratic = quadratic});
    }
    if (chance(0.4)) scene_.effects.wind = {either_way(5), either_way(5), 0};
  }

  void make_ground() {
    Ground ground;
    std::vector<std::string> notes;
    ground.contacts = contacts_of(model(), notes);
    const reference::PlainScene scene = plain();
    double mass = 0;
    for (Index i = 1; i < model().tree.shape.slots; ++i) mass += model().constants.inertia(i, 0);
    const double w = spread(0.1, scene_.stiff ? 4 : 0.5) / h_, points = kind_ == rest_on_ground ? 4 : 1;
    ground.stiffness = std::min(mass * w * w / points, 1e7);
    ground.damping = chance(0.3) ? 0 : 2 * spread(0.02, 1) * std::sqrt(ground.stiffness * mass / points);
    ground.friction = chance(0.1) ? 0 : random_.uniform(0.1, 1);
    scene_.effects.ground = ground;
    // the ground comes up to the lowest point
    const reference::PlainTree& tree = scene.tree();
    const reference::PlainForces forces(tree, scene_.effects, scene_.options.gravity);
    double lowest = kInfinity;
    for (const auto& contact : forces.contacts(reference::body_motions(tree, scene.q, scene.v))) lowest = std::min(lowest, contact.gap);
    double fall = 0;
    if (kind_ == drop) {
      const double down = spread(0.05, 2);
      fall = down * h_ * random_.uniform(1, 10);
      for (Index i = 1; i < model().tree.shape.slots; ++i) {
        if (model().tree.kind(i) != JointKind::free) continue;
        const Vector3d in_body =
            reference::plain_joint_pose(tree.body(i), scene.q).linear().transpose() * Vector3d(0, 0, -down);
        for (int k = 0; k < 3; ++k) scene_.start.velocities[static_cast<std::size_t>(model().tree.first_v(i) + 3 + k)] += in_body[k];
      }
    } else if (chance(0.5)) {
      fall = -mass * 9.81 / (ground.stiffness * points);
    }
    scene_.effects.ground->height = lowest - fall;
    if (scene_.number % 4 == 0) make_rough();
  }

  /// Hills below the lowest point, around where the bodies are; numbers of its own, so that all else is as it would be on a plane.
  void make_rough() {
    constexpr Index kAcross = 61;
    Random random(scene_.seed * 7919 + scene_.number);
    const double spacing = 0.05 * std::pow(10.0, random.uniform(0, 1)), steepness = random.uniform(0.1, 0.6);
    HeightField field{.columns = kAcross, .rows = kAcross, .spacing_x = spacing, .spacing_y = spacing, .origin_x = -30.3 * spacing,
                      .origin_y = -29.6 * spacing, .heights = {}};
    for (Index k = 0; k < kAcross * kAcross; ++k) field.heights.push_back(-steepness * spacing * random.uniform(0, 1));
    scene_.effects.ground->terrain = std::move(field);
    scene_.rough = true;
  }

  /// To the end of the motion, for what has one; a long look now and then.
  void choose_length() {
    const bool ends = kind_ == settle || kind_ == servo || kind_ == friction || kind_ == rest_on_ground;
    double steps = ends ? spread(300, 1500) : spread(60, 600);
    steps = std::min(steps, 6000.0 / static_cast<double>(model().tree.bodies()));
    if (chance(0.02)) steps *= 10;
    scene_.steps = std::max<std::int64_t>(scene_.horizon, static_cast<std::int64_t>(steps));
  }

  Random random_;
  EverydayScene scene_;
  Kind kind_ = swing;
  double h_ = 1e-3;
  VectorXd inertia_, load_;
  std::set<Index> followers_;
  std::optional<GearTerm> cable_;  // its length
};

}  // namespace

EverydayScene everyday_scene(std::uint64_t seed, std::uint64_t number) {
  return touches(number) ? touching_scene(seed, number) : Maker(seed, number).make();
}

std::string EverydayScene::text() const {
  std::string acts;
  const auto name = [&](bool there, const char* what) {
    if (there) acts += (acts.empty() ? "" : ", ") + std::string(what);
  };
  name(options.gravity != std::array<double, 3>{0, 0, 0}, "gravity");
  name(!effects.armature.empty(), "armature");
  name(!effects.springs.empty() || !effects.ball_springs.empty(), "springs");
  name(!effects.dead_zone_springs.empty(), "dead zones");
  name(!effects.damping.empty(), "damping");
  name(!effects.servos.empty(), "servos");
  name(!effects.friction.empty(), "friction");
  name(!effects.limits.empty(), "limits");
  name(!effects.wrenches.empty(), "wrenches");
  name(!effects.torques.empty(), "torques");
  name(!effects.motions.empty(), "motion");
  name(!effects.drag.empty(), "drag");
  name(effects.ground.has_value(), rough ? "rough ground" : "ground");
  name(effects.contact.has_value(), "contact");
  const bool floats = model->tree.shape.slots > 1 && model->tree.kind(1) == JointKind::free;
  return fmt::format("{}{}, {} {}{}, {} base, h = {:.3g} ms, {} steps; {}", stiff ? "stiff " : "", kind, model->tree.bodies(),
                     model->tree.bodies() == 1 ? "body" : "bodies", model->mimics.empty() ? "" : ", ties", floats ? "floating" : "fixed",
                     1e3 * options.step, steps, acts.empty() ? "nothing acts" : acts);
}

}  // namespace linden
