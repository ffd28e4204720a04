// kernels/effects/wrench.hpp
// Forces and moments on bodies that are given over time.
//
//   in the world's frame   the same direction at both ends of the step
//   in the body's frame    turns with the body
//
// by the mean over the step of what acts, share 1/2. F acts at the body's point a.
//
// units   [N], [N m]
// energy  gives F.D + moment . turn a step
// cost    some 120 operations an entry and evaluation, one product of rotations a body and step
#pragma once

#include <span>

#include "kernels/effects/body_impulses.hpp"
#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
struct Wrenches {
  std::span<const BodyWrench> entries;
  Field<S> scale;  // of each in this step; zero outside its time
  Field<S> work;   // of each in the evaluation last made [J]
};

/// Entries first ... last - 1, sorted by slot.
template <class S>
void wrench_map(Wrenches<S>& wrenches, std::size_t first, std::size_t last, const S& h, const Field<S, 7>& displacement,
                BodyImpulses<S>& sum, Field<S, 6>& impulse) {
  const S half(0.5), scale = h * h;
  const auto vector = [](const std::array<double, 3>& from) LINDEN_INLINE_LAMBDA {
    return Vec3<S>{as<S>(from[0]), as<S>(from[1]), as<S>(from[2])};
  };
  for (std::size_t k = first; k < last; ++k) {
    const BodyWrench& wrench = wrenches.entries[k];
    const Index i = wrench.slot;
    const Vec3<S> a = vector(wrench.point);
    const auto D = load<Displacement, S>(displacement, i);
    const Vec3<S> moved = point_displacement(D, a), turn = log(D).w;
    const S& share = wrenches.scale(static_cast<Index>(k));
    Vec3<S> force = share * vector(wrench.force), moment = share * vector(wrench.moment);
    Vec3<S> end_force = force, end_moment = moment;  // in the body frame at k as well
    if (wrench.in_world) {
      const auto R = load<Placement, S>(sum.pose, i).R;
      end_force = force = transpose_times(R, force);
      end_moment = moment = transpose_times(R, moment);
    } else {
      end_force = rotate(D.r, force);
      end_moment = rotate(D.r, moment);
    }
    const Wrench<S> begin{half * (moment + cross(a, force)), half * force};
    const Wrench<S> end{half * (end_moment + cross(a + moved, end_force)), half * end_force};
    const Vec3<S> none{S(0.0), S(0.0), S(0.0)};
    add_wrenches(sum, impulse, i, scale * begin, scale * (begin + end), Wrench<S>{none, none});
    wrenches.work(static_cast<Index>(k)) = half * (dot(force + end_force, moved) + dot(moment + end_moment, turn));
  }
}

template <class S>
class WrenchLaw : public BodyLaw<S, BodyWrench> {
 public:
  static constexpr std::array sweeps{
      PartSweep{Part::begin, "begin_wrenches", "wrenches, time", "wrenches"},
      PartSweep{Part::add, "wrench_map", "wrenches, pose, displacement, impulse, body impulses", "impulse, body impulses"}};
  explicit WrenchLaw(const LawSetup& setup) : BodyLaw<S, BodyWrench>(setup) {
    wrenches_.entries = this->entries();
    for (Field<S>* field : {&wrenches_.scale, &wrenches_.work}) field->allocate(static_cast<Index>(this->entries().size()));
  }
  static std::span<const BodyWrench> touching(const LawSetup& setup) { return setup.effects.wrenches; }

  void begin(const StepStart<S>& start) {
    for (Index k = 0; k < wrenches_.scale.rows(); ++k) {
      const BodyWrench& wrench = wrenches_.entries[static_cast<std::size_t>(k)];
      wrenches_.scale(k) = at_each_time<S>(start.times, [&](double t) LINDEN_INLINE_LAMBDA { return wrench.mean_share(t, t + start.step); });
    }
  }
  template <class Element>
  void add(const StepView<S>& step, const BodyConstants<Element>&, std::size_t first, std::size_t last, const Field<S, 7>& displacement,
           BodyImpulses<S>& sum, Field<S, 6>& impulse) {
    wrench_map(wrenches_, first, last, step.h, displacement, sum, impulse);
  }
  static void push(const BodyWrench& wrench, const BodiesInstant& now, Field<double, 6>& impulse) {
    const auto vector = [](const std::array<double, 3>& from) { return Vec3<double>{from[0], from[1], from[2]}; };
    const double share = wrench.share_at(now.time);
    Vec3<double> force = share * vector(wrench.force), moment = share * vector(wrench.moment);
    if (wrench.in_world) {
      const auto R = load<Placement, double>(now.pose, wrench.slot).R;
      force = transpose_times(R, force);
      moment = transpose_times(R, moment);
    }
    take_wrench(impulse, wrench.slot, Wrench<double>{moment + cross(vector(wrench.point), force), force});
  }
  void account(const StepView<S>&, const SolvedStep<S>&, const auto& book) const {
    for (Index k = 0; k < wrenches_.work.rows(); ++k) book(wrenches_.entries[static_cast<std::size_t>(k)].slot, wrenches_.work(k));
  }

 private:
  Wrenches<S> wrenches_;
};

}  // namespace linden
