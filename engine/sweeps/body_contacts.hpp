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
#include "kernels/values/scalar.hpp"
#include "layout/effects/contact.hpp"
#include "layout/field.hpp"
#include "layout/pose.hpp"

namespace linden {

/// Speed at which depth that the motion did not make may come to push [m/s].
inline constexpr double kRecoverySpeed = 1e-2;

/// Of their size by which shapes may be apart to be looked at, whatever they do.
inline constexpr double kNearBy = 0.02;
/// Up to which gap two shapes that reach so far are looked at, where they moved as far as this in the last step [m].
template <class S>
S gap_looked_at(double reach_a, double reach_b, const S& moved_a, const S& moved_b) {
  return as<S>(kNearBy * std::min(reach_a, reach_b)) + as<S>(2.0) * (moved_a + moved_b);
}

/// What is remembered from step to step: energy stored [J], where the middle of each shape was at the beginning of the last step, in three numbers
/// of three [m], and what each touch bore, in so many: its pair, from 1; both halves of its feature; the force on b in the world's frame, and along
/// the normal [N]. A zero ends it.
inline constexpr std::size_t kRememberedMiddle = 1, kNumbersOfTouch = 7;
inline std::size_t remembered_touch(std::size_t shapes) { return kRememberedMiddle + 3 * shapes; }

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

  /// It must outlive this.
  explicit BodyContacts(const PairContact& contact);

  /// At these poses of the bodies. Whether the contacts are others than those of the last time.
  bool find(const Field<double, 12>& pose);
  std::span<const Touch> touches() const { return touches_; }
  /// The same as rows; made anew by find.
  std::span<const Coupling> couplings() const { return couplings_; }

  /// What a step of h begins with.
  ContactLaw law_of(std::size_t touch, double h) const;
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
      memory_[0] += stored_by(forces_[k][2]);
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
  void remember();
  /// Of a contact's share of the potential that goes with N of one step [J].
  double stored_by(double N) const { return 0.25 * N * N / contact_.stiffness; }
  /// Those of what is remembered of the last step.
  double stored_of_last() const;
  Vec3<double> force_on_b(std::size_t touch) const;
  /// Its numbers in the memory; none.
  std::span<const double> remembered(std::size_t touch) const;
  std::size_t first_number() const { return remembered_touch(contact_.shapes.size()); }

  const PairContact& contact_;
  std::vector<Touch> touches_;
  std::vector<Coupling> couplings_;
  std::vector<Force> forces_;
  std::vector<double> memory_;  // what is stored, middles of shapes at the beginning of the last step, what each contact bore
  std::vector<double> reach_;   // of each shape, from its middle [m]
  std::vector<Pose> poses_;     // of each shape, in the world
  std::vector<double> moved_;   // scratch: how far in the last step [m]
  std::size_t coupled_ = 0;     // contacts that there were the last time
};

}  // namespace linden
