// kernels/effects/friction.hpp
// Coulomb friction in joints, with true stiction.
//
//   slides (mode = sign of delta)   force -mode f:  o = mode h^2 f,  g = 0,  share 1
//   holds  (mode = 0)               delta = 0 exactly, as long as |impulse that holds| <= h f
//
// No penalty and no creep: a joint that holds is taken out of the solve (joint_impulses.hpp), and what is left of the residual in its
// row is h times the impulse that holds it. Modes are updated within the solve until they are those of the solution (semismooth Newton,
// the same as an active set): a sliding joint that would turn back holds, one that holds more than friction can starts to slide.
//
// Regularised (stiction_speed v > 0) it is f delta / (h v) where |delta| < h v, by the value of delta alone: what the solver goes by where sudden
// revisions of many joints go round in circles. Its solution says which joints hold.
//
// The solution minimises the kinetic energy of the step plus f |delta|, so there is just one, and friction never gives energy. Taking
// the whole impulse at the beginning shifts it by half a step: first order in h while sliding.
//
// units   f [N m, N]
// energy  takes force x work_displacement a step
// cost    some 4 operations an entry and evaluation
// source  Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988); Hintermueller, Ito, Kunisch, The primal-dual
//         active set strategy as a semismooth Newton method (2002)
#pragma once

#include <span>

#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
struct Frictions {
  std::span<const JointFriction> entries;
  Field<S> force;  // f of each, not negative
  Field<S> mode;   // of each
};

template <class S>
LINDEN_INLINE S sign_of(const S& x) {
  const S zero(0.0), one(1.0);
  return select(x > zero, one, select(x < zero, -one, zero));
}

/// The modes that delta alone suggests; displacements below h stiction_speed hold.
template <class S>
void guess_friction(Frictions<S>& frictions, const S& h, double stiction_speed, const Field<S>& delta) {
  using std::abs;
  const S still = h * as<S>(stiction_speed);
  for (Index k = 0; k < frictions.mode.rows(); ++k) {
    const S& d = delta(frictions.entries[static_cast<std::size_t>(k)].row);
    frictions.mode(k) = select(abs(d) <= still, S(0.0), sign_of(d));
  }
}

/// The modes to begin a step with: joints that held in the last one, where its displacement `before` is known, hold.
template <class S, class Mask>
void begin_friction(Frictions<S>& frictions, const Field<S>& before, const Mask& known, Field<S>& delta) {
  const S zero(0.0);
  for (Index k = 0; k < frictions.mode.rows(); ++k) {
    const Index row = frictions.entries[static_cast<std::size_t>(k)].row;
    S& d = delta(row);
    d = select(known && before(row) == zero, zero, d);
    frictions.mode(k) = sign_of(d);
  }
}

/// Displacements of joints that hold softly, for a stiction_speed that is smaller by a factor: their forces stay.
template <class S>
void shrink_friction(const Frictions<S>& frictions, double factor, Field<S>& delta) {
  for (Index k = 0; k < frictions.mode.rows(); ++k) {
    S& d = delta(frictions.entries[static_cast<std::size_t>(k)].row);
    d = select(frictions.mode(k) == S(0.0), as<S>(factor) * d, d);
  }
}

template <class S>
void friction_map(const Frictions<S>& frictions, const S& h, double stiction_speed, JointImpulses<S>& sum) {
  const S zero(0.0);
  for (Index k = 0; k < frictions.mode.rows(); ++k) {
    const S f = h * frictions.force(k);
    const S soft = stiction_speed > 0 ? select(frictions.mode(k) == zero, f / as<S>(stiction_speed), zero) : zero;
    add_impulse(sum, frictions.entries[static_cast<std::size_t>(k)].row, 1, frictions.mode(k) * (h * f), soft);
  }
}

template <class S>
void hold_friction(const Frictions<S>& frictions, JointImpulses<S>& sum) {
  for (Index k = 0; k < frictions.mode.rows(); ++k) {
    hold(sum, frictions.entries[static_cast<std::size_t>(k)].row, frictions.mode(k) == S(0.0));
  }
}

/// Impulse that holds a joint as a share of what friction can; zero where it slides.
template <class S>
LINDEN_INLINE S friction_load(const Frictions<S>& frictions, Index k, const S& h, const Field<S>& residual) {
  using std::abs;
  const S zero(0.0), most = h * h * frictions.force(k);
  const S held = abs(residual(frictions.entries[static_cast<std::size_t>(k)].row));
  return select(frictions.mode(k) == zero, select(held > zero, held / most, zero), zero);
}

/// Largest load of any joint that holds.
template <class S>
S friction_overload(const Frictions<S>& frictions, const S& h, const Field<S>& residual) {
  using std::max;
  S most(0.0);
  for (Index k = 0; k < frictions.mode.rows(); ++k) most = max(most, friction_load(frictions, k, h, residual));
  return most;
}

/// The modes that belong to delta, which is set to zero where a joint comes to hold; where `settled`, joints that hold more than `least`
/// times what friction can start to slide. Returns in which instances one changed.
template <class S, class Mask>
auto update_friction(Frictions<S>& frictions, const S& h, const Field<S>& residual, const Mask& settled, const S& least,
                     Field<S>& delta) {
  const S zero(0.0);
  auto changed = zero > S(1.0);
  for (Index k = 0; k < frictions.mode.rows(); ++k) {
    const JointFriction& friction = frictions.entries[static_cast<std::size_t>(k)];
    S& d = delta(friction.row);
    const S& mode = frictions.mode(k);
    const S& r = residual(friction.row);
    const S load = friction_load(frictions, k, h, residual);
    const auto breaks = settled && load > S(1.0) && load >= least;
    const auto turns = mode * d < zero;
    const S next = select(breaks, -sign_of(r), select(turns, zero, mode));
    d = select(turns, zero, d);
    changed = changed || breaks || turns;
    frictions.mode(k) = next;
  }
  return changed;
}

/// What friction took in a step: each(row, loss [J]).
template <class S, class Each>
void friction_loss(const Frictions<S>& frictions, const S& h, const Field<S>& residual, const Field<S>& delta, const Field<S>& before,
                   const Each& each) {
  for (Index k = 0; k < frictions.mode.rows(); ++k) {
    const JointFriction& friction = frictions.entries[static_cast<std::size_t>(k)];
    const S held = -residual(friction.row) / (h * h), sliding = frictions.force(k) * frictions.mode(k);
    const S force = select(frictions.mode(k) == S(0.0), held, sliding);
    each(friction.row, force * work_displacement(1.0, delta(friction.row), before(friction.row)));
  }
}

template <class S>
class FrictionLaw : public JointLaw<S, JointFriction> {
 public:
  static constexpr std::array sweeps{PartSweep{Part::begin, "begin_friction", "before, delta", "friction, delta"},
                                     PartSweep{Part::add, "friction_map", "friction, joint impulses", "joint impulses"},
                                     PartSweep{Part::update_states, "update_friction", "residual, delta", "friction, delta"}};
  static constexpr bool kFollows = true;
  explicit FrictionLaw(const LawSetup& setup) : JointLaw<S, JointFriction>(setup) {
    frictions_.entries = this->entries();
    for (Field<S>* field : {&frictions_.mode, &frictions_.force}) field->allocate(static_cast<Index>(this->entries().size()));
    for (Index k = 0; k < frictions_.force.rows(); ++k) frictions_.force(k) = as<S>(this->entries()[static_cast<std::size_t>(k)].force);
  }

  void begin(const StepView<S>&, const StepStart<S>& start, Field<S>& delta) {
    begin_friction(frictions_, start.before, start.known, delta);
  }
  void add(const StepView<S>& step, JointImpulses<S>& sum) const {
    friction_map(frictions_, step.h, step.stiction_speed, sum);
    if (step.stiction_speed == 0) hold_friction(frictions_, sum);
  }
  S overload(const StepView<S>& step, const Field<S>& residual) const { return friction_overload(frictions_, step.h, residual); }
  MaskOf<S> update_states(const StepView<S>& step, const StateUpdate<MaskOf<S>>& now, const S& least, const Field<S>& residual,
                          Field<S>& delta) {
    return update_friction(frictions_, step.h, residual, now.near, least, delta);
  }
  void follow(const StepView<S>& step, const Field<S>& delta) { guess_friction(frictions_, step.h, step.stiction_speed, delta); }
  void regularize(double factor, Field<S>& delta) const { shrink_friction(frictions_, factor, delta); }
  void account(const StepView<S>& step, const SolvedStep<S>& solved, const auto& book) const {
    friction_loss(frictions_, step.h, solved.residual, solved.delta, solved.before, book);
  }

  /// Force of each, to be written between steps.
  Field<S>& forces() { return frictions_.force; }

 private:
  Frictions<S> frictions_;
};

}  // namespace linden
