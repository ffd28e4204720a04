// bench/peer.hpp
// What a comparison asks of an engine: to hold instances of one robot, started from linden's numbers, to step them together, and
// to say in linden's numbers where they are.
//
//   peers.cpp         checks and times all of them alike
//   peer_linden.cpp   Simulation, Batch, FloatBatch
//   peer_mujoco.cpp   MuJoCo, only where it is installed: knows a robot from its file, by its own reader
//   peer_mjcf.cpp     what is made in code, written for it body by body
//   peer_dart.cpp     DART, only where it is installed: is given the bodies of linden's model, one by one
//
// tests/gallery has them beside its hard cases. No engine has anything to do but gravity, springs and dampers: no contact,
// limits, friction, motors or sensors.
#pragma once

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"

namespace linden {

struct Robot {
  std::string name;
  std::string file;  // URDF; empty: made in code
  std::shared_ptr<const Model> model;
  Effects effects{};  // springs and damping of screws alone, and only of what was made in code
};

struct Plan {
  double step = 1e-3;  // [s]
  std::int64_t instances = 1;
  int threads = 1;
  double gravity = 9.81;  // [m/s^2], downwards
};

/// Positions [nq] and velocities [nv] are rows of the robot's model, frames and quaternions as Simulation's.
class Peer {
 public:
  virtual ~Peer() = default;

  virtual double mass() const = 0;  // [kg]
  virtual Index degrees_of_freedom() const = 0;

  virtual void reset(std::int64_t i, const InitialState& start) = 0;
  /// n steps of every instance, with nothing to be seen in between. Throws std::runtime_error where one fails.
  virtual void step(int n) = 0;

  virtual std::vector<double> positions(std::int64_t i) = 0;
  virtual Energy energy(std::int64_t i) = 0;
  /// Of all bodies, about the world's origin, as the engine's own velocities and inertias have it; nothing where it is not asked for.
  virtual std::optional<Momentum> momentum(std::int64_t) { return std::nullopt; }
};

/// One engine with one integrator.
struct Contender {
  std::string name;         // "mujoco-rk4"
  std::string description;  // "MuJoCo 2.2.2, classical Runge-Kutta"
  bool alone, many;         // whether it is timed with one instance, whether with many
  double rounding;          // relative; to this its energy must agree with linden's
  std::function<std::unique_ptr<Peer>(const Robot&, const Plan&)> make;
};

/// MJCF of a model made in code. Throws std::runtime_error for what MuJoCo has no joint for.
std::string mjcf_of(const Robot& robot);

Contender linden_of_order(int order);
std::vector<Contender> linden_contenders();
std::vector<Contender> mujoco_contenders();
std::vector<Contender> dart_contenders();

/// Threads that share out instances: for engines that leave it to their user.
class Team {
 public:
  explicit Team(int threads) : arena_(threads) {}

  template <class Each>
  void share(std::size_t count, const Each& each) {
    if (arena_.max_concurrency() == 1 || count == 1) {
      for (std::size_t i = 0; i < count; ++i) each(i);
      return;
    }
    arena_.execute([&] { tbb::parallel_for(std::size_t{0}, count, each); });
  }

 private:
  tbb::task_arena arena_;
};

}  // namespace linden
