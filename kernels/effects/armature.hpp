// kernels/effects/armature.hpp
// Inertia of a rotor that turns with its joint.
//
//   T += 1/2 I (delta / h)^2,    h mu_joint = I delta        at both ends of the step
//
// Its gyroscopic effect on the link that carries the motor is left out, as in every engine that knows armature: rotors spin about the
// joint's own axis.
//
// units   I [kg m^2] of a turning joint, [kg] of a sliding one, on the side of the joint (n^2 of the rotor's own behind a gear)
// energy  kinetic, part of 1/2 p.M^-1 p
// cost    one addition an entry and step; M and d grow by I, so a small I at a light link also spares iterations
// source  Featherstone, Rigid Body Dynamics Algorithms, 9.6
#pragma once

#include <span>

#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
void armature_map(std::span<const Armature> rotors, JointImpulses<S>& sum) {
  for (const Armature& rotor : rotors) {
    const S I = as<S>(rotor.inertia);
    sum.gain(rotor.row) = sum.gain(rotor.row) + I;
    sum.stiffness(rotor.row) = sum.stiffness(rotor.row) + I;
    sum.end_gain(rotor.row) = sum.end_gain(rotor.row) + I;
  }
}

/// h^2 x kinetic energy over a displacement; of rates, kinetic energy [J].
template <class S>
S armature_energy(std::span<const Armature> rotors, const Field<S>& delta) {
  S sum(0.0);
  for (const Armature& rotor : rotors) sum = sum + as<S>(0.5 * rotor.inertia) * delta(rotor.row) * delta(rotor.row);
  return sum;
}

/// p += I v
template <class S>
void add_armature(std::span<const Armature> rotors, const Field<S>& v, Field<S>& p) {
  for (const Armature& rotor : rotors) p(rotor.row) = p(rotor.row) + as<S>(rotor.inertia) * v(rotor.row);
}

template <class S>
class ArmatureLaw : public JointLaw<S, Armature> {
 public:
  using JointLaw<S, Armature>::JointLaw;
  static constexpr std::array sweeps{PartSweep{Part::add, "armature_map", "armature, joint impulses", "joint impulses"}};
  void add(const StepView<S>&, JointImpulses<S>& sum) const { armature_map(this->entries(), sum); }
  /// No force: it is a part of the mass matrix.
  static void push(const Armature&, const Instant&, Field<double>&) {}
};

}  // namespace linden
