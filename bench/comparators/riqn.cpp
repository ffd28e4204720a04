#include "bench/comparators/riqn.hpp"

#include "kernels/tree/increment_down.hpp"

namespace linden::comparators {

void apply_mass_inverse(const Model& model, Workspace<double>& work, const Field<double>& r, Field<double>& x) {
  const Gains<double> gains{work.gain_up, work.gain_down, work.joint_inverse};
  impulse_pass_up(model.tree, model.constants, work.placement, gains, r, work.bias, work.innovation);
  rate_down(model.tree, model.constants, work.placement, gains, work.innovation, work.variation, x);
}

void Riqn::correct(Equation&, const Field<double>& hr, Field<double>& delta) {
  apply_mass_inverse(model_, work_, hr, work_.increment);
  vector(delta) -= vector(work_.increment);
}

}  // namespace linden::comparators
