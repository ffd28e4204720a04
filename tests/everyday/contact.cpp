// What a simulation tells of bodies that touch each other, beside what follows from it: forces and momentum, places and shapes, distances, friction.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/simulation.hpp"
#include "families.hpp"
#include "tests/reference/convex_plain.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;
using reference::vector_of;

reference::PlainConvex placed(const ConvexBody& shape, const std::vector<reference::BodyMotion>& motions) {
  const reference::BodyMotion& motion = motions[static_cast<std::size_t>(shape.slot)];
  Pose pose;
  const Eigen::Matrix3d R = motion.R * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(shape.pose.rotation.data());
  const Vector3d p = motion.world(vector_of(shape.pose.shift));
  for (int k = 0; k < 9; ++k) pose.rotation[static_cast<std::size_t>(k)] = R(k / 3, k % 3);
  for (int k = 0; k < 3; ++k) pose.shift[static_cast<std::size_t>(k)] = p[k];
  return reference::plain_convex(shape.shape, pose);
}

/// Of each step: no force pulls, friction keeps to its cone, and what nothing acts on from outside keeps its momentum.
class Touched {
 public:
  Touched(const EverydayScene& scene, const Momentum& start, Differences& found) : scene_(scene), found_(found), start_(start) {
    for (const auto& [slot, mass] : masses()) total_ += mass;
    const bool weighs = scene.options.gravity != std::array<double, 3>{0, 0, 0}, fixed = !scene.model->welded.shapes.empty();
    alone_ = !weighs && !fixed && scene.effects.wrenches.empty() && scene.effects.drag.empty();
  }

  void look(std::int64_t step, Simulation& simulation) {
    const double mu = std::max(scene_.effects.contact->materials[0].friction, scene_.effects.ground ? scene_.effects.ground->friction : 0.0);
    const std::vector<ContactPoint> points = simulation.contact_points();
    double largest = 0;
    for (const ContactPoint& point : points) largest = std::max(largest, vector_of(point.force).norm());
    const double rounding = 1e-9 * largest;
    const ContactMaterial& material = scene_.effects.contact->materials[0];
    for (const ContactPoint& point : points) {
      const Vector3d n = vector_of(point.normal), force = vector_of(point.force);
      const double presses = n.dot(force), rubs = (force - presses * n).norm();
      if (std::abs(n.norm() - 1) > 1e-12) add("normal", step, fmt::format("a normal is {} long; expected 1", n.norm()));
      if (!(presses >= -rounding)) add("pulls", step, fmt::format("a place pulls with {:.3g} N; expected none", -presses));
      if (!(rubs <= mu * presses + 1e-6 * mu * std::abs(presses) + rounding)) {
        add("cone of friction", step, fmt::format("{:.6g} N across where {:.6g} N press; expected {:.3g} of it at most", rubs, presses, mu));
      }
      const Vector3d moment = vector_of(point.moment);
      const double spins = std::abs(n.dot(moment)), rolls = (moment - n.dot(moment) * n).norm();
      const auto resists = [&](const char* what, double found, double length) {
        if (found <= length * ((1 + 1e-6) * presses + rounding) + 1e-12 * moment.norm()) return;  // directions in the world are rounded
        add(what, step, fmt::format("{:.6g} N m where {:.6g} N press; expected {:.3g} m times that at most", found, presses, length));
      };
      resists("rolling friction", rolls, material.rolling_friction);
      resists("torsional friction", spins, material.torsional_friction);
    }
    // within a blow velocities are read a step late, and momenta are of those: before it and after it they are the same
    const bool apart = points.empty() && apart_;
    apart_ = points.empty();
    if (!alone_ || !apart) return;
    const Momentum now = simulation.momentum();
    const Vector3d linear = vector_of(start_.linear), spin = vector_of(start_.angular);
    const double scale = linear.norm() + spin.norm() + 1e-3 * total_;
    const auto stays = [&](const char* what, double change) {
      if (!(change <= 1e-8 * scale)) add(what, step, fmt::format("{} of what is by itself has changed by {:.3g}; expected {:.3g} at most", what, change, 1e-8 * scale));
    };
    stays("momentum", (vector_of(now.linear) - linear).norm());
    stays("angular momentum", (vector_of(now.angular) - spin).norm());
  }

  /// Shapes at the end of a step.
  void look_at_shapes(std::int64_t step, Simulation& simulation) {
    const reference::PlainTree tree = reference::plain_tree(*scene_.model);
    const Eigen::VectorXd q = linden::vector_of(simulation.positions());
    const auto motions = reference::body_motions(tree, q, Eigen::VectorXd::Zero(tree.velocities));
    double deepest = 0;
    for (const auto& [a, b] : scene_.effects.contact->pairs) {
      const auto &one = scene_.effects.contact->shapes[a], &other = scene_.effects.contact->shapes[b];
      deepest = std::min(deepest, reference::signed_distance(placed(one, motions), placed(other, motions)));
    }
    // a blow is stopped within a step: as far as it goes in one, or as the spring stops it; and what stands on it
    double fastest = 0, heaviest = 0;
    for (const auto& [slot, mass] : masses()) heaviest += mass;
    for (const auto& motion : reference::body_motions(tree, q, linden::vector_of(simulation.velocities()))) fastest = std::max(fastest, motion.velocity.norm() + 0.3 * motion.w.norm());
    fastest_ = std::max(fastest_, fastest);
    const double k = scene_.effects.contact->materials[0].stiffness;
    const double allowed = 2 * fastest_ * (scene_.options.step + std::sqrt(heaviest / k)) + 20 * heaviest * 9.81 / k + 1e-6;
    if (-deepest > allowed) add("deep", step, fmt::format("bodies are {:.3g} m within each other; expected {:.3g} at most", -deepest, allowed));
  }

 private:
  std::vector<std::pair<Index, double>> masses() const {
    std::vector<std::pair<Index, double>> all;
    for (Index i = 1; i < scene_.model->tree.shape.slots; ++i) all.push_back({i, scene_.model->constants.inertia(i, 0)});
    return all;
  }
  void add(const char* what, std::int64_t step, const std::string& text) {
    found_.add(Check::contact, what, fmt::format("step {}: {}", step, text));
  }

  const EverydayScene& scene_;
  Differences& found_;
  Momentum start_;
  double total_ = 0, fastest_ = 0;
  bool apart_ = true;   // at the end of the last step
  bool alone_ = false;  // nothing acts on the whole from outside
};

}  // namespace

void check_contact(const EverydayScene& scene, Differences& found) {
  Simulation simulation = simulation_of(scene, scene.options.step);
  simulation.keep_forces();
  Touched touched(scene, simulation.momentum(), found);
  for (std::int64_t k = 1; k <= scene.steps; ++k) {
    if (!simulation.step().ok()) return;  // is another check's
    touched.look(k, simulation);
    if (k % 50 == 0 || k == scene.steps) touched.look_at_shapes(k, simulation);
  }
}

}  // namespace linden
