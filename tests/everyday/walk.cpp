#include "walk.hpp"

#include <cmath>

namespace linden {

using Eigen::VectorXd;
using reference::PlainScene;
using reference::PlainTree;

double size_of(const Model& model, const VectorXd& row_values) {
  double most = 0;
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const JointKind kind = model.tree.kind(i);
    for (Index k = 0; k < velocity_count(kind); ++k) {
      const bool length = kind == JointKind::screw ? model.constants.screw(i, 0) == 0 : k >= 3;
      const double value = std::abs(row_values[model.tree.first_v(i) + k]) / (length ? kArm : 1);
      if (!(value <= most)) most = value;
    }
  }
  return most;
}

VectorXd mean_velocity(const PlainTree& tree, const VectorXd& from, const VectorXd& to, double step) {
  VectorXd rate(tree.velocities);
  for (Index i = 1; i < tree.slots(); ++i) {
    const reference::PlainBody& body = tree.body(i);
    if (body.kind == JointKind::screw) {
      rate[body.v] = (to[body.q] - from[body.q]) / step;
      continue;
    }
    const Index turn = body.kind == JointKind::free ? body.q + 3 : body.q;
    const Eigen::Quaterniond before(Eigen::Vector4d(from.segment<4>(turn))), after(Eigen::Vector4d(to.segment<4>(turn)));
    Eigen::Vector4d between = (before.conjugate() * after).coeffs();
    if (between[3] < 0) between = -between;
    const Eigen::Vector3d w = reference::rotation_vector<double>(between);
    rate.segment<3>(body.v) = w / step;
    if (body.kind == JointKind::free) {
      const Eigen::Vector3d shift = before.conjugate() * (to.segment<3>(body.q) - from.segment<3>(body.q));
      rate.segment<3>(body.v + 3) = reference::bernoulli_series<double, 3>(reference::hat<double>(w)) * shift / step;
    }
  }
  return rate;
}

VectorXd vector_of(std::span<const double> numbers) {
  return Eigen::Map<const VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

Simulation simulation_of(const EverydayScene& scene, double step) {
  Options options = scene.options;
  options.step = step;
  Simulation simulation(scene.model, options, scene.effects);
  simulation.set_positions(scene.start.positions);
  simulation.set_velocities(scene.start.velocities);
  return simulation;
}

Walk walk(const EverydayScene& scene, std::int64_t steps) {
  Simulation simulation = simulation_of(scene, scene.options.step);
  Walk result;
  const auto keep = [&](int blows) {
    const VectorXd v = vector_of(simulation.velocities());
    result.nodes.push_back({vector_of(simulation.positions()), v, simulation.energy(), simulation.effect_work(), blows});
  };
  keep(0);
  for (std::int64_t k = 0; k < steps; ++k) {
    const StepReport report = simulation.step();
    if (!report.ok()) {
      result.failed = report;
      result.failure = simulation.describe(report);
      break;
    }
    keep(report.blows);
  }
  return result;
}

PlainScene plain_of(const EverydayScene& scene, const VectorXd& q, const VectorXd& v, double time) {
  PlainScene plain(*scene.model, scene.effects, scene.options.gravity);
  plain.time = time;
  plain.ease_contact(scene.options.step);
  plain.start(q, v);
  return plain;
}

PlainScene plain_of(const EverydayScene& scene) {
  return plain_of(scene, vector_of(scene.start.positions), vector_of(scene.start.velocities), 0);
}

}  // namespace linden
