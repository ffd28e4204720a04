// What is observed of a state: a simulation and a batch see the same, and both what the plain simulator's kinematics say.
#include "engine/queries/observations.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/batch.hpp"
#include "families.hpp"

namespace linden {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Of an entry's largest number, or one: what rounding leaves of twelve joints and of masses that differ by a factor of two hundred.
constexpr double kRounding = 1e-8;

/// Everything that there is to be seen, of links some.
std::vector<std::string> names_of(const EverydayScene& scene) {
  const Model& model = *scene.model;
  std::vector<std::string> names{"q", "v", "p", "time", "energy", "com", "com_velocity", "momentum"};
  if (!scene.effects.servos.empty()) names.push_back("targets");
  std::vector<std::string> links;
  for (const auto& [name, place] : model.names.link) links.push_back(name);
  std::ranges::sort(links);
  constexpr std::size_t kMostLinks = 3;
  const std::size_t first = scene.number % links.size();
  for (std::size_t k = 0; k < std::min(kMostLinks, links.size()); ++k) {
    const std::string& link = links[(first + k) % links.size()];
    for (const char* kind : {"pose", "twist"}) names.push_back(fmt::format("{}:{}", kind, link));
    if (model.mimics.empty()) {  // of tied joints a batch keeps no accelerations
      for (const char* kind : {"acceleration", "imu"}) names.push_back(fmt::format("{}:{}", kind, link));
    }
    if (scene.effects.ground) names.push_back("contact:" + link);
  }
  return names;
}

/// Numbers of one entry of a row.
VectorXd part(const Observed& entry, std::span<const double> row) {
  return vector_of(row.subspan(static_cast<std::size_t>(entry.offset), static_cast<std::size_t>(entry.width)));
}

/// Of poses the quaternions q and -q are one; rounding decides how many points there are where one just touches the ground: of contacts the
/// force is asked.
double apart(const Observed& entry, const VectorXd& a, const VectorXd& b) {
  if (entry.name.starts_with("contact:")) return std::abs(a[1] - b[1]);
  if (!entry.name.starts_with("pose:")) return (a - b).lpNorm<Eigen::Infinity>();
  const double turned = std::min((a.tail<4>() - b.tail<4>()).norm(), (a.tail<4>() + b.tail<4>()).norm());
  return std::max(turned, (a.head<3>() - b.head<3>()).norm());
}

/// more: what may be between them beside rounding.
void expect(const Observed& entry, const VectorXd& seen, const VectorXd& expected, const char* who, const char* by, Differences& found,
            double more = 0) {
  const double error = apart(entry, seen, expected), allowed = kRounding * std::max(1.0, expected.lpNorm<Eigen::Infinity>()) + more;
  if (error <= allowed) return;
  const std::string kind = entry.name.substr(0, entry.name.find(':'));
  found.add(Check::observations, fmt::format("{} of {}", kind, who),
            fmt::format("{} of {} is off {} by {:.3g}; expected {:.3g} at most", entry.name, who, by, error, allowed));
}

/// The damper of the ground takes hold at once where a point comes into it. Rounding decides whether one does that just touches the ground, and
/// with that of such a force [N] between what two see.
double force_of_touch(const EverydayScene& scene, const Observed& entry, const Observations& seen, std::span<const double> row) {
  if (!entry.name.starts_with("contact:")) return 0;
  constexpr double kTouches = 1e-12;  // [m]
  const Index slot = scene.model->names.link.at(entry.name.substr(entry.name.find(':') + 1)).slot;
  const Ground& ground = *scene.effects.ground;
  const reference::PlainTree tree = reference::plain_tree(*scene.model);
  const auto motions = reference::body_motions(tree, part(seen.at("q"), row), part(seen.at("v"), row));
  double sum = 0;
  for (const auto& contact : reference::PlainForces(tree, scene.effects, scene.options.gravity).contacts(motions)) {
    if (contact.slot != slot || std::abs(contact.gap) > kTouches) continue;
    const double rises = reference::vector_of(ground.normal).dot(motions[static_cast<std::size_t>(slot)].velocity_at(contact.gauge));
    sum += ground.damping * std::max(0.0, -rises);
  }
  return sum;
}

/// What the plain simulator's bodies say to positions and velocities as they were seen. at_start: nothing was stepped, so energies are of
/// these velocities, and nothing is known of accelerations.
void check_kinematics(const EverydayScene& scene, const Observations& seen, std::span<const double> row, bool at_start, const char* who,
                      Differences& found) {
  const VectorXd q = part(seen.at("q"), row), v = part(seen.at("v"), row);
  const reference::PlainTree tree = reference::plain_tree(*scene.model);
  const auto motions = reference::body_motions(tree, q, v);
  double mass = 0;
  Vector3d moment = Vector3d::Zero(), momentum = Vector3d::Zero();
  for (Index i = 1; i < tree.slots(); ++i) {
    const auto& motion = motions[static_cast<std::size_t>(i)];
    const Vector3d centre = motion.world(reference::center_of(tree.body(i)));
    mass += tree.body(i).mass();
    moment += tree.body(i).mass() * centre;
    momentum += tree.body(i).mass() * motion.velocity_at(centre);
  }
  const auto same = [&](const Observed& entry, const VectorXd& expected) {
    expect(entry, part(entry, row), expected, who, "the plain simulator's", found);
  };
  same(seen.at("com"), moment / mass);
  same(seen.at("com_velocity"), momentum / mass);
  for (const Observed& entry : seen.layout()) {
    const std::size_t colon = entry.name.find(':');
    if (colon == entry.name.npos || entry.width < 6) continue;
    const LinkPlace& link = scene.model->names.link.at(entry.name.substr(colon + 1));
    const auto& motion = motions[static_cast<std::size_t>(link.slot)];
    const Eigen::Matrix3d R = motion.R * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(link.in_body.rotation.data());
    const Vector3d origin = motion.world(Vector3d(link.in_body.shift[0], link.in_body.shift[1], link.in_body.shift[2]));
    VectorXd expected(entry.width);
    if (entry.name.starts_with("pose:")) {
      const Quaterniond turn(R);
      expected << origin, turn.coeffs();
    } else if (entry.name.starts_with("twist:")) {
      expected << motion.w, motion.velocity_at(origin);
    } else if (at_start && entry.name.starts_with("acceleration:")) {
      expected << motion.alpha, motion.acceleration_at(origin);
    } else if (at_start) {
      const Vector3d g(scene.options.gravity[0], scene.options.gravity[1], scene.options.gravity[2]);
      expected << R.transpose() * motion.w, R.transpose() * (motion.acceleration_at(origin) - g);
    } else {
      continue;
    }
    same(entry, expected);
  }
  if (!at_start) return;
  VectorXd energy = part(seen.at("energy"), row);
  // where bodies are, not where the plain simulator closes couplings: near a singular position that is far away
  reference::PlainScene plain(*scene.model, scene.effects, scene.options.gravity);
  plain.q = q;
  energy[0] = 0.5 * v.dot(plain.mass_matrix() * v);
  same(seen.at("energy"), energy);
}

}  // namespace

void check_observations(const EverydayScene& scene, Differences& found) {
  Observations seen(*scene.model, scene.effects, names_of(scene));
  std::vector<double> row(static_cast<std::size_t>(seen.width()));
  Simulation moved = simulation_of(scene, scene.options.step);
  // bodies that touch each other are stepped one simulation at a time
  std::optional<Batch> batch;
  if (!scene.effects.contact) batch.emplace(scene.model, 3, scene.options, scene.effects, BatchOptions{.threads = 1});
  std::vector<double> rows(3 * row.size());
  for (const bool at_start : {true, false}) {
    if (!at_start && !moved.run(scene.horizon).ok()) return;  // is another check's
    seen.observe(moved, row);
    check_kinematics(scene, seen, row, at_start, "a simulation", found);
    // the same state in both, as their start
    Simulation alone(scene.model, scene.options, scene.effects);
    alone.set_positions(moved.positions());
    alone.set_velocities(moved.velocities());
    seen.observe(alone, row);
    if (!batch) continue;
    batch->reset(1, moved.positions(), moved.velocities());
    batch->observe(seen, rows);
    const std::span<const double> second = std::span(rows).subspan(row.size(), row.size());
    for (const Observed& entry : seen.layout()) {
      expect(entry, part(entry, second), part(entry, row), "a batch", "a simulation's", found, force_of_touch(scene, entry, seen, row));
    }
    check_kinematics(scene, seen, second, true, "a batch", found);
  }
}

}  // namespace linden
