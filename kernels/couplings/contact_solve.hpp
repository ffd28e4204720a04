// Multipliers of rows that close together where some are of contacts: the law of a contact, and the one solve for all of them.
//
// A contact has three rows: how far two shapes have moved across each other in the step, s_1 and s_2, and their gap g at its end. lambda acts at
// the beginning, times h as all impulses:
//
//   lambda_n = h^2 k max(-(g + lift), 0)                         presses
//   lambda_t = -mu N s / max(|s|, h v_s)                         rubs: sticks, creeping by v_s at most, or slides against its way
//
// lift takes from the gap what the motion did not make: depth that a step found and the last one did not bear comes to push slowly, and gives no
// energy to speak of; where it is negative what strikes is to go apart by so much. N, the load that friction goes by, is that of the round before; rounds go on until it stands still. Of a round the solution
// is the least of a convex function of the motion,
//
//   1/2 z^T S z + sum l(S z - b),    lambda + z = -grad l,    S = J A^-1 G^T
//
// so Newton's method finds it, its corrections cut where that function is least along them:
//
//   (1 + H S) dz = lambda(g) - lambda - z,    H = -d lambda / d (s, g)        contacts
//   S dz + yield dz = b - S z - yield z                                       all other rows, yield 0 where rigid; held already: z = 0
//   slope along dz:  (lambda + z - lambda(g)) . S dz                          of the rows of contacts
//
// Without the cuts houses of cards fall: 529 of 3,000 steps fail, none with them.
//
// source  Castro, Permenter, Han, An Unconstrained Convex Formulation of Compliant Contact (2022); Moreau 1988 (time stepping by impulses)
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace linden {

/// Of a step.
struct ContactLaw {
  double stiffness = 0;  // h^2 k; 0: nothing touches there
  double friction = 0;   // mu
  double creep = 0;      // h v_s [m]
  double lift = 0;       // [m]
};

class ContactSolve {
 public:
  // not inline: those that use it are compiled for one processor each
  ContactSolve();
  ~ContactSolve();
  ContactSolve(const ContactSolve&) = delete;
  ContactSolve& operator=(const ContactSolve&) = delete;

  struct Rows {
    std::span<const double> product;        // S, row by row
    std::span<const double> yields;         // of each row beside its bodies; of a contact's 0; infinite: held already
    std::span<const std::size_t> first;     // of each contact, its first row
    std::span<const ContactLaw> laws;       // of each contact
    std::span<const double> multipliers;    // of each row, before the solve
    std::span<const double> guess;          // changes to begin with, of rows of contacts
  };
  /// b -> z: how far each row is to open -> by how much its multiplier changes. Allocates where there are more rows than ever.
  void solve(const Rows& rows, std::span<double> right_side);
  /// Rounds and corrections of the solve made last.
  int rounds() const { return rounds_; }
  int corrections() const { return corrections_; }

 private:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  void solve_linear_rows(const Rows& rows);
  void find_pushes(const Rows& rows, const Eigen::VectorXd& gaps);
  void correct(const Rows& rows);
  double slope(const Rows& rows, double share) const;
  double share_of_correction(const Rows& rows, double slope_at_begin);

  Matrix product_, matrix_;
  Eigen::VectorXd b_, z_, change_, gaps_, moved_, tried_;
  Eigen::VectorXd pushes_;                      // of rows of contacts
  std::vector<std::array<double, 4>> falls_;    // of each contact H: across 11, 12, 22; along the normal
  std::vector<double> loads_;                   // N of each contact, times h^2
  std::vector<char> linear_;                    // rows that are no contact's
  Eigen::PartialPivLU<Matrix> factor_;
  bool any_linear_ = false;
  int rounds_ = 0, corrections_ = 0;
};

}  // namespace linden
