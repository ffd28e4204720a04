#include "engine/queries/centre_of_mass.hpp"

#include "engine/queries/link_frames.hpp"
#include "kernels/queries/total_momentum_map.hpp"

namespace linden {
namespace {

TotalMomentum<double> total(const Kinematics& state) {
  return total_momentum_map<true>(state.model().tree, state.model().constants, state.bodies());
}

Vec3<double> per_mass(const TotalMomentum<double>& sum, const Vec3<double>& a) {
  return sum.mass > 0 ? a / sum.mass : Vec3<double>{0, 0, 0};
}

}  // namespace

CentreOfMass centre_of_mass(const Kinematics& state) {
  const TotalMomentum<double> sum = total(state);
  return {sum.mass, array_of(per_mass(sum, sum.moment)), array_of(per_mass(sum, sum.momentum.f))};
}

Momentum total_momentum(const Kinematics& state) {
  const Wrench<double> h = total(state).momentum;
  return {array_of(h.n), array_of(h.f)};
}

Momentum centroidal_momentum(const Kinematics& state) {
  const TotalMomentum<double> sum = total(state);
  const Vec3<double> about = sum.momentum.n - cross(per_mass(sum, sum.moment), sum.momentum.f);
  return {array_of(about), array_of(sum.momentum.f)};
}

}  // namespace linden
