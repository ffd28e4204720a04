#include "engine/sweeps/closure_work.hpp"

#include <algorithm>

#include "engine/sweeps/coupling_paths.hpp"

namespace linden {
namespace {

/// A column of G^T and a row of J on their way past a joint: both are projected, passed on by its gains and carried to its parent; the row is
/// multiplied by the inverse of the joint's inertia as well.
double past_joint(Index velocities, bool from_world) {
  constexpr double kProjected = 9, kPassed = 12, kCarried = 54;
  const auto n = static_cast<double>(velocities);
  return 2 * (from_world ? kProjected : kProjected + kPassed * n + kCarried) + 2 * n * n - n;
}

/// Products of two numbers that are summed up, of a row of one path with all rows of another.
double products(const CouplingPath::Meeting& meeting, const CouplingPath& other) {
  double shared = 0;
  for (const CouplingPath::Shared& piece : meeting.shared) shared += static_cast<double>(piece.count);
  return 2 * shared * static_cast<double>(other.rows());
}

/// Of right sides of so many rows.
double solve(double rows) { return 2 * rows * rows + 2 * rows; }

double factor(double rows) { return rows * (rows - 1) / 2 + (rows - 1) * rows * (2 * rows - 1) / 3; }

double operations_of(const Model& model, const CouplingPaths& paths, const Closure& closure) {
  constexpr double kWrench = 12;  // times a number, added to another
  double sum = 0;
  for (const std::size_t k : closure.paths) {
    const CouplingPath& path = paths.all()[k];
    double a_row = 0;
    for (const CouplingPath::Joint& joint : path.joints) {
      a_row += past_joint(velocity_count(model.tree.kind(joint.slot)), model.tree.parent(joint.slot) == 0);
    }
    std::size_t meeting = path.met_in_closure;
    for (const CouplingPath::Passed& passed : path.passed) {
      const Closure& below = paths.closures()[passed.closure];
      const auto rows = static_cast<double>(below.rows.size());
      for (const std::size_t other : below.paths) a_row += 2 * products(path.meetings[meeting++], paths.all()[other]);
      a_row += solve(rows) + 2 * kWrench * rows;
    }
    for (std::size_t m = 0; m < path.met_in_closure; ++m) a_row += products(path.meetings[m], paths.all()[path.meetings[m].path]);
    sum += static_cast<double>(path.rows()) * a_row;
  }
  const auto rows = static_cast<double>(closure.rows.size());
  sum += 3 * rows * rows + factor(rows);  // scaled
  if (closure.slot != 0) sum += 6 * solve(rows) + 6 * kWrench * rows;
  return sum;
}

}  // namespace

std::vector<ClosureWork> closure_work(const Model& model) {
  const CouplingPaths paths(model, Closing::nearest, 1);
  std::vector<ClosureWork> all;
  for (const Closure& closure : paths.closures()) {
    const auto rows = static_cast<Index>(closure.rows.size());
    ClosureWork& work = all.emplace_back(ClosureWork{closure.slot, {}, rows, 0, operations_of(model, paths, closure)});
    for (const std::size_t k : closure.paths) {
      work.couplings.push_back(static_cast<Index>(k));
      work.velocities += static_cast<Index>(paths.all()[k].velocities);
    }
  }
  std::ranges::stable_sort(all, std::ranges::greater(), &ClosureWork::operations);
  return all;
}

}  // namespace linden
