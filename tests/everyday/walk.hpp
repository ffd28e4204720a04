// tests/everyday/walk.hpp
// A scene as the engine takes it, every node of it kept, and what follows from the nodes alone.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "engine/simulation.hpp"
#include "scene.hpp"
#include "tests/reference/plain_scene.hpp"

namespace linden {

/// Metres count as much as radians do at this distance [m].
inline constexpr double kArm = 0.2;

/// One number for positions or velocities, in radians or shares of kArm.
double size_of(const Model& model, const Eigen::VectorXd& row_values);

/// Mean velocity [nv] of a step from one position to the next.
Eigen::VectorXd mean_velocity(const reference::PlainTree& tree, const Eigen::VectorXd& from, const Eigen::VectorXd& to, double step);

Eigen::VectorXd vector_of(std::span<const double> numbers);

struct Node {
  Eigen::VectorXd q, v;
  Energy energy;
  EffectWork work;
  int blows = 0;  // on limits, in the step that ends there
  double balance() const { return energy.total() + work.taken() - work.given(); }
};

struct Walk {
  std::vector<Node> nodes;  // the first is the start
  StepReport failed;        // ok where none did
  std::string failure;
};

Simulation simulation_of(const EverydayScene& scene, double step);

/// So many steps, or to the first that is refused.
Walk walk(const EverydayScene& scene, std::int64_t steps);

/// The plain simulator at a place and time of the scene.
reference::PlainScene plain_of(const EverydayScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v, double time);
reference::PlainScene plain_of(const EverydayScene& scene);

}  // namespace linden
