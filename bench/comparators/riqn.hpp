// bench/comparators/riqn.hpp
// The paper's quasi-Newton method, Algorithm 3: h M(q^k)^-1 for the inverse Jacobian, applied by articulated-body inertias.
//
//   delta <- delta - M(q^k)^-1 h r          (25)
//
// The inertias are formed once a step, by whoever steps: they depend on q^k only, and the first guess needs them too.
//
// cost    O(n) an iteration
// source  the paper, 3.2
#pragma once

#include "bench/comparators/root_finder.hpp"

namespace linden::comparators {

/// x = M^-1 r, with the gains of articulated_inertia_up in `work`; x may be r.
void apply_mass_inverse(const Model& model, Workspace<double>& work, const Field<double>& r, Field<double>& x);

class Riqn : public RootFinder {
 public:
  Riqn(const Model& model, Workspace<double>& work) : model_(model), work_(work) {}

 private:
  void correct(Equation& equation, const Field<double>& hr, Field<double>& delta) override;

  const Model& model_;
  Workspace<double>& work_;
};

}  // namespace linden::comparators
