#include "kernels/couplings/contact_solve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

namespace linden {
namespace {

constexpr int kMostLoadRounds = 100, kMostNewtonSteps = 100, kMostTrials = 40;

/// From this round on loads go half of the way: where friction is strong they would swing from one round to the next (of 1,000 random boxes on their
/// corners, with coefficients up to 1, the loads of 43 never stood still, and of 1 so).
constexpr int kCalmRound = 6;

/// Rounds end once loads change by less than this share of the largest; or than the second, where they hardly change less than in the round before:
/// of what is stiff and stands on many places rounding leaves so much (a wall of 12 rigid bricks took 9 ms a step, and takes 2).
constexpr double kSteadyLoad = 1e-12, kRoundedLoad = 1e-8, kHardlyLess = 0.7;

/// Corrections end once the function is to fall by this share of what contacts work on what was to happen without them; of a round that is not the
/// last, whose loads are to change, by no less than the square of a share of that change.
constexpr double kDone = 1e-24, kFirstDone = 1e-8, kShareOfChange = 1e-2;

/// A correction is cut where the slope at its end is steeper than this share of that at its beginning; to where it is this small.
constexpr double kSteepSlope = 0.1, kGentle = 1e-3;

/// A factor serves as long as H has changed by less than this share.
constexpr double kSameFalls = 1e-3;

/// action(size), which is known to the compiler where it is that of a free body.
template <class Action>
void with_size(std::size_t size, const Action& action) {
  if (size == 6) return action(std::integral_constant<std::size_t, 6>());
  action(size);
}

}  // namespace

ContactSolve::ContactSolve() = default;
ContactSolve::~ContactSolve() = default;

/// Impulses of contacts that open by these gaps, and how they fall.
void ContactSolve::find_pushes(const Rows& rows, const Eigen::VectorXd& gaps) {
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(rows.first[c]);
    const ContactLaw& law = rows.laws[c];
    const double depth = -(gaps[at + 2] + law.lift), s1 = gaps[at], s2 = gaps[at + 1], length = std::sqrt(s1 * s1 + s2 * s2);
    const bool slides = length > law.creep;
    const double drag = law.friction * loads_[c] > 0 ? law.friction * loads_[c] / std::max(length, law.creep) : 0;
    pushes_[at] = -drag * s1;
    pushes_[at + 1] = -drag * s2;
    pushes_[at + 2] = law.stiffness * std::max(depth, 0.0);
    const double d1 = slides ? s1 / length : 0, d2 = slides ? s2 / length : 0;
    falls_[c] = {drag * (1 - d1 * d1), -drag * d1 * d2, drag * (1 - d2 * d2), depth > 0 ? law.stiffness : 0};
  }
}

void ContactSolve::prepare(Product product) {
  product_ = std::move(product);
  std::vector<Group> groups = product_.groups;
  FrontalSolve::Elements elements;
  contact_of_.clear();
  row_group_.clear();
  first_number_.resize(product_.terms.size());
  std::size_t contacts = 0, rows = 0, numbers = 0;
  any_linear_ = false;
  for (const Block& block : product_.blocks) {
    for (std::size_t t = block.first_term; t < block.last_term; ++t) {
      elements.groups.push_back(product_.terms[t].group);
      first_number_[t] = numbers;
      numbers += block.rows * groups[product_.terms[t].group].size;
    }
    contact_of_.push_back(contacts);
    row_group_.push_back(groups.size());
    if (block.touches) {
      ++contacts;
    } else {
      any_linear_ = true;
      elements.groups.push_back(groups.size());
      groups.push_back({block.rows, true});
    }
    elements.first.push_back(elements.groups.size());
    rows = std::max(rows, block.first + block.rows);
  }
  frontal_.analyse(groups, elements);
  diagonal_.resize(frontal_.unknowns());
  motion_.resize(frontal_.unknowns());
  for (Eigen::VectorXd* each : {&b_, &z_, &change_, &gaps_, &moved_, &tried_, &pushes_}) each->setZero(static_cast<Eigen::Index>(rows));
  for (std::vector<Falls>* each : {&falls_, &factored_}) each->resize(contacts);
  loads_.resize(contacts);
  for (std::vector<double>* each : {&across_, &columns_}) each->resize(numbers);
  renew();
}

void ContactSolve::read() {
  if (is_read_) return;
  is_read_ = true;
  for (const Block& block : product_.blocks) {
    for (std::size_t t = block.first_term; t < block.last_term; ++t) {
      const Term& term = product_.terms[t];
      std::size_t to = first_number_[t];
      for (std::size_t j = 0; j < block.rows; ++j) {
        for (std::size_t n = 0; n < product_.groups[term.group].size; ++n, ++to) {
          across_[to] = term.across[n * term.number_stride + j * term.row_stride];
          columns_[to] = term.columns[n * term.number_stride + j * term.row_stride];
        }
      }
    }
  }
}

/// motion += X impulses, openings = Y motion, of a block's.
void ContactSolve::move(const Block& block, const double* impulses, double* motion) const {
  for (std::size_t t = block.first_term; t < block.last_term; ++t) {
    const std::size_t group = product_.terms[t].group, size = product_.groups[group].size;
    double* const to = motion + frontal_.first_of(group);
    const double* column = &columns_[first_number_[t]];
    with_size(size, [&](auto numbers) {
      for (std::size_t j = 0; j < block.rows; ++j, column += numbers) {
        for (std::size_t n = 0; n < numbers; ++n) to[n] += column[n] * impulses[j];
      }
    });
  }
}
void ContactSolve::open(const Block& block, const double* motion, double* openings) const {
  std::fill_n(openings, block.rows, 0.0);
  for (std::size_t t = block.first_term; t < block.last_term; ++t) {
    const std::size_t group = product_.terms[t].group, size = product_.groups[group].size;
    const double* const from = motion + frontal_.first_of(group);
    const double* row = &across_[first_number_[t]];
    with_size(size, [&](auto numbers) {
      for (std::size_t j = 0; j < block.rows; ++j, row += numbers) {
        double sum = 0;
        for (std::size_t n = 0; n < numbers; ++n) sum += row[n] * from[n];
        openings[j] += sum;
      }
    });
  }
}

/// openings = S impulses.
void ContactSolve::multiply(const Eigen::VectorXd& impulses, Eigen::VectorXd& openings) {
  std::ranges::fill(motion_, 0.0);
  for (const Block& block : product_.blocks) move(block, &impulses[static_cast<Eigen::Index>(block.first)], motion_.data());
  for (const Block& block : product_.blocks) open(block, motion_.data(), &openings[static_cast<Eigen::Index>(block.first)]);
}

bool ContactSolve::is_near(const Falls& factored, const Falls& now) const {
  const double most = std::max({factored[0], factored[2], now[0], now[2]});
  if (std::abs(factored[3] - now[3]) > kSameFalls * std::min(factored[3], now[3])) return false;
  for (const std::size_t k : {0u, 1u, 2u}) {
    if (std::abs(factored[k] - now[k]) > kSameFalls * most) return false;
  }
  return true;
}

/// X H Y.
void ContactSolve::add_contact(const Block& block, const Falls& falls, double* front, std::size_t stride, const std::size_t* at) const {
  const auto& [h11, h12, h22, h33] = falls;
  if (h11 == 0 && h22 == 0 && h33 == 0) return;
  for (std::size_t t = block.first_term; t < block.last_term; ++t) {
    const std::size_t size = product_.groups[product_.terms[t].group].size;
    const double* const x = &columns_[first_number_[t]];
    for (std::size_t n = 0; n < size; ++n) {
      const double x1 = x[n], x2 = x[size + n], a1 = h11 * x1 + h12 * x2, a2 = h12 * x1 + h22 * x2, a3 = h33 * x[2 * size + n];
      double* const row = front + (at[t - block.first_term] + n) * stride;
      for (std::size_t u = block.first_term; u < block.last_term; ++u) {
        const std::size_t width = product_.groups[product_.terms[u].group].size;
        const double *const y1 = &across_[first_number_[u]], *const y2 = y1 + width, *const y3 = y2 + width;
        double* const to = row + at[u - block.first_term];
        with_size(width, [&](auto numbers) {
          for (std::size_t m = 0; m < numbers; ++m) to[m] += a1 * y1[m] + a2 * y2[m] + a3 * y3[m];
        });
      }
    }
  }
}

/// Rows that are held already stay where they are, and nothing feels them.
void ContactSolve::add_linear(const Block& block, const Rows& rows, double* front, std::size_t stride, const std::size_t* at) const {
  const std::size_t own = at[block.last_term - block.first_term];
  for (std::size_t t = block.first_term; t < block.last_term; ++t) {
    const std::size_t size = product_.groups[product_.terms[t].group].size;
    for (std::size_t j = 0; j < block.rows; ++j) {
      if (std::isinf(rows.yields[block.first + j])) continue;
      for (std::size_t n = 0; n < size; ++n) {
        const std::size_t number = at[t - block.first_term] + n, from = first_number_[t] + j * size + n;
        front[number * stride + own + j] -= columns_[from];
        front[(own + j) * stride + number] += across_[from];
      }
    }
  }
}

void ContactSolve::factor(const Rows& rows) {
  factored_ = falls_;
  is_factored_ = true;
  ++factors_;
  std::ranges::fill(diagonal_, 1.0);
  for (std::size_t k = 0; k < product_.blocks.size(); ++k) {
    const Block& block = product_.blocks[k];
    for (std::size_t j = 0; !block.touches && j < block.rows; ++j) {
      const double yield = rows.yields[block.first + j];
      diagonal_[frontal_.first_of(row_group_[k]) + j] = std::isinf(yield) ? 1 : yield;
    }
  }
  frontal_.factor(diagonal_, [this, &rows](std::size_t k, double* front, std::size_t stride, const std::size_t* at) {
    const Block& block = product_.blocks[k];
    if (block.touches) return add_contact(block, factored_[contact_of_[k]], front, stride, at);
    add_linear(block, rows, front, stride, at);
  });
}

/// change_ from what is left of all rows.
void ContactSolve::correct(const Rows& rows) {
  bool any_left = any_linear_, near = is_factored_;
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    for (std::size_t j = rows.first[c]; j < rows.first[c] + 3; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      change_[k] = pushes_[k] - rows.multipliers[j] - z_[k];
      any_left = any_left || change_[k] != 0;
    }
    near = near && is_near(factored_[c], falls_[c]);
  }
  if (!any_left) {
    moved_.setZero();
    return;
  }
  if (!near) factor(rows);
  std::ranges::fill(motion_, 0.0);
  for (std::size_t k = 0; k < product_.blocks.size(); ++k) {
    const Block& block = product_.blocks[k];
    if (block.touches) {
      move(block, &change_[static_cast<Eigen::Index>(block.first)], motion_.data());
      continue;
    }
    for (std::size_t j = 0; j < block.rows; ++j) {
      const auto row = static_cast<Eigen::Index>(block.first + j);
      const double yield = rows.yields[block.first + j];
      motion_[frontal_.first_of(row_group_[k]) + j] = std::isinf(yield) ? 0 : -gaps_[row] - yield * z_[row];
    }
  }
  frontal_.solve(motion_);
  for (std::size_t k = 0; k < product_.blocks.size(); ++k) {
    const Block& block = product_.blocks[k];
    double* const change = &change_[static_cast<Eigen::Index>(block.first)];
    if (!block.touches) {
      std::copy_n(&motion_[frontal_.first_of(row_group_[k])], block.rows, change);
      continue;
    }
    const auto& [h11, h12, h22, h33] = factored_[contact_of_[k]];
    if (h11 == 0 && h22 == 0 && h33 == 0) continue;
    double opens[3];
    open(block, motion_.data(), opens);
    change[0] -= h11 * opens[0] + h12 * opens[1];
    change[1] -= h12 * opens[0] + h22 * opens[1];
    change[2] -= h33 * opens[2];
  }
  multiply(change_, moved_);
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
  multiply(z_, gaps_);
  gaps_ -= b_;
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(rows.first[c]);
    falls_[c] = {};
    for (Eigen::Index k = at; k < at + 3; ++k) pushes_[k] = rows.multipliers[static_cast<std::size_t>(k)] + z_[k];
  }
  correct(rows);
  z_ += change_;
}

void ContactSolve::solve(const Rows& rows, std::span<double> right_side) {
  read();
  std::ranges::copy(right_side, b_.begin());
  z_.setZero();
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    for (std::size_t j = rows.first[c]; j < rows.first[c] + 3; ++j) z_[static_cast<Eigen::Index>(j)] = rows.guess[j];
    loads_[c] = std::max(0.0, rows.multipliers[rows.first[c] + 2] + rows.guess[rows.first[c] + 2]);
  }
  factors_ = 0;
  solve_linear_rows(rows);
  corrections_ = 0;
  double enough = kFirstDone, changed_before = std::numeric_limits<double>::infinity();
  for (rounds_ = 1; rounds_ <= kMostLoadRounds; ++rounds_) {
    multiply(z_, gaps_);
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
      const bool done = -begin <= enough * work;
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
    const bool rounded = changed <= kRoundedLoad * most && changed > kHardlyLess * changed_before;
    if (enough <= kDone && (!rubs || changed <= kSteadyLoad * most || rounded)) break;
    changed_before = changed;
    const double change = rubs && most > 0 ? kShareOfChange * changed / most : 0;
    enough = std::clamp(change * change, kDone, kFirstDone);
  }
  for (std::size_t j = 0; j < right_side.size(); ++j) right_side[j] = z_[static_cast<Eigen::Index>(j)];
}

ContactSolves::ContactSolves() = default;
ContactSolves::~ContactSolves() = default;

void ContactSolves::prepare(std::size_t closure, ContactSolve::Product product) {
  if (closure >= solves_.size()) solves_.resize(closure + 1);
  solves_[closure] = std::make_unique<ContactSolve>();
  solves_[closure]->prepare(std::move(product));
}

ContactSolve& ContactSolves::operator[](std::size_t closure) { return *solves_[closure]; }

void ContactSolves::renew(std::size_t closure) {
  if (closure < solves_.size() && solves_[closure]) solves_[closure]->renew();
}

}  // namespace linden
