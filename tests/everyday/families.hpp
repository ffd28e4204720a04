// tests/everyday/families.hpp
// The checks one by one, as tests/everyday/check.cpp calls them.
#pragma once

#include "check.hpp"
#include "walk.hpp"

namespace linden {

class Differences {
 public:
  explicit Differences(std::optional<Check> only) : only_(only) {}
  bool asked(Check check) const { return !only_ || *only_ == check; }
  /// The first of a kind is kept.
  void add(Check check, const std::string& what, const std::string& text) {
    if (!asked(check)) return;
    for (const Difference& one : list) {
      if (one.check == check && one.what == what) return;
    }
    list.push_back({check, what, text});
  }
  std::vector<Difference> list;

 private:
  std::optional<Check> only_;
};

void check_refused(const EverydayScene& scene, const Walk& walk, Differences& found);
void check_position(const EverydayScene& scene, Differences& found);
void check_energy(const EverydayScene& scene, const Walk& walk, Differences& found);
/// What rests, and velocities at nodes.
void check_velocities(const EverydayScene& scene, const Walk& walk, Differences& found);
void check_batch_velocities(const EverydayScene& scene, const Walk& walk, Differences& found);
void check_bits(const EverydayScene& scene, Differences& found);
void check_observations(const EverydayScene& scene, Differences& found);
/// What is told of bodies that touch each other.
void check_contact(const EverydayScene& scene, Differences& found);
/// Velocities right after a joint has met a limit.
void check_blow(const EverydayScene& scene, Differences& found);

/// What second order leaves of a row's momentum in a step where bodies turn at `turn` [rad/s], of so much m v^2 in all `moving` [J]; most: the
/// speed that all energy would give the row, which weighs `inertia`.
inline double left_by_second_order(double step, double turn, double moving, double most, double inertia) {
  return step * step * turn * (0.25 * turn * most + moving / (3 * inertia));
}

}  // namespace linden
