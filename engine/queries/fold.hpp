// engine/queries/fold.hpp
// Mimic joints in what questions answer: shares of followers are carried to their leaders (kernels/tree/mimic.hpp). For the code of
// questions alone.
#pragma once

#include "engine/queries/matrix.hpp"
#include "layout/model.hpp"

namespace linden {

/// Columns [nv] of followers times their multipliers are added to those of their leaders, and cleared.
inline void fold_columns(const Model& model, Matrix& matrix) {
  for (const Mimic& mimic : model.mimics) {
    for (Index row = 0; row < matrix.rows; ++row) {
      matrix(row, mimic.leader_v) += mimic.multiplier * matrix(row, mimic.follower_v);
      matrix(row, mimic.follower_v) = 0;
    }
  }
}

/// The same of rows.
inline void fold_rows(const Model& model, Matrix& matrix) {
  for (const Mimic& mimic : model.mimics) {
    for (Index column = 0; column < matrix.columns; ++column) {
      matrix(mimic.leader_v, column) += mimic.multiplier * matrix(mimic.follower_v, column);
      matrix(mimic.follower_v, column) = 0;
    }
  }
}

}  // namespace linden
