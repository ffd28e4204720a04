// engine/program/pull.hpp
// Springs with which people pull at bodies of a running simulation, each from a point of a body to a place in the world.
//
//   force      f = k (to - x) - c v at the point, no more than ten times the weight of what hangs together there
//   stiffness  k = m w^2 and damping c = 2 z m w, m the mass of all that hangs on the same joint of the world, w = 9 rad/s, z = 0.7:
//              heavy and light are lifted alike, and hang 12 cm below the place that they are drawn to
//   kept sane  x and v are those at the end of the step that is to come, as far as its force moves them: with W = J M^-1 J^T
//              (1 + (c h + k h^2) W) f = k (to - x - h v) - c v, so that the spring of a heavy robot cannot throw its finger about
//
// They go in as generalized forces (Simulation::set_forces), J^T f. cost  of each pull and step some O(n) passes; none where nobody pulls.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "engine/simulation.hpp"
#include "engine/view/live.hpp"

namespace linden {

struct Pull {
  Index slot = 0;
  std::array<double, 3> point{};  // in the frame of the body's link, as pages have it [m]
  std::array<double, 3> to{};     // world frame [m]
};

class Pulls {
 public:
  /// The simulation must outlive it and have no other generalized forces.
  explicit Pulls(Simulation& simulation) : simulation_(simulation) {}

  /// The one pull of somebody, or where it has moved to.
  void set(std::uint64_t who, const Pull& pull) { pulls_[who] = pull; }
  void release(std::uint64_t who) { pulls_.erase(who); }
  void release_all() { pulls_.clear(); }
  bool any() const { return !pulls_.empty(); }

  /// Sets the forces of the step that comes next: to be called before each, where there are any pulls or were any before the last.
  void apply();
  bool acts() const { return any() || applied_; }

  /// As they are now.
  std::vector<DrawnPull> drawn();

 private:
  Kinematics& now();
  LinkPlace place(const Pull& pull) const;

  Simulation& simulation_;
  std::optional<Kinematics> now_;  // once somebody pulls
  std::map<std::uint64_t, Pull> pulls_;
  bool applied_ = false;
};

}  // namespace linden
