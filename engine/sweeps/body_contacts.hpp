// Contacts of bodies with each other, from step to step: which there are, where, and what each has borne.
//
//   find     at the beginning of a step: pairs of shapes that are near, and where they touch or will (kernels/collision)
//   law_of   of a step, with what the contact bore in the last one
//   keep     at its end: forces, what they took, what is stored
//
// Each is three rows of couplings (layout/couplings.hpp), or six where its material resists turning, for one step. The arm of turns is how far the
// smaller shape reaches: what creeps by turning about its middle creeps as far as what slides. Which pairs are near goes by their gap beside their size and by how far
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
#include "kernels/collision/contact_patch.hpp"
#include "kernels/effects/joint_impulses.hpp"
#include "kernels/values/scalar.hpp"
#include "layout/effects/contact.hpp"
#include "layout/field.hpp"
#include "layout/model.hpp"
#include "layout/pose.hpp"

namespace linden {

/// Speed at which depth that the motion did not make may come to push [m/s].
inline constexpr double kRecoverySpeed = 1e-2;

/// Speed at which a place that sticks creeps along at the limit of its friction: 6 micrometres a minute [m/s]. Ten times as much makes piles, walls and
/// falling humanoids no faster, a tenth makes a pile of twenty a quarter slower.
inline constexpr double kContactCreep = 1e-7;

/// What comes together more slowly does not bounce [m/s]. Of what strikes faster a thousandth of the speed is at most lost beside its restitution.
inline constexpr double kLeastRebound = 0.05, kRigid = 1e5;

/// Of their size by which shapes may be apart to be looked at, whatever they do.
inline constexpr double kNearBy = 0.02;
/// Up to which gap two shapes that reach so far are looked at, where they moved as far as this in the last step [m].
template <class S>
S gap_looked_at(double reach_a, double reach_b, const S& moved_a, const S& moved_b) {
  return as<S>(kNearBy * std::min(reach_a, reach_b)) + as<S>(2.0) * (moved_a + moved_b);
}

/// What is remembered from step to step: energy stored [J]; whether something lasted; where the middle of each shape was at the beginning of the last
/// step, in three numbers [m]; at how many places each was pushed in it, and the force along the normal of all of them [N]; what lasted, along each of `rows` velocities; and what each touch bore, in so many: its pair, from 1; both halves of its
/// feature; the force on b in the world's frame, and of the spring alone [N]; how deep that is pressed [m]; where some material resists turning the
/// moment on b that does, in the world's frame [N m]. A zero ends it.
inline constexpr std::size_t kLasted = 1, kRememberedMiddle = 2;
inline std::size_t numbers_of_touch(const PairContact& contact) { return contact.resists_turning() ? 11 : 8; }
inline constexpr std::size_t remembered_load(std::size_t shapes) { return kRememberedMiddle + 3 * shapes; }
inline constexpr std::size_t remembered_touch(std::size_t shapes, std::size_t rows) { return remembered_load(shapes) + 2 * shapes + rows; }

/// Of the largest of a step, a load that is none: what rounding leaves where places let go of each other.
inline constexpr double kNoLoad = 1e-14;

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
  /// What it bore in the last step, along `across`: two across, one along the normal [N]; the moment that resists turning, over its arm, likewise [N].
  using Force = std::array<double, kMostContactRows>;

  /// Of this model. The contact must outlive this.
  BodyContacts(const PairContact& contact, const Model& model);

  /// At these poses of the bodies. Whether the contacts are others than those of the last time.
  bool find(const Field<double, 12>& pose);
  std::span<const Touch> touches() const { return touches_; }
  /// The same as rows; made anew by find.
  std::span<const Coupling> couplings() const { return couplings_; }

  /// What a step of h begins with. opened: by how much its gap changed in the last one, had that been as long [m]; gravity [m/s^2].
  ContactLaw begin(std::size_t touch, double h, double opened, double gravity);
  std::array<double, kMostContactRows> guess_of(std::size_t touch, double h) const;
  /// Of the step solved last, of h, before bodies are placed at its end; before, now: displacements of the step before and of this one.
  /// book(slot of b, energy, freed) of what each took, and of what it may give to push out the depth that was found [J].
  template <class Book>
  void keep(double h, const CouplingSweeps<double>& solved, const Field<double>& before, const Field<double>& now, const Book& book) {
    const double stored_before = stored();
    memory_[0] = stored_of_last();
    forces_.resize(touches_.size());
    lasting_.resize(touches_.size());
    memory_[kLasted] = 0;
    double largest = 0;
    for (std::size_t k = 0; k < touches_.size(); ++k) largest = std::max(largest, solved.impulse_of(k)[2]);
    for (std::size_t k = 0; k < touches_.size(); ++k) {
      Force impulse = solved.impulse_of(k);
      if (impulse[2] <= kNoLoad * largest) impulse = {};
      const Force opens = solved.opens(k, before, now);
      double given = 0;
      for (std::size_t j = 0; j < kMostContactRows; ++j) {
        forces_[k][j] = impulse[j] / (h * h);
        given += forces_[k][j] * opens[j];
      }
      steps_[k].depth = steps_[k].depth_of(impulse[2]);
      memory_[0] += 0.25 * steps_[k].spring() * steps_[k].depth;
      const Force last = guess_of(k, h);
      for (std::size_t j = 0; j < kMostContactRows; ++j) {
        lasting_[k][j] = persistent(impulse[j], last[j]);
        memory_[kLasted] = lasting_[k][j] != 0 ? 1 : memory_[kLasted];
      }
      // in a first step a place bears half a weight, and works along half of the way; the other half comes with all of it
      const double freed = 2 * forces_[k][2] * std::min(steps_[k].found, h * kRecoverySpeed);
      if (given != 0 || freed != 0) book(couplings_[k].slot_b, -given, freed);
    }
    if (stored() != stored_before) book(0, stored_before - stored(), 0.0);
    remember();
  }
  /// Whether something pushed in the step solved last as in that before: velocities are read with half of it (engine/VELOCITY.md).
  bool lasted() const { return memory_[kLasted] != 0; }
  /// Until the next step begins, of a step of h: impulse += half of it on each body, with bodies at these poses: moment about its origin, force; in
  /// its frame [N m s, N s].
  void push_lasting(double h, const Field<double, 12>& pose, Field<double, 6>& impulse) const;
  /// What becomes of it along each velocity [N m s, N s], which is remembered.
  std::span<double> lasting_push() { return std::span(memory_).subspan(remembered_touch(contact_.shapes.size(), 0), rows_); }
  /// A blow has changed all velocities.
  void drop_lasting() { memory_[kLasted] = 0; }
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
    double found = 0;    // how much deeper it began than what the pair bore in the last step [m]
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
  /// On b, in the world's frame, of numbers along `across`: of what pushes, and of what resists turning [N, N m].
  Vec3<double> push_on_b(std::size_t touch, const Force& along) const;
  Vec3<double> moment_on_b(std::size_t touch, const Force& along) const;
  /// What is remembered of a pair's contacts, one after the other; of one of them, or nothing.
  std::span<const double> remembered_of_pair(std::size_t pair) const;
  std::span<const double> remembered(std::size_t touch) const;
  std::size_t first_number() const { return remembered_touch(contact_.shapes.size(), rows_); }
  /// A number of the effect's pairs; none: their number.
  std::size_t number_of(std::uint32_t a, std::uint32_t b) const;
  void add(std::size_t pair, double margin, const Field<double, 12>& pose);
  /// A place of a pair, with the normal from its first shape to its second. on_face: known to be one of a face of the first.
  void add_place(std::size_t pair, const Vec3<double>& normal, const PatchPoint& point, bool on_face, const Field<double, 12>& pose);

  const PairContact& contact_;
  std::size_t rows_;             // of velocities
  std::size_t numbers_of_touch_; // see remembered_touch
  std::vector<double> lighter_;  // of each pair, of both bodies [kg]
  std::vector<Touch> touches_;
  std::vector<Step> steps_;      // of each
  std::vector<Coupling> couplings_;
  std::vector<Force> forces_, lasting_;
  std::vector<double> memory_;   // see remembered_touch
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
