#include "engine/program/quantities.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>
#include <string_view>
#include <type_traits>

#include "engine/queries/energy_by_effect.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

const std::vector<std::string> kNames{"positions", "velocities", "servos", "forces", "energies", "contacts"};

std::vector<std::string> names_of(const std::vector<Quantity>& quantities) {
  std::vector<std::string> names;
  for (const Quantity quantity : quantities) names.push_back(std::string(name(quantity)));
  return names;
}

}  // namespace

std::string_view name(Quantity quantity) { return kNames[static_cast<std::size_t>(quantity)]; }

std::vector<Quantity> quantities_from(const std::string& text) {
  std::vector<Quantity> quantities;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const auto found = std::ranges::find(kNames, word);
    if (found == kNames.end()) {
      const std::string guess = nearest(word, kNames);
      throw InputError(fmt::format("--what {}: \"{}\" is not known; expected some of {}, with commas{}", text, word, fmt::join(kNames, ", "),
                                   guess.empty() ? "" : fmt::format("; did you mean {}?", guess)));
    }
    const auto quantity = static_cast<Quantity>(found - kNames.begin());
    if (std::ranges::count(quantities, quantity) > 0) throw InputError(fmt::format("--what {} names {} twice", text, word));
    quantities.push_back(quantity);
    begin = end + 1;
  }
  return quantities;
}

std::vector<Quantity> usual_quantities(const std::string& file) {
  if (std::filesystem::path(file).extension() == ".csv") return {Quantity::positions};
  return {Quantity::positions, Quantity::velocities};
}

std::vector<Quantity> available_quantities(const Simulation& simulation) {
  const Effects& effects = simulation.effects();
  std::vector<Quantity> there{Quantity::positions, Quantity::velocities};
  if (!effects.servos.empty()) there.push_back(Quantity::servos);
  bool acts = false;  // a rotor alone does not
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    acts = acts || (!std::is_same_v<Entry, Armature> && !entries.empty());
  });
  if (acts) there.push_back(Quantity::forces);
  there.push_back(Quantity::energies);
  if (effects.ground) there.push_back(Quantity::contacts);
  return there;
}

void require_available(const std::vector<Quantity>& asked, const std::vector<Quantity>& there, std::string_view where) {
  for (const Quantity quantity : asked) {
    if (std::ranges::find(there, quantity) != there.end()) continue;
    throw InputError(fmt::format("--what {}: {} has none; expected some of {}; leave it out", name(quantity), where,
                                 fmt::join(names_of(there), ", ")));
  }
}

std::vector<std::string> observation_names(const std::string& text) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    names.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

std::optional<Observations> observations_of(const Model& model, const Effects& effects, const std::vector<std::string>& names) {
  if (names.empty()) return std::nullopt;
  try {
    return std::optional<Observations>(std::in_place, model, effects, names);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--observe: {}", error.what()));
  }
}

std::vector<RecordedArray> recorded_observations(const Observations& observations) {
  std::vector<RecordedArray> arrays;
  for (const Observed& entry : observations.layout()) {
    std::string name = entry.name;
    std::ranges::replace(name, '/', '_');
    arrays.push_back({name, name + "_names", entry.rows, entry.name + ".", entry.units});
  }
  return arrays;
}

Observer::Observer(Simulation& simulation, std::vector<Quantity> quantities, const std::vector<std::string>& observed)
    : simulation_(simulation), quantities_(std::move(quantities)),
      observations_(observations_of(simulation.model(), simulation.effects(), observed)) {
  require_available(quantities_, available_quantities(simulation), "the scene");
  const Names& names = simulation.model().names;
  for (const Quantity quantity : quantities_) {
    switch (quantity) {
      case Quantity::positions: add(quantity, recorded_positions(names)); break;
      case Quantity::velocities: add(quantity, recorded_velocities(names)); break;
      case Quantity::servos: {
        simulation.keep_forces();
        RecordedArray array{"servo_forces", "servos", {}, "servo."};
        for (const Servo& servo : simulation.effects().servos) array.rows.push_back(names.velocity[static_cast<std::size_t>(servo.row)]);
        add(quantity, std::move(array));
        break;
      }
      case Quantity::forces:
        simulation.keep_forces();
        add(quantity, {"forces", "velocities", names.velocity, "force."});
        break;
      case Quantity::energies: {
        RecordedArray array{"energies", "energy_names", {}, "energy."};
        for (const EnergyShare& share : energy_by_effect(simulation)) array.rows.push_back(share.name);
        add(quantity, std::move(array));
        break;
      }
      case Quantity::contacts: {
        simulation.keep_forces();
        std::vector<std::string> bodies;
        for (const BodyContact& contact : simulation.contacts()) bodies.push_back(names.body[static_cast<std::size_t>(contact.slot)]);
        add(quantity, {"contacts", "contact_bodies", bodies, "contacts."});
        add(quantity, {"normal_forces", "contact_bodies", bodies, "normal_force."});
        break;
      }
    }
  }
  if (!observations_) return;
  for (RecordedArray& array : recorded_observations(*observations_)) add(std::nullopt, std::move(array));
  look();  // refuses accelerations where there are none
}

void Observer::add(std::optional<Quantity> quantity, RecordedArray array) {
  of_array_.push_back(quantity);
  arrays_.push_back(std::move(array));
}

std::vector<double> Observer::energies() {
  std::vector<double> now;
  for (const EnergyShare& share : energy_by_effect(simulation_)) now.push_back(share.energy);
  return now;
}

std::span<const std::span<const double>> Observer::look() {
  numbers_.clear();
  for (const Quantity quantity : quantities_) {
    switch (quantity) {
      case Quantity::positions: numbers_.emplace_back(simulation_.positions().begin(), simulation_.positions().end()); break;
      case Quantity::velocities: numbers_.push_back(simulation_.velocities()); break;
      case Quantity::servos: numbers_.push_back(simulation_.servo_torques()); break;
      case Quantity::forces: numbers_.push_back(simulation_.joint_forces()); break;
      case Quantity::energies: numbers_.push_back(energies()); break;
      case Quantity::contacts: {
        std::vector<double> closed, force;
        for (const BodyContact& contact : simulation_.contacts()) {
          closed.push_back(contact.closed);
          force.push_back(contact.normal_force);
        }
        numbers_.push_back(std::move(closed));
        numbers_.push_back(std::move(force));
        break;
      }
    }
  }
  if (observations_) {
    std::vector<double> row(static_cast<std::size_t>(observations_->width()));
    observations_->observe(simulation_, row);
    for (const Observed& entry : observations_->layout()) {
      numbers_.emplace_back(row.begin() + entry.offset, row.begin() + entry.offset + entry.width);
    }
  }
  views_.assign(numbers_.begin(), numbers_.end());
  return views_;
}

}  // namespace linden
