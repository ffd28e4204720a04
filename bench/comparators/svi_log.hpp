// bench/comparators/svi_log.hpp
// The paper's equation, evaluated as Johnson and Murphey evaluate theirs: sums over bodies and the coordinates of their paths.
//
//   -h D1 L_d,j = sum over bodies i of A_ij.(h mu_i) - h^2/2 Q_j,    A_ij = Ad_{T_ji^-1} S_j at q^k, carried from parent to child
//   J_jl        = sum over bodies i of A_ij.(K_i B_il),              B_il the same at q^k+1
//
// Its residual is DRNEA's to rounding, at O(n^2) instead of O(n): what the recursion of DRNEA saves when all else is equal. A
// does not depend on the unknown and is formed once a step, so this is faster than the published evaluation (svi.hpp), which has
// to carry its derivatives anew with every iterate.
//
// cost    residual O(n^2), Jacobian O(n^3), for a chain
// source  the paper, (9)-(16)
#pragma once

#include <vector>

#include "bench/comparators/ancestry.hpp"
#include "bench/comparators/equation.hpp"

namespace linden::comparators {

class SviLog : public Equation {
 public:
  explicit SviLog(const Model& model);

  void begin(const StepStart& start) override;
  bool residual(const Field<double>& delta, Field<double>& hr) override;
  void jacobian(Eigen::MatrixXd& J) override;
  void momentum(const StepStart& end, Field<double>& p) override;

 private:
  void carry_end();
  template <class PlacementOf>
  void carry(const PlacementOf& placement_of, std::vector<Twistd>& pairs);
  void add_up(const std::vector<Twistd>& pairs, Field<double>& sum);

  const Model& model_;
  Ancestry ancestry_;
  Field<double, 12> placement_;
  Field<double, 7> motion_, displacement_;
  Field<double, 6> impulse_;  // h mu, then h nu
  Field<double> target_;
  std::vector<Twistd> A_, B_;
  std::vector<Wrenchd> KB_;  // of one body
};

}  // namespace linden::comparators
