// engine/program/quantities.hpp
// What --record and --plot take beside time and energy: --what positions,velocities,servos,forces,energies,contacts.
//
//   positions   q
//   velocities  v, of the motion (engine/VELOCITY.md)
//   servos      force of each servo, mean over the step before [N m, N]
//   forces      generalized forces of all effects together, likewise, row by row of v
//   energies    kinetic energy, potentials of gravity, springs and ground, and what each effect took or gave since the start [J]
//   contacts    of every body that may touch the ground: contact points that push it, and their normal force, likewise [N]
//
// and beside them what --observe names: observations of engine/queries/observations.hpp, pose:hand,com,contact:left_foot.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/files/rollout_file.hpp"
#include "engine/queries/observations.hpp"
#include "engine/simulation.hpp"

namespace linden {

enum class Quantity : std::uint8_t { positions, velocities, servos, forces, energies, contacts };

std::string_view name(Quantity quantity);
/// "positions,energies". Throws InputError, with the nearest name, for what is none of them or is there twice.
std::vector<Quantity> quantities_from(const std::string& text);

/// What a table has unless told otherwise, and what files of arrays have.
std::vector<Quantity> usual_quantities(const std::string& file);

/// Those that there are in a simulation's scene.
std::vector<Quantity> available_quantities(const Simulation& simulation);
/// Throws InputError for what is asked for and not there. where: that has not got it.
void require_available(const std::vector<Quantity>& asked, const std::vector<Quantity>& there, std::string_view where);

/// "pose:hand,com": the names between commas.
std::vector<std::string> observation_names(const std::string& text);
/// Throws InputError that begins with --observe, with the nearest name, for what is not known or not there; nothing where there are no names.
std::optional<Observations> observations_of(const Model& model, const Effects& effects, const std::vector<std::string>& names);
/// An array of each, called as it was asked for (a slash becomes a line, since HDF5 has folders).
std::vector<RecordedArray> recorded_observations(const Observations& observations);

/// Quantities and observations of one simulation, as arrays.
class Observer {
 public:
  /// Throws InputError for what there is not, such as servos in a scene without any. Forces are kept from here on where they are asked for.
  Observer(Simulation& simulation, std::vector<Quantity> quantities, const std::vector<std::string>& observed);

  const std::vector<Quantity>& quantities() const { return quantities_; }
  const std::vector<RecordedArray>& arrays() const { return arrays_; }
  /// Which quantity each array is of; none: an observation.
  const std::vector<std::optional<Quantity>>& quantity_of_array() const { return of_array_; }
  /// Their numbers now. The view lasts until the next look.
  std::span<const std::span<const double>> look();

 private:
  void add(std::optional<Quantity> quantity, RecordedArray array);
  std::vector<double> energies();

  Simulation& simulation_;
  std::vector<Quantity> quantities_;
  std::optional<Observations> observations_;
  std::vector<std::optional<Quantity>> of_array_;
  std::vector<RecordedArray> arrays_;
  std::vector<std::vector<double>> numbers_;
  std::vector<std::span<const double>> views_;
};

}  // namespace linden
