// Contacts of bodies with each other, from step to step: which there are, where, and what each has borne.
//
//   find     at the beginning of a step: pairs of shapes that are near, and where they touch or will (kernels/collision)
//   law_of   of a step, with what the contact bore in the last one
//   keep     at its end: forces, what they took, what is stored
//
// Each is three rows of couplings (layout/couplings.hpp), for one step. Which pairs are near goes by their gap beside their size and by how far
// they moved in the last step: what may meet in this one is among them.
//
// What is stored is k (d^2 + d'^2) / 4 of the depths d and d' at the ends of a step, N = k d' of that step: then work along the mean displacement of two
// steps, -N (s + s') / 2, is what is stored less k (d'' - d)^2 / 4, so that a passive contact never gives.
//
// A damper adds c (d' - d) / h while a place is pressed: h^2 k + h c takes the place of h^2 k, and what it takes is not stored.
//
// What comes together faster than kLeastRebound, and than gravity makes it in two steps, and would meet in this one, is to go apart by restitution
// times as much (Newton's law, as Moreau steps it): as if rigid, for this step. What is rigid has the stiffness with which it yields kRigid times less
// than the lighter of both bodies moves under the same push.
//
// Depth that the motion did not make, of a start within each other or of an edge that was not met before, comes to push at kRecoverySpeed: what it
// stores is what it bore in the last step, and that much more.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/effects/step_impulses.hpp"
#include "engine/sweeps/coupling_sweeps.hpp"
#include "kernels/collision/broad_phase.hpp"
#include "layout/body_constants.hpp"
#include "layout/effects/contact.hpp"
#include "layout/field.hpp"
#include "layout/pose.hpp"

namespace linden {

/// Speed at which depth that the motion did not make may come to push [m/s].
inline constexpr double kRecoverySpeed = 1e-2;

/// What comes together more slowly does not bounce [m/s]. Of what strikes faster a thousandth of the speed is at most lost beside its restitution.
inline constexpr double kLeastRebound = 0.05, kRigid = 1e6;

class BodyContacts {
 public:
  /// One place where two shapes are near each other.
  struct Touch {
    std::size_t pair;       // of the effect's
    std::uint64_t feature;  // which of its places: the same from step to step
    double gap;             // at the beginning of the step [m]
    std::array<double, 3> place;   // between them, world frame [m]
    std::array<double, 9> across;  // world frame, rows: two directions across the normal, and the normal, from a to b
  };
  /// What it bore in the last step, along `across` [N]: two across, one along the normal.
  using Force = std::array<double, 3>;

  /// Of a model with these bodies, by which rigid contact goes. The contact must outlive this.
  BodyContacts(const PairContact& contact, const BodyConstants<double>& bodies);

  /// At these poses of the bodies. Whether the contacts are others than those of the last time.
  bool find(const Field<double, 12>& pose);
  std::span<const Touch> touches() const { return touches_; }
  /// The same as rows; made anew by find.
  std::span<const Coupling> couplings() const { return couplings_; }

  /// What a step of h begins with. opened: by how much its gap changed in the last one, had that been as long [m]; gravity [m/s^2].
  ContactLaw begin(std::size_t touch, double h, double opened, double gravity);
  std::array<double, 3> guess_of(std::size_t touch, double h) const;
  /// Of the step solved last, of h, before bodies are placed at its end; before, now: displacements of the step before and of this one.
  /// book(slot of b, energy) of what each took [J].
  template <class Book>
  void keep(double h, const CouplingSweeps<double>& solved, const Field<double>& before, const Field<double>& now, const Book& book) {
    const double stored_before = stored();
    memory_[0] = stored_of_last();
    forces_.resize(touches_.size());
    for (std::size_t k = 0; k < touches_.size(); ++k) {
      const std::array<double, 3> impulse = solved.impulse_of(k), opens = solved.opens(k, before, now);
      double given = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        forces_[k][j] = impulse[j] / (h * h);
        given += forces_[k][j] * opens[j];
      }
      steps_[k].depth = steps_[k].depth_of(impulse[2]);
      memory_[0] += 0.25 * steps_[k].spring() * steps_[k].depth;
      if (given != 0) book(couplings_[k].slot_b, -given);
    }
    if (stored() != stored_before) book(0, stored_before - stored());
    remember();
  }
  /// At the end of the last step, potential of what is pressed [J].
  double stored() const { return memory_[0]; }
  /// Between the shapes of a touch in the step solved last [N], as Touch::across has it; empty before the first.
  std::span<const Force> forces() const { return forces_; }
  /// The same as impulses of a step of h, of those that push.
  std::vector<TouchImpulse> impulses(double h) const;

  /// What the next step wants to know of this one.
  std::span<double> memory() { return memory_; }
  void forget();

 private:
  /// The law of a touch in the step that has begun.
  struct Step {
    ContactLaw law;
    double stiffness;    // of the spring alone [N/m]; 0 where the place rebounds: nothing is stored
    double spring_lift;  // ContactLaw::lift of it [m]
    double depth = 0;    // by which it is pressed at the end [m]

    double spring() const { return stiffness * depth; }
    /// With this impulse along the normal, times h.
    double depth_of(double impulse) const {
      return impulse > 0 && stiffness > 0 ? std::max(0.0, impulse / law.stiffness + law.lift - spring_lift) : 0;
    }
  };

  void remember();
  /// Those of what is remembered of the last step.
  double stored_of_last() const;
  Vec3<double> force_on_b(std::size_t touch) const;
  /// What is remembered of a pair's contacts, one after the other; of one of them, or nothing.
  std::span<const double> remembered_of_pair(std::size_t pair) const;
  std::span<const double> remembered(std::size_t touch) const;
  std::size_t first_number() const { return 1 + 3 * contact_.shapes.size(); }
  /// A number of the effect's pairs; none: their number.
  std::size_t number_of(std::uint32_t a, std::uint32_t b) const;
  void add(std::size_t pair, double margin, const Field<double, 12>& pose);

  const PairContact& contact_;
  std::vector<double> lighter_;  // of each pair, of both bodies [kg]
  std::vector<Touch> touches_;
  std::vector<Step> steps_;      // of each
  std::vector<Coupling> couplings_;
  std::vector<Force> forces_;
  std::vector<double> memory_;  // what is stored, middles of shapes at the beginning of the last step, what each contact bore
  std::vector<double> reach_;   // of each shape, from its middle [m]
  std::vector<Pose> poses_;     // of each shape, in the world
  std::vector<std::size_t> first_pair_;  // of each shape, of those that it is the first of
  std::vector<double> near_;    // of each shape, half of what it may be apart from another to be looked at, whatever they do [m]
  std::vector<double> moved_;   // scratch: how far in the last step [m]
  std::vector<Bounds> bounds_;  // likewise
  BroadPhase broad_phase_;
  bool changed_ = false;        // contacts are others than those of the last time
};

}  // namespace linden
