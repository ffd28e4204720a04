#include "kernels/couplings/contact_solve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linden {
namespace {

constexpr int kMostLoadRounds = 100, kMostNewtonSteps = 100, kMostTrials = 40;

/// From this round on loads go half of the way: where friction is strong they would swing from one round to the next (of 1,000 random boxes on their
/// corners, with coefficients up to 1, the loads of 43 never stood still, and of 1 so).
constexpr int kCalmRound = 6;

/// Rounds end once loads change by less than this share of the largest.
constexpr double kSteadyLoad = 1e-12;

/// Corrections end once the function is to fall by this share of what contacts work on what was to happen without them.
constexpr double kDone = 1e-24;

/// A correction is cut where the slope at its end is steeper than this share of that at its beginning; to where it is this small.
constexpr double kSteepSlope = 0.1, kGentle = 1e-3;

}  // namespace

ContactSolve::ContactSolve() = default;
ContactSolve::~ContactSolve() = default;

/// Impulses of contacts that open by these gaps, and how they fall.
void ContactSolve::find_pushes(const Rows& rows, const Eigen::VectorXd& gaps) {
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(rows.first[c]);
    const ContactLaw& law = rows.laws[c];
    const double depth = -(gaps[at + 2] + law.lift), s1 = gaps[at], s2 = gaps[at + 1], length = std::hypot(s1, s2);
    const bool slides = length > law.creep;
    const double drag = law.friction * loads_[c] > 0 ? law.friction * loads_[c] / std::max(length, law.creep) : 0;
    pushes_[at] = -drag * s1;
    pushes_[at + 1] = -drag * s2;
    pushes_[at + 2] = law.stiffness * std::max(depth, 0.0);
    const double d1 = slides ? s1 / length : 0, d2 = slides ? s2 / length : 0;
    falls_[c] = {drag * (1 - d1 * d1), -drag * d1 * d2, drag * (1 - d2 * d2), depth > 0 ? law.stiffness : 0};
  }
}

/// change_ from what is left of all rows.
void ContactSolve::correct(const Rows& rows) {
  for (std::size_t j = 0; j < linear_.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    if (!linear_[j]) continue;
    if (std::isinf(rows.yields[j])) {
      matrix_.row(row).setZero();
      matrix_(row, row) = 1;
      change_[row] = 0;
    } else {
      matrix_.row(row) = product_.row(row);
      matrix_(row, row) += rows.yields[j];
      change_[row] = -gaps_[row] - rows.yields[j] * z_[row];
    }
  }
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(rows.first[c]);
    const auto& [h11, h12, h22, h33] = falls_[c];
    matrix_.row(at) = h11 * product_.row(at) + h12 * product_.row(at + 1);
    matrix_.row(at + 1) = h12 * product_.row(at) + h22 * product_.row(at + 1);
    matrix_.row(at + 2) = h33 * product_.row(at + 2);
    for (Eigen::Index k = at; k < at + 3; ++k) {
      matrix_(k, k) += 1;
      change_[k] = pushes_[k] - rows.multipliers[static_cast<std::size_t>(k)] - z_[k];
    }
  }
  factor_.compute(matrix_);
  change_ = factor_.solve(change_);
  moved_.noalias() = product_ * change_;
}

/// With pushes_ of what this share of the correction leads to.
double ContactSolve::slope(const Rows& rows, double share) const {
  double sum = 0;
  for (const std::size_t first : rows.first) {
    for (std::size_t j = first; j < first + 3; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      sum += (rows.multipliers[j] + z_[k] + share * change_[k] - pushes_[k]) * moved_[k];
    }
  }
  return sum;
}

double ContactSolve::share_of_correction(const Rows& rows, double slope_at_begin) {
  const auto slope_at = [&](double share) {
    tried_ = gaps_ + share * moved_;
    find_pushes(rows, tried_);
    return slope(rows, share);
  };
  double low = 0, high = 1, at_low = slope_at_begin, at_high = slope_at(1);
  if (slope_at_begin >= 0 || at_high <= -kSteepSlope * slope_at_begin) return 1;
  double share = 1;
  for (int trial = 0, side = 0; trial < kMostTrials; ++trial) {
    share = (low * at_high - high * at_low) / (at_high - at_low);
    const double now = slope_at(share);
    if (std::abs(now) <= -kGentle * slope_at_begin) break;
    if (now > 0) {
      high = share;
      at_high = now;
      if (side > 0) at_low /= 2;
      side = 1;
    } else {
      low = share;
      at_low = now;
      if (side < 0) at_high /= 2;
      side = -1;
    }
  }
  return share;
}

/// Rows that are no contact's are fulfilled with contacts as they are: from there on every correction keeps them so, and its slope is that of contacts.
void ContactSolve::solve_linear_rows(const Rows& rows) {
  if (!any_linear_) return;
  gaps_.noalias() = product_ * z_;
  gaps_ -= b_;
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(rows.first[c]);
    falls_[c] = {0, 0, 0, 0};
    for (Eigen::Index k = at; k < at + 3; ++k) pushes_[k] = rows.multipliers[static_cast<std::size_t>(k)] + z_[k];
  }
  correct(rows);
  z_ += change_;
}

void ContactSolve::solve(const Rows& rows, std::span<double> right_side) {
  const auto count = static_cast<Eigen::Index>(right_side.size());
  product_ = Eigen::Map<const Matrix>(rows.product.data(), count, count);
  b_ = Eigen::Map<const Eigen::VectorXd>(right_side.data(), count);
  matrix_.resize(count, count);
  for (Eigen::VectorXd* each : {&z_, &change_, &gaps_, &moved_, &tried_, &pushes_}) each->setZero(count);
  falls_.resize(rows.first.size());
  loads_.resize(rows.first.size());
  linear_.assign(right_side.size(), 1);
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    for (std::size_t j = rows.first[c]; j < rows.first[c] + 3; ++j) {
      linear_[j] = 0;
      z_[static_cast<Eigen::Index>(j)] = rows.guess[j];
    }
    loads_[c] = std::max(0.0, rows.multipliers[rows.first[c] + 2] + rows.guess[rows.first[c] + 2]);
  }
  any_linear_ = std::ranges::count(linear_, 1) > 0;
  solve_linear_rows(rows);
  corrections_ = 0;
  for (rounds_ = 1; rounds_ <= kMostLoadRounds; ++rounds_) {
    gaps_.noalias() = product_ * z_;
    gaps_ -= b_;
    for (int k = 0; k < kMostNewtonSteps; ++k) {
      find_pushes(rows, gaps_);
      correct(rows);
      ++corrections_;
      double work = 0;
      for (const std::size_t first : rows.first) {
        for (std::size_t j = first; j < first + 3; ++j) {
          const auto row = static_cast<Eigen::Index>(j);
          work += std::abs((rows.multipliers[j] + z_[row] + change_[row]) * b_[row]);
        }
      }
      const double begin = slope(rows, 0);
      const bool done = -begin <= kDone * work;
      const double share = done ? 1 : share_of_correction(rows, begin);
      z_ += share * change_;
      gaps_ += share * moved_;
      if (done) break;
    }
    double most = 0, changed = 0;
    bool rubs = false;
    for (std::size_t c = 0; c < rows.first.size(); ++c) {
      double load = std::max(0.0, rows.multipliers[rows.first[c] + 2] + z_[static_cast<Eigen::Index>(rows.first[c] + 2)]);
      rubs = rubs || rows.laws[c].friction > 0;
      most = std::max(most, load);
      changed = std::max(changed, std::abs(load - loads_[c]));
      if (rounds_ >= kCalmRound) load = 0.5 * (load + loads_[c]);
      loads_[c] = load;
    }
    if (!rubs || changed <= kSteadyLoad * most) break;
  }
  for (std::size_t j = 0; j < right_side.size(); ++j) right_side[j] = z_[static_cast<Eigen::Index>(j)];
}

}  // namespace linden
