// kernels/effects/drag.hpp
// Drag of bodies in still or moving air.
//
//   F = -(b1 + b2 |v|) v at the centre of mass,   v = D / h - wind,   D its displacement within the step
//
// units   b1 [N s/m], b2 [N s^2/m^2], wind [m/s] in the world's frame
// energy  takes -F.D a step; from a wind it may also give
// cost    some 100 operations an entry and evaluation, one product of rotations a body and step
// source  quadratic drag: b2 = 1/2 density x drag coefficient x area
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "kernels/effects/body_impulses.hpp"
#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
struct Drags {
  std::span<const Drag> entries;
  std::span<const double> share;
  Vec3<double> wind;
  Field<S> loss;  // of each in the evaluation last made [J]
};

/// Entries first ... last - 1, sorted by slot.
template <class S, class Element>
void drag_map(Drags<S>& drags, std::size_t first, std::size_t last, const BodyConstants<Element>& constants, const S& h,
              const Field<S, 7>& displacement, BodyImpulses<S>& sum, Field<S, 6>& impulse) {
  using std::sqrt;
  const S rate = S(1.0) / h, zero(0.0);
  for (std::size_t k = first; k < last; ++k) {
    const Drag& drag = drags.entries[k];
    const Index i = drag.slot;
    const S mass = as<S>(constants.inertia(i, 0)), per_mass = select(mass > zero, S(1.0) / mass, zero);
    const Vec3<S> c = per_mass * Vec3<S>{as<S>(constants.inertia(i, 1)), as<S>(constants.inertia(i, 2)), as<S>(constants.inertia(i, 3))};
    const auto D = load<Displacement, S>(displacement, i);
    const Vec3<S> moved = point_displacement(D, c);
    const Vec3<S> wind{as<S>(drags.wind.x), as<S>(drags.wind.y), as<S>(drags.wind.z)};
    const Vec3<S> v = rate * moved - transpose_times(load<Placement, S>(sum.pose, i).R, wind);
    const S speed = sqrt(dot(v, v)), b = as<S>(drag.linear) + as<S>(drag.quadratic) * speed;
    const S share = as<S>(drags.share[k]), scale = h * h;
    add_force(sum, impulse, i, share, c, moved, scale * (-b * v));
    const S along = select(speed > zero, as<S>(drag.quadratic) / speed, zero);
    add_pull(sum, i, c, c, rotation(D.r), (share * h) * (diagonal(b) + along * outer(v, v)));
    drags.loss(static_cast<Index>(k)) = b * dot(v, moved);
  }
}

template <class S>
class DragLaw : public BodyLaw<S, Drag> {
 public:
  static constexpr std::array sweeps{
      PartSweep{Part::add, "drag_map", "inertia, drag, pose, displacement, impulse, body impulses", "impulse, body impulses"}};
  explicit DragLaw(const LawSetup& setup) : BodyLaw<S, Drag>(setup) {
    for (const Drag& drag : this->entries()) share_.push_back(begin_share(ratio(drag, setup.step, setup.mass_of(drag.slot))));
    drags_.entries = this->entries();
    drags_.share = share_;
    drags_.wind = {setup.effects.wind[0], setup.effects.wind[1], setup.effects.wind[2]};
    drags_.loss.allocate(static_cast<Index>(this->entries().size()));
  }
  DragLaw(const DragLaw&) = delete;
  DragLaw& operator=(const DragLaw&) = delete;
  static std::span<const Drag> touching(const LawSetup& setup) { return setup.effects.drag; }
  /// A falling body reaches sqrt(m g / b2) at most.
  static double ratio(const Drag& drag, double step, double mass) {
    constexpr double kUsualGravity = 9.81;
    return step * (drag.linear / mass + std::sqrt(drag.quadratic * kUsualGravity / mass));
  }

  template <class Element>
  void add(const StepView<S>& step, const BodyConstants<Element>& constants, std::size_t first, std::size_t last,
           const Field<S, 7>& displacement, BodyImpulses<S>& sum, Field<S, 6>& impulse) {
    drag_map(drags_, first, last, constants, step.h, displacement, sum, impulse);
  }
  static void push(const Drag& drag, const BodiesInstant& now, Field<double, 6>& impulse) {
    const auto G = load<Inertia, double>(now.constants.inertia, drag.slot);
    const Vec3<double> c = G.m > 0 ? (1 / G.m) * G.mc : Vec3<double>{0, 0, 0};
    const auto V = load<Twist, double>(now.twist, drag.slot);
    const Vec3<double> wind{now.effects.wind[0], now.effects.wind[1], now.effects.wind[2]};
    const Vec3<double> v = V.v + cross(V.w, c) - transpose_times(load<Placement, double>(now.pose, drag.slot).R, wind);
    const Vec3<double> force = -(drag.linear + drag.quadratic * std::sqrt(dot(v, v))) * v;
    take_wrench(impulse, drag.slot, Wrench<double>{cross(c, force), force});
  }
  void account(const StepView<S>&, const SolvedStep<S>&, const auto& book) const {
    for (Index k = 0; k < drags_.loss.rows(); ++k) book(drags_.entries[static_cast<std::size_t>(k)].slot, drags_.loss(k));
  }

 private:
  Drags<S> drags_;
  std::vector<double> share_;  // s of each
};

}  // namespace linden
