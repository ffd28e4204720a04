// engine/effects/effect_controls.hpp
// What may be set of a stepper's effects between steps, and what they keep of the step taken last. Empty where there are no effects.
#pragma once

#include <span>
#include <vector>

#include "layout/field.hpp"

namespace linden {

template <class S>
class EffectSweeps;

class EffectControls {
 public:
  EffectControls() = default;
  explicit EffectControls(EffectSweeps<double>& effects) : effects_(&effects) {}

  /// Targets of the servos [rad, m] in the order of Effects::servos, to be written between steps; NaN: that of the servo's table.
  std::span<double> servo_targets() const;
  /// Forces of joint friction [N m, N] in the order of Effects::friction, likewise.
  std::span<double> friction_forces() const;
  /// Factor of the stiffness and damping of servo k; Coulomb's coefficient of the ground.
  double gain(Index k) const;
  void set_gain(Index k, double factor) const;
  double ground_friction() const;
  void set_ground_friction(double coefficient) const;

  /// Rows [nv] that velocities are read from beside the momenta (EffectSweeps::end_reading); written where the state becomes another's.
  struct Reading {
    std::span<double> excess_before, reading, bend;
  };
  Reading reading() const;
  /// Number k of EffectSweeps::kept, likewise.
  double kept(Index k) const;
  void set_kept(Index k, double number) const;
  /// All that is kept from step to step: part of a checkpoint.
  std::vector<std::span<double>> memory() const;

 private:
  EffectSweeps<double>* effects_ = nullptr;
};

}  // namespace linden
