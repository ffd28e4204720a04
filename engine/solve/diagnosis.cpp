#include "engine/solve/diagnosis.hpp"

#include <cmath>
#include <limits>

#include "kernels/tree/impulse_pass_up.hpp"
#include "kernels/values/se3.hpp"

namespace linden {

Index worst_displacement(const Model& model, const Workspace<double>& work) {
  Index worst = 1;
  double least = std::numeric_limits<double>::infinity();
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const double w = std::min(work.displacement(i, 3), work.motion(i, 3));
    if (!std::isfinite(w)) return i;
    if (w < least) {
      least = w;
      worst = i;
    }
  }
  return worst;
}

Index fastest_body(const Model& model, const BodyConstants<double>& constants, const Workspace<double>& work) {
  Index fastest = 1;
  double most = -1;
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const auto u = log(load<Displacement, double>(work.displacement, i));
    const double energy = dot(load<Inertia, double>(constants.inertia, i) * u, u);
    if (energy > most) {
      most = energy;
      fastest = i;
    }
  }
  return fastest;
}

Index largest_residual(const Model& model, const Workspace<double>& work, const Field<double>& joint_inverse) {
  Index worst = 1;
  double largest = -1;
  up(model.tree, [&](auto joint, Index i) {
    const Wrench<double> u = load_joint(joint, work.innovation, model.tree.first_v(i));
    const Wrench<double> given = apply_inverse(joint, joint_inverse, model.tree.first_block(i), u);
    const double share = dot(u.n, given.n) + dot(u.f, given.f);
    if (share > largest || !std::isfinite(share)) {
      largest = share;
      worst = i;
    }
  });
  return worst;
}

}  // namespace linden
