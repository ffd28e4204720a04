#include "engine/program/contact_cost.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "engine/queries/kinematics.hpp"
#include "engine/simulation.hpp"
#include "engine/sweeps/body_contacts.hpp"
#include "kernels/queries/body_motion_down.hpp"

namespace linden {
namespace {

constexpr double kContactSeconds = 0.5;  // of steps
constexpr int kFinds = 20;

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

/// None, 1 to 4, 5 to 8, 9 to 16, ...
TouchingSteps group_of(std::size_t places) {
  if (places == 0) return {0, 0, 0, 0};
  std::size_t most = 4;
  while (most < places) most *= 2;
  return {most == 4 ? 1 : most / 2 + 1, most, 0, 0};
}

std::size_t places_of(const Simulation& simulation) {
  const auto of_shapes = [](const ContactPoint& point) { return !point.other_link.empty(); };
  return static_cast<std::size_t>(std::ranges::count_if(simulation.contact_points(), of_shapes));
}

}  // namespace

ContactCost contact_cost(const Scene& scene) {
  Simulation simulation(scene.model, scene.options, scene.effects);
  if (!scene.initial.positions.empty()) simulation.set_positions(scene.initial.positions);
  if (!scene.initial.velocities.empty()) simulation.set_velocities(scene.initial.velocities);
  simulation.keep_forces();
  ContactCost cost{.pairs = scene.effects.contact->pairs.size()};
  const auto steps = static_cast<std::int64_t>(std::ceil(scene.duration / scene.options.step));
  double taken = 0;
  for (std::int64_t k = 0; k < steps && taken < kContactSeconds; ++k) {
    const Clock::time_point begin = Clock::now();
    if (!simulation.step().ok()) break;
    const double seconds = seconds_since(begin);
    taken += seconds;
    const TouchingSteps group = group_of(places_of(simulation));
    auto found = std::ranges::lower_bound(cost.steps, group.most, {}, &TouchingSteps::most);
    if (found == cost.steps.end() || found->most != group.most) found = cost.steps.insert(found, group);
    found->count += 1;
    found->seconds += seconds;
  }
  for (TouchingSteps& group : cost.steps) group.seconds /= static_cast<double>(group.count);

  const Kinematics now(simulation);
  BodyContacts contacts(*scene.effects.contact, scene.model);
  cost.find = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kFinds; ++k) {
    const Clock::time_point begin = Clock::now();
    contacts.find(now.bodies().pose);
    cost.find = std::min(cost.find, seconds_since(begin));
  }
  cost.near = contacts.touches().size();
  return cost;
}

}  // namespace linden
