// What acted on bodies in the step that a simulation took last: Simulation::contact_points, Simulation::body_wrenches.
#include "engine/effects/effect_plan.hpp"
#include "engine/queries/link_frames.hpp"
#include "engine/simulation.hpp"
#include "engine/solve/stepper.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

const StepImpulses& kept(const std::optional<StepImpulses>& impulses) {
  if (!impulses) throw InputError("what acts on bodies was asked for and none of it is kept; call keep_forces before the step");
  return *impulses;
}

}  // namespace

std::vector<double> Simulation::body_wrenches() const {
  std::vector<double> wrenches = mean_forces(kept(impulses_).bodies);
  wrenches.resize(static_cast<std::size_t>(model_->tree.shape.slots) * 6);  // without effects on bodies there are none
  return wrenches;
}

std::span<const double> Simulation::contact_memory() { return stepper_->contact_memory(); }

std::vector<ContactPoint> Simulation::contact_points() const {
  const StepImpulses& impulses = kept(impulses_);
  const Kinematics now(*model_, positions());
  const auto three = [](const std::vector<double>& numbers, std::size_t k) { return Vec3<double>::from(&numbers[3 * k]); };
  std::vector<ContactPoint> points;
  for (std::size_t k = 0; k < impulses.closed.size(); ++k) {
    if (impulses.closed[k] == 0) continue;
    const Index slot = plan_->ground.points[k].slot;
    const auto T = linden::load<Placement, double>(now.bodies().pose, slot);
    points.push_back({slot, array_of(T.p + T.R * three(impulses.places, k)), array_of(three(impulses.normals, k)),
                      array_of(three(impulses.pushes, k) / last_step())});
  }
  for (const TouchImpulse& touch : impulses.touches) {
    const bool on_b = touch.slot_b != 0;  // what is fixed to the world pushes, and is not pushed
    const double sign = (on_b ? 1 : -1) / last_step();
    ContactPoint& point = points.emplace_back(ContactPoint{on_b ? touch.slot_b : touch.slot_a, touch.place, touch.normal, touch.impulse, touch.moment});
    for (std::size_t k = 0; k < 3; ++k) {
      point.force[k] *= sign;
      point.moment[k] *= sign;
      if (!on_b) point.normal[k] = -point.normal[k];
    }
    point.other = on_b ? touch.slot_a : touch.slot_b;
    const PairContact& contact = *plan_->effects.contact;
    const auto& [first, second] = contact.pairs[touch.pair];
    const bool in_order = contact.shapes[first].slot == point.slot;
    point.link = contact.shapes[in_order ? first : second].link;
    point.other_link = contact.shapes[in_order ? second : first].link;
  }
  return points;
}

}  // namespace linden
