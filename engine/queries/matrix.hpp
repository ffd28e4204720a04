// engine/queries/matrix.hpp
// A dense matrix as questions answer it: rows one behind the other, as in C and NumPy. With Eigen:
//
//   Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(m.numbers.data(), m.rows, m.columns)
#pragma once

#include <cstddef>
#include <vector>

#include "layout/field.hpp"

namespace linden {

struct Matrix {
  Index rows = 0, columns = 0;
  std::vector<double> numbers;  // [rows x columns]

  Matrix() = default;
  Matrix(Index row_count, Index column_count)
      : rows(row_count), columns(column_count), numbers(static_cast<std::size_t>(row_count) * static_cast<std::size_t>(column_count)) {}
  double& operator()(Index row, Index column) { return numbers[at(row, column)]; }
  double operator()(Index row, Index column) const { return numbers[at(row, column)]; }

 private:
  std::size_t at(Index row, Index column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
};

}  // namespace linden
