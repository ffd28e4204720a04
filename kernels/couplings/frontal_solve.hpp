// Factor of a sparse matrix that is a sum of dense elements, each among a few groups of unknowns, and solves with it: multifrontal elimination.
//
//   analyse   which elements there are: order of elimination (minimum degree), fronts, where each element goes; kept while numbers change
//   factor    fronts from leaves to root: elements and what children leave are added, the front's own unknowns eliminated, the rest passed on
//   solve     forward and back
//
// Values may be unsymmetric, places are symmetric. Rows are swapped among the unknowns that a front eliminates, nowhere else: that is enough where
// the matrix is D + X H X^T times something diagonal, D and H not negative, as that of contacts is. A group that is *late* is eliminated only
// once all others that share an element with it have been: what it is to itself may be zero, or negative, till then.
//
// cost    of a factor, each front: own (own + passed)^2 multiplications; no allocation but in analyse
// source  Duff, Reid, The multifrontal solution of indefinite sparse symmetric linear equations (1983); Amestoy, Davis, Duff, An approximate
//         minimum degree ordering algorithm (1996)
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace linden {

class FrontalSolve {
 public:
  struct Group {
    std::size_t size;
    bool late;
  };
  /// Groups of each element: [first[e], first[e + 1]) of `groups`, no group twice.
  struct Elements {
    std::vector<std::size_t> first{0};
    std::vector<std::size_t> groups;
  };
  void analyse(std::span<const Group> groups, const Elements& elements);

  std::size_t unknowns() const { return unknowns_; }
  /// First unknown of a group.
  std::size_t first_of(std::size_t group) const { return first_[group]; }

  /// add(element, front, stride, at): adds an element to a front, row after row; the unknowns of its k-th group begin at at[k].
  using Add = std::function<void(std::size_t, double*, std::size_t, const std::size_t*)>;
  /// diagonal: of each unknown, beside the elements.
  void factor(std::span<const double> diagonal, const Add& add);
  /// b -> x, a number an unknown.
  void solve(std::span<double> b);
  /// Numbers that a factor keeps.
  std::size_t factor_numbers() const { return numbers_.size(); }

 private:
  /// Groups that are eliminated together, and those that they are passed on to.
  struct Front {
    std::vector<std::size_t> groups;    // own, then passed
    std::size_t own = 0, size = 0;      // unknowns
    std::vector<std::size_t> unknowns;  // of each row
    std::vector<std::size_t> elements;
    std::vector<std::size_t> children;  // by their numbers, in the order in which their rests lie on each other
    std::vector<std::size_t> at;        // of each passed unknown, its row in the parent's front
    std::size_t first_number = 0;       // own rows whole; then of the others what stands below
    std::size_t first_swap = 0;
  };
  void order(std::span<const Group> groups, const Elements& elements);
  void make_fronts(const Elements& elements);
  void eliminate(const Front& front, double* numbers, std::uint32_t* swaps) const;

  std::size_t unknowns_ = 0;
  std::vector<std::size_t> first_, size_;  // of each group
  std::vector<std::size_t> order_, turn_;  // groups as they are eliminated; of each group, when
  std::vector<Front> fronts_;              // children first, one next to the other
  std::vector<std::size_t> first_at_, at_; // of each element, where its groups begin in its front
  std::vector<double> numbers_;            // of the factor
  std::vector<std::uint32_t> swaps_;
  std::vector<double> front_, stack_, passed_;  // scratch: the front there is; rests of fronts that wait for their parents; of a solve
};

}  // namespace linden
