#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/program/accuracy.hpp"

namespace linden {

std::vector<AccuracyFit> accuracy_fits(const AccuracyFigures& figures) {
  constexpr double kCoarse = 0.01, kCoarseOfLowOrder = 0.1, kFloor = 1e-13, kFalls = 1.6;
  constexpr std::size_t kRows = 3;
  std::vector<AccuracyFit> fits;
  std::vector<AccuracyMethod> methods;
  for (const AccuracyRow& row : figures.rows) {
    if (row.of_ladder && (methods.empty() || methods.back() != row.method)) methods.push_back(row.method);
  }
  for (const AccuracyMethod& method : methods) {
    // as long as the error falls, from large steps to small; where it falls no more it is rounding's, and ten times that is near
    // it
    std::vector<const AccuracyRow*> rows;
    double floor = std::max(kFloor, figures.reference.gap);
    for (const AccuracyRow& row : figures.rows) {
      if (row.method != method || !row.of_ladder || !row.done()) continue;
      if (!(row.error < (method.order > 2 ? kCoarse : kCoarseOfLowOrder)) || row.split_steps > 0) {
        rows.clear();
        continue;
      }
      if (!rows.empty() && row.error * kFalls > rows.back()->error) {
        floor = std::max(floor, row.error);
        break;
      }
      rows.push_back(&row);
    }
    std::erase_if(rows, [&](const AccuracyRow* row) { return row->error < 10 * floor; });
    if (rows.size() > kRows) rows.erase(rows.begin(), rows.end() - kRows);
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    AccuracyFit fit{method, kNone, 0, 0, static_cast<int>(rows.size()), kNone};
    LineFit line;
    for (const AccuracyRow* row : rows) line.add(std::log(row->step), std::log(row->error));
    if (rows.size() == kRows) fit = {method, line.slope(), rows.front()->step, rows.back()->step, fit.rows, line.slope_error()};
    fits.push_back(fit);
  }
  return fits;
}

const AccuracyRow* cheapest(const AccuracyFigures& figures, double AccuracyRow::*value, double target, bool ours) {
  const AccuracyRow* best = nullptr;
  for (const AccuracyRow& row : figures.rows) {
    if (!row.of_ladder || !row.done() || !(row.*value <= target) || (row.method.kind == AccuracyMethod::Kind::composed) != ours) continue;
    if (best == nullptr || row.seconds < best->seconds) best = &row;
  }
  return best;
}

}  // namespace linden
