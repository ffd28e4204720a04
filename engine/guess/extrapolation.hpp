// engine/guess/extrapolation.hpp
// The displacement of a step from those of the steps before.
//
//   next    delta = sum over k of share_k history_k: the polynomial through all there are, or a cubic near five of them
//
// The polynomial through five displacements multiplies what rounding left in them by 16, and the correction of so much noise is itself
// rounded: on a chain of 100,000 links a step took a third evaluation of the residual for it. The cubic nearest to the five multiplies
// noise by 5 and errs by 1.8 of their fourth difference. It is taken where that is larger than the third, as of noise alone it is (1.9
// times; of a motion that its steps resolve it is smaller by far): evaluations a step at 50,000 links 2.00 instead of 2.12, at 100,000
// 2.04 instead of 2.99; up to 20,000 nothing changes.
#pragma once

#include <array>

#include "layout/state.hpp"
#include "layout/tree.hpp"

namespace linden {

/// Next value of the polynomial through the last `terms` (1, ..., kHistory) values, latest first, is their sum with these factors; those
/// beyond are zero.
const std::array<double, kHistory>& polynomial_through(int terms);

struct Extrapolation {
  std::array<double, kHistory> shares;  // of the last displacements, latest first
  int terms;                            // how many of them count
};

/// terms: how many rows of history are valid, at least one.
Extrapolation extrapolation(const Field<double, kHistory>& history, int terms);
/// The same once `latest` has joined the history.
Extrapolation extrapolation_after(const Field<double>& latest, const Field<double, kHistory>& history, int terms);

/// One row of it.
inline double extrapolated(const Extrapolation& guess, const Field<double, kHistory>& history, Index row) {
  double next = 0;
  for (int k = 0; k < guess.terms; ++k) next += guess.shares[static_cast<std::size_t>(k)] * history(row, k);
  return next;
}

/// Rows of delta from those of history.
void extrapolate(const Extrapolation& guess, const Field<double, kHistory>& history, Slots rows, Field<double>& delta);

/// The displacement of a step becomes the latest.
void remember(const Field<double>& delta, Slots rows, Field<double, kHistory>& history);

}  // namespace linden
