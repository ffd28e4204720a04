// kernels/couplings/masked_solve.hpp
// Solves S x = b for the rows of couplings, some of which may say what others say already.
//
// S is scaled so that a row whose bodies were free would have 1 on the diagonal; then what is left of a pivot says how much of the row's own
// there is. Elimination in the order of the rows, without pivoting; a row whose pivot is smaller than kOwnShare is *held already*: its 1 / d
// is put to zero, its unknown is zero, and no other row sees it. The magnitude counts, not the sign: S = J A^-1 G^T is taken at both ends of a
// step, and its pivots may be negative where a step straddles a singular position.
//
// Equal to a truncated singular value decomposition on redundant mechanisms (four-bars, Bricard's, a parallelogram through its change point:
// positions to 1e-9 after 10 s), with the same instructions whatever the numbers.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "kernels/values/scalar.hpp"

namespace linden {

/// Share of its free motion that a row must be able to move by itself. The root of it, 3e-5, is how far axes may be off that are to be taken
/// for parallel; in single precision 3e-3.
template <class S>
inline constexpr double kOwnShare = is_single<S> ? 1e-5 : 1e-9;

template <class S>
class MaskedSolve {
 public:
  explicit MaskedSolve(std::size_t rows = 0) : rows_(rows), matrix_(rows * rows, S(0.0)), inverse_(rows, S(0.0)), pivot_(rows, S(0.0)) {}

  /// Row j, column c of the scaled matrix, to be set before factor().
  S& at(std::size_t j, std::size_t c) { return matrix_[j * rows_ + c]; }

  void factor() {
    using std::abs;
    for (std::size_t j = 0; j < rows_; ++j) {
      pivot_[j] = at(j, j);
      inverse_[j] = select(abs(pivot_[j]) < as<S>(kOwnShare<S>), S(0.0), S(1.0) / pivot_[j]);
      for (std::size_t i = j + 1; i < rows_; ++i) {
        const S share = at(i, j) * inverse_[j];
        at(i, j) = share;
        for (std::size_t c = j + 1; c < rows_; ++c) at(i, c) = at(i, c) - share * at(j, c);
      }
    }
  }

  /// b -> x, a number a row; R: S, or several right sides in lanes.
  template <class R>
  void solve(R* b) const {
    for (std::size_t i = 1; i < rows_; ++i) {
      for (std::size_t j = 0; j < i; ++j) b[i] = b[i] - R(matrix_[i * rows_ + j]) * b[j];
    }
    for (std::size_t i = rows_; i-- > 0;) {
      for (std::size_t j = i + 1; j < rows_; ++j) b[i] = b[i] - R(matrix_[i * rows_ + j]) * b[j];
      b[i] = b[i] * R(inverse_[i]);
    }
  }

  /// In these lanes the factor is another's.
  template <class Mask>
  void take(const MaskedSolve& other, const Mask& lanes) {
    const auto each = [&](std::vector<S>& to, const std::vector<S>& from) {
      for (std::size_t k = 0; k < to.size(); ++k) to[k] = select(lanes, from[k], to[k]);
    };
    each(matrix_, other.matrix_);
    each(inverse_, other.inverse_);
    each(pivot_, other.pivot_);
  }

  /// visit(numbers) of all that a factor leaves here: numbers is a span.
  template <class Visit>
  void each(const Visit& visit) {
    for (std::vector<S>* numbers : {&matrix_, &inverse_, &pivot_}) visit(std::span(*numbers));
  }

  /// 1 / pivot of a row, zero where it is held already; the pivot itself.
  const S& inverse(std::size_t j) const { return inverse_[j]; }
  const S& pivot(std::size_t j) const { return pivot_[j]; }

 private:
  std::size_t rows_;
  std::vector<S> matrix_, inverse_, pivot_;
};

}  // namespace linden
