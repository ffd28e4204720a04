// kernels/effects/ground_law.hpp
// The law of ground.hpp as a step asks for it (law.hpp).
#pragma once

#include "kernels/effects/ground.hpp"
#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
class GroundLaw : public BodyLaw<S, Ground> {
 public:
  static constexpr std::array sweeps{
      PartSweep{Part::begin, "begin_ground", "points", "points"},
      PartSweep{Part::guess, "guess_ground", "points, displacement", "points"},
      PartSweep{Part::add, "ground_map", "points, displacement, impulse, body impulses", "points, impulse, body impulses"},
      PartSweep{Part::update_states, "update_ground", "points", "points"},
      PartSweep{Part::keep, "keep_ground", "points", "points"},
      PartSweep{Part::place, "find_ground", "pose", "points"}};
  explicit GroundLaw(const LawSetup& setup)
      : BodyLaw<S, Ground>(setup), plan_(setup.ground), own_{as<S>(plan_.ground.friction), as<S>(plan_.least_load)} {
    points_.allocate({.slots = static_cast<Index>(plan_.points.size())});
  }
  static std::span<const GroundPoint> touching(const LawSetup& setup) { return setup.ground.points; }
  bool any() const { return !plan_.points.empty(); }

  S place(const Field<S, 12>& pose) { return potential_ = find_ground(plan_, pose, points_); }
  void begin(const StepStart<S>&) { potential_before_ = potential_; }
  /// Before the first evaluation: which points slide, as the first guess and the last step have it.
  void guess(const S& h, const Field<S, 7>& displacement) {
    guess_ground(plan_, h, true, displacement, points_);
    std::ranges::copy(points_.closed.flat(), points_.factored.flat().begin());
  }
  template <class Element>
  void add(const StepView<S>& step, const BodyConstants<Element>&, std::size_t first, std::size_t last, const Field<S, 7>& displacement,
           BodyImpulses<S>& sum, Field<S, 6>& impulse) {
    ground_map(plan_, first, last, own_, step.h, step.stiction_speed, displacement, points_, sum, impulse);
  }
  S overload(const StepView<S>&, const Field<S>&) const { return ground_overload(points_); }
  MaskOf<S> update_states(const StepView<S>&, const StateUpdate<MaskOf<S>>& now, const S& least, const Field<S>&, Field<S>&) {
    return update_ground(points_, now.near, least);
  }
  void account(const StepView<S>&, const SolvedStep<S>& solved, const auto& book) const {
    ground_work(plan_, solved.known, points_, [&](Index slot, double given) { book(slot, -given); });
  }
  void keep() { keep_ground(points_); }

  KeptNumbers<S, 5> memory() {
    return {points_.closed.flat(), points_.slides.flat(), points_.bore.flat(), points_.rise_before.flat(), points_.slip_last.flat()};
  }
  /// Of each point 0 apart, 1 sticks, 2 slides; then on a terrain what each bore.
  static Index kept_numbers(const LawSetup& setup) {
    return static_cast<Index>(setup.ground.points.size()) * (setup.ground.ground.terrain ? 2 : 1);
  }
  S kept(Index k) const {
    const Index count = points_.slides.rows();
    return k < count ? points_.closed(k) * (S(1.0) + points_.slides(k)) : points_.bore(k - count);
  }
  void set_kept(Index k, const S& number) {
    const Index count = points_.slides.rows();
    if (k < count) {
      points_.closed(k) = select(number > S(0.5), S(1.0), S(0.0));
      points_.slides(k) = select(number > S(1.5), S(1.0), S(0.0));
    } else {
      points_.bore(k - count) = number;
    }
  }
  void forget() {
    for (Field<S>* field : {&points_.closed, &points_.slides, &points_.bore}) std::ranges::fill(field->flat(), S(0.0));
  }

  const GroundPoints<S>& points() const { return points_; }
  /// To be written between steps.
  OwnFriction<S>& own() { return own_; }
  const OwnFriction<S>& own() const { return own_; }
  /// At the end of the last step [J], and what it has grown by since the step before.
  const S& potential() const { return potential_; }
  S stored() const { return potential_ - potential_before_; }

 private:
  const GroundPlan& plan_;
  GroundPoints<S> points_;
  OwnFriction<S> own_;
  S potential_ = S(0.0), potential_before_ = S(0.0);
};

}  // namespace linden
