#include "engine/program/animator.hpp"

#include <fmt/format.h>

#include <utility>

#include "engine/view/curves.hpp"

namespace linden {
namespace {

/// Quantities that curves are drawn of, where the scene has them.
std::vector<Quantity> curve_quantities(const Simulation& simulation) {
  std::vector<Quantity> quantities = available_quantities(simulation);
  std::erase(quantities, Quantity::servos);  // among the forces
  return quantities;
}

}  // namespace

Animator::Animator(Simulation& simulation, const ViewArguments& arguments, std::int64_t steps, const std::vector<std::string>& observed)
    : simulation_(simulation),
      observer_(simulation, curve_quantities(simulation), observed),
      recorder_(simulation.model(), simulation.effects(), simulation.model().names.model, 1) {
  simulation.keep_forces();
  const FrameStride stride = frame_stride(steps, simulation.options().step, arguments.fps, simulation.model().tree.bodies());
  stride_ = stride.steps;
  if (!stride.note.empty()) recorder_.add_note(stride.note);
  add_curves(static_cast<std::size_t>(steps / stride_ + 2));
}

void Animator::add_curves(std::size_t frames) {
  constexpr std::size_t kMostNumbers = 4'000'000;  // of an array; a humanoid's rows for half an hour
  const Model& model = simulation_.model();
  for (std::size_t k = 0; k < observer_.arrays().size(); ++k) {
    const RecordedArray& array = observer_.arrays()[k];
    if (array.rows.size() * frames > kMostNumbers) {
      recorder_.add_note(fmt::format("no curves of {}: {} rows are too many; --observe shows single ones", array.name, array.rows.size()));
      continue;
    }
    shown_.push_back(k);
    const std::optional<Quantity> quantity = observer_.quantity_of_array()[k];
    if (quantity == Quantity::positions) {
      recorder_.add_curves(position_curves(model, 0));
    } else if (quantity == Quantity::velocities || quantity == Quantity::forces) {
      recorder_.add_curves(quantity == Quantity::forces ? force_curves(model, 0) : velocity_curves(model, 0));
    } else {
      std::vector<Curve> curves;
      const bool counts = array.name == "contacts";
      const std::string unit = quantity == Quantity::energies ? "J" : quantity == Quantity::contacts && !counts ? "N" : array.units;
      const std::string group = quantity == Quantity::energies ? "energy" : counts ? "contact points" : array.name == "normal_forces" ? "normal force" : array.name;
      for (const std::string& row : array.rows) curves.push_back({group, row, unit, -1, 0, {}});
      recorder_.add_curves(std::move(curves));
    }
  }
}

void Animator::look() {
  const auto arrays = observer_.look();
  numbers_.clear();
  for (const std::size_t k : shown_) numbers_.insert(numbers_.end(), arrays[k].begin(), arrays[k].end());
  recorder_.add(simulation_.time(), simulation_.positions(), numbers_, forces_of(simulation_, 0));
}

}  // namespace linden
