// Multipliers of rows that close together where some are of contacts: the law of a contact, and the one solve for all of them.
//
// A contact has three rows: how far two shapes have moved across each other in the step, s_1 and s_2, and their gap g at its end. lambda acts at
// the beginning, times h as all impulses:
//
//   lambda_n = h^2 k max(-(g + lift), 0)                         presses
//   lambda_t = -mu N s / max(|s|, h v_s)                         rubs: sticks, creeping by v_s at most, or slides against its way
//
// One that resists turning has three more: how far both bodies have turned against each other about the two directions across, r, and about the
// normal, w, times an arm l, so that they are lengths and forces like the others:
//
//   lambda_r = -(mu_r / l) N r / max(|r|, h v_s)                 rolling friction: a moment of mu_r N at most
//   lambda_w = -(mu_w / l) N w / max(|w|, h v_s)                 torsional friction: mu_w N
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
// S is never formed. It is Y X, of what rows make of motions and impulses of rows of motions, each among the few joints that a row is felt by; and
// so corrections are found by those motions, w = X dz, a sparse system (frontal_solve.hpp) in which two contacts meet where they share a joint:
//
//   (1 + X H Y) w - X_r dz_r = X (lambda(g) - lambda - z)                     r: rows that are no contact's
//   Y_r w + yield dz_r = b - S z - yield z
//   dz = lambda(g) - lambda - z - H Y w                                       contacts
//
// Rounds by themselves come nearer by a share each, which is hardly any where friction carries much: a humanoid that fell took 17 of them a solve and
// 67 corrections, one solve in twelve all 100. So once a round is solved, Newton's method takes loads as they are in the same motion: H has
// -d lambda_t / d g beside, and is no longer symmetric. It is near, and each correction is smaller than the one before; where one is not, it is left and
// another round made. The same humanoid takes 1.2 rounds and 7 corrections.
//
// H may be that of a correction before, and the factor with it, where it has hardly changed: what it gets wrong the next correction finds.
//
// Without the cuts houses of cards fall: 529 of 3,000 steps fail, none with them.
//
// source  Castro, Permenter, Han, An Unconstrained Convex Formulation of Compliant Contact (2022); Moreau 1988 (time stepping by impulses)
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "kernels/couplings/frontal_solve.hpp"

namespace linden {

/// Of a step.
struct ContactLaw {
  double stiffness = 0;  // h^2 k; 0: nothing touches there
  double friction = 0;   // mu
  double creep = 0;      // h v_s [m]
  double lift = 0;       // [m]
  double rolling = 0;    // mu_r / l, of one with rows of turns
  double torsion = 0;    // mu_w / l, likewise
};

class ContactSolve {
 public:
  // not inline: those that use it are compiled for one processor each
  ContactSolve();
  ~ContactSolve();
  ContactSolve(const ContactSolve&) = delete;
  ContactSolve& operator=(const ContactSolve&) = delete;

  using Group = FrontalSolve::Group;
  /// What rows have to do with the numbers of one group: that of row j, number n stands at n number_stride + j row_stride.
  struct Term {
    std::size_t group;
    const double* across;   // Y
    const double* columns;  // X
    std::size_t number_stride, row_stride;
  };
  /// Rows that are felt by the same groups, each of which has one term: a contact's, three or, where it resists turning, six; or others.
  struct Block {
    std::size_t first, rows;
    std::size_t first_term, last_term;
    bool touches;
  };
  /// S, in the order of the rows. A group is late where Y X of its numbers is negative (frontal_solve.hpp).
  struct Product {
    std::vector<Group> groups;
    std::vector<Block> blocks;
    std::vector<Term> terms;
  };
  /// Numbers of its terms may change from then on, and stay where they are.
  void prepare(Product product);
  /// They have.
  void renew() { is_factored_ = is_read_ = false; }

  struct Rows {
    std::span<const double> yields;         // of each row beside its bodies; of a contact's 0; infinite: held already
    std::span<const std::size_t> first;     // of each contact, its first row
    std::span<const ContactLaw> laws;       // of each contact
    std::span<const double> multipliers;    // of each row, before the solve
    std::span<const double> guess;          // changes to begin with, of rows of contacts
  };
  /// b -> z: how far each row is to open -> by how much its multiplier changes. Allocates nothing.
  void solve(const Rows& rows, std::span<double> right_side);
  /// Of the solve made last.
  int rounds() const { return rounds_; }
  int corrections() const { return corrections_; }
  int factors() const { return factors_; }

 private:
  /// H of a contact: across 11, 12, 22; along the normal; what an opening takes from friction, 13 and 23. Of its turns: 44, 45, 55; 66; 43, 53, 63.
  using Falls = std::array<double, 6>;
  using TurnFalls = std::array<double, 7>;
  /// The load that friction goes by: of the round before, or what presses in the motion itself.
  enum class Load { of_last_round, own };
  void read();
  void multiply(const Eigen::VectorXd& impulses, Eigen::VectorXd& openings);
  void move(std::size_t block, const double* impulses, double* motion) const;
  void open(std::size_t block, const double* motion, double* openings) const;
  void solve_linear_rows(const Rows& rows);
  void find_pushes(const Rows& rows, const Eigen::VectorXd& gaps, Load load);
  static void find_turn_pushes(const ContactLaw& law, double borne, double fall, const double* turns, double* pushes, TurnFalls& falls);
  bool solve_with_own_loads(const Rows& rows);
  std::array<double, 2> renew_loads(const Rows& rows);
  void correct(const Rows& rows);
  static bool is_near(const Falls& factored, const Falls& now);
  static bool are_near(const TurnFalls& factored, const TurnFalls& now, double along);
  bool falls_at_all(std::size_t contact) const;
  void factor(const Rows& rows);
  void add_contact(std::size_t block, double* front, std::size_t stride, const std::size_t* at);
  void add_turns(std::size_t block, double* front, std::size_t stride);
  /// Behind the last row of a contact.
  std::size_t end_of(const Rows& rows, std::size_t contact) const { return rows.first[contact] + rows_of_[contact]; }
  void add_linear(std::size_t block, const Rows& rows, double* front, std::size_t stride, const std::size_t* at);
  void find_places(const Block& block, const std::size_t* at);
  double slope(const Rows& rows, double share) const;
  double share_of_correction(const Rows& rows, double slope_at_begin);

  Product product_;
  /// Numbers of a block: of all its terms side by side, row after row.
  struct Width {
    std::size_t numbers, first_number, first_unknown;  // of a row; the first of them in across_ and columns_, and in unknowns_
  };
  std::vector<Width> widths_;                   // of each block
  std::vector<double> across_, columns_;        // Y and X
  std::vector<std::size_t> unknowns_;           // of each number of a row, which it is
  std::vector<double> gathered_;                // scratch, as many as the widest block has
  std::vector<std::size_t> places_;             // likewise
  std::vector<std::size_t> contact_of_;         // of each block that touches, which
  std::vector<std::size_t> rows_of_;            // of each contact, how many
  std::vector<std::size_t> row_group_;          // of each other block, the group that its rows are
  FrontalSolve frontal_;
  std::vector<double> diagonal_, motion_;       // of each unknown
  Eigen::VectorXd b_, z_, change_, gaps_, moved_, tried_, left_;
  Eigen::VectorXd pushes_;                      // of rows of contacts
  std::vector<Falls> falls_;                    // of each contact
  std::vector<Falls> factored_;                 // that the factor was made with
  std::vector<TurnFalls> turn_falls_, factored_turns_;  // the same of turns
  std::vector<double> loads_;                   // N of each contact, times h^2
  std::vector<double> changes_;                 // by which a round would change them
  double share_of_change_ = 1;                  // that loads go by
  bool any_linear_ = false, is_factored_ = false, is_read_ = false;
  int rounds_ = 0, corrections_ = 0, factors_ = 0;
};

/// Of closures, by their numbers; not inline, as above.
class ContactSolves {
 public:
  ContactSolves();
  ~ContactSolves();
  ContactSolves(const ContactSolves&) = delete;
  ContactSolves& operator=(const ContactSolves&) = delete;

  void prepare(std::size_t closure, ContactSolve::Product product);
  /// Of a closure that is prepared.
  ContactSolve& operator[](std::size_t closure);
  /// See ContactSolve; of one that is not prepared nothing.
  void renew(std::size_t closure);

 private:
  std::vector<std::unique_ptr<ContactSolve>> solves_;
};

}  // namespace linden
