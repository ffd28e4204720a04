#include "kernels/couplings/contact_solve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

namespace linden {
namespace {

constexpr int kMostLoadRounds = 100, kMostNewtonSteps = 100, kMostTrials = 40, kMostOwnLoadSteps = 12;

/// From this round on loads go a part of the way, half of it at first: where friction is strong they would swing from one round to the next (of 1,000
/// random boxes on their corners, with coefficients up to 1, the loads of 43 never stood still, and of 1 so). How far then follows from how the last
/// two changes differ (Aitken): a rod that slides on an edge, at a coefficient of 2, swings with five times the change at two corners. Where changes
/// grow and keep their way, as of Painleve's rod that jams, they go twice as far each time, until it sticks.
constexpr int kCalmRound = 6;
constexpr double kCalmShare = 0.5, kLeastShare = 1.0 / 64, kMostShare = 64;
/// From this one on they may go farther than they would where changes fall slowly: two loads that one row shares among them.
constexpr int kSlowRound = 20;

/// Rounds end once loads change by less than this share of the largest; or than the second, where they hardly change less than in the round before:
/// of what is stiff and stands on many places rounding leaves so much (a wall of 12 rigid bricks took 9 ms a step, and takes 2).
constexpr double kSteadyLoad = 1e-12, kRoundedLoad = 1e-8, kHardlyLess = 0.7;

/// Corrections end once the function is to fall by this share of what contacts work on what was to happen without them; of a round that is not the
/// last, whose loads are to change, by no less than the square of a share of that change.
constexpr double kDone = 1e-24, kFirstDone = 1e-8, kShareOfChange = 1e-2;

/// Loads that change by less than this share of the largest, and ever less, are left to rounds, whose factor serves on: a block at rest would make a
/// second one in every solve.
constexpr double kNearLoad = 1e-4;

/// A correction is cut where the slope at its end is steeper than this share of that at its beginning; to where it is this small.
constexpr double kSteepSlope = 0.1, kGentle = 1e-3;

/// A factor serves as long as H has changed by less than this share.
constexpr double kSameFalls = 1e-3;

/// Rows of a contact that resists turning; of others there are three.
constexpr std::size_t kTurning = 6;

/// action(width), which is known to the compiler where it is that of one free body or two.
template <class Action>
void with_width(std::size_t width, const Action& action) {
  if (width == 6) return action(std::integral_constant<std::size_t, 6>());
  if (width == 12) return action(std::integral_constant<std::size_t, 12>());
  action(width);
}

}  // namespace

ContactSolve::ContactSolve() = default;
ContactSolve::~ContactSolve() = default;

/// Impulses of contacts that open by these gaps, and how they fall.
void ContactSolve::find_pushes(const Rows& rows, const Eigen::VectorXd& gaps, Load load) {
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(rows.first[c]);
    const ContactLaw& law = rows.laws[c];
    const double depth = -(gaps[at + 2] + law.lift), s1 = gaps[at], s2 = gaps[at + 1], length = std::sqrt(s1 * s1 + s2 * s2);
    const bool slides = length > law.creep;
    const double push = law.stiffness * std::max(depth, 0.0), fall = depth > 0 ? law.stiffness : 0;
    const double borne = law.friction * (load == Load::own ? push : loads_[c]);
    const double per_length = borne > 0 ? 1 / std::max(length, law.creep) : 0, drag = borne * per_length;
    pushes_[at] = -drag * s1;
    pushes_[at + 1] = -drag * s2;
    pushes_[at + 2] = push;
    const double d1 = slides ? s1 / length : 0, d2 = slides ? s2 / length : 0;
    const double less = load == Load::own ? -law.friction * fall * per_length : 0;
    falls_[c] = {drag * (1 - d1 * d1), -drag * d1 * d2, drag * (1 - d2 * d2), fall, less * s1, less * s2};
    if (rows_of_[c] != kTurning) continue;
    const bool own = load == Load::own;
    find_turn_pushes(law, own ? push : loads_[c], own ? fall : 0, &gaps[at + 3], &pushes_[at + 3], turn_falls_[c]);
  }
}

/// The same of turns, of a load that falls so by an opening.
void ContactSolve::find_turn_pushes(const ContactLaw& law, double borne, double fall, const double* turns, double* pushes, TurnFalls& falls) {
  const double r1 = turns[0], r2 = turns[1], w = turns[2], length = std::sqrt(r1 * r1 + r2 * r2), spun = std::abs(w);
  const double per_length = borne > 0 ? 1 / std::max(length, law.creep) : 0, drag = law.rolling * borne * per_length;
  const double per_spun = borne > 0 ? 1 / std::max(spun, law.creep) : 0, twist = law.torsion * borne * per_spun;
  pushes[0] = -drag * r1;
  pushes[1] = -drag * r2;
  pushes[2] = -twist * w;
  const bool rolls = length > law.creep, spins = spun > law.creep;
  const double d1 = rolls ? r1 / length : 0, d2 = rolls ? r2 / length : 0, less = -law.rolling * fall * per_length;
  falls = {drag * (1 - d1 * d1), -drag * d1 * d2, drag * (1 - d2 * d2), spins ? 0 : twist, less * r1, less * r2, -law.torsion * fall * per_spun * w};
}

void ContactSolve::prepare(Product product) {
  product_ = std::move(product);
  std::vector<Group> groups = product_.groups;
  FrontalSolve::Elements elements;
  contact_of_.clear();
  rows_of_.clear();
  row_group_.clear();
  widths_.clear();
  std::size_t contacts = 0, rows = 0, numbers = 0, unknowns = 0, widest = 0;
  any_linear_ = false;
  for (const Block& block : product_.blocks) {
    Width width{.numbers = 0, .first_number = numbers, .first_unknown = unknowns};
    for (std::size_t t = block.first_term; t < block.last_term; ++t) {
      elements.groups.push_back(product_.terms[t].group);
      width.numbers += groups[product_.terms[t].group].size;
    }
    numbers += block.rows * width.numbers;
    unknowns += width.numbers;
    widest = std::max(widest, width.numbers);
    widths_.push_back(width);
    contact_of_.push_back(contacts);
    row_group_.push_back(groups.size());
    if (block.touches) {
      ++contacts;
      rows_of_.push_back(block.rows);
    } else {
      any_linear_ = true;
      elements.groups.push_back(groups.size());
      groups.push_back({block.rows, true});
    }
    elements.first.push_back(elements.groups.size());
    rows = std::max(rows, block.first + block.rows);
  }
  frontal_.analyse(groups, elements);
  unknowns_.clear();
  for (const Block& block : product_.blocks) {
    for (std::size_t t = block.first_term; t < block.last_term; ++t) {
      const std::size_t group = product_.terms[t].group;
      for (std::size_t n = 0; n < groups[group].size; ++n) unknowns_.push_back(frontal_.first_of(group) + n);
    }
  }
  gathered_.resize(widest);
  places_.resize(widest);
  diagonal_.resize(frontal_.unknowns());
  motion_.resize(frontal_.unknowns());
  for (Eigen::VectorXd* each : {&b_, &z_, &change_, &gaps_, &moved_, &tried_, &left_, &pushes_}) each->setZero(static_cast<Eigen::Index>(rows));
  for (std::vector<Falls>* each : {&falls_, &factored_}) each->resize(contacts);
  for (std::vector<TurnFalls>* each : {&turn_falls_, &factored_turns_}) each->assign(contacts, TurnFalls{});
  loads_.resize(contacts);
  changes_.resize(contacts);
  for (std::vector<double>* each : {&across_, &columns_}) each->resize(numbers);
  renew();
}

void ContactSolve::read() {
  if (is_read_) return;
  is_read_ = true;
  for (std::size_t k = 0; k < product_.blocks.size(); ++k) {
    const Block& block = product_.blocks[k];
    std::size_t to = widths_[k].first_number;
    for (std::size_t j = 0; j < block.rows; ++j) {
      for (std::size_t t = block.first_term; t < block.last_term; ++t) {
        const Term& term = product_.terms[t];
        for (std::size_t n = 0; n < product_.groups[term.group].size; ++n, ++to) {
          across_[to] = term.across[n * term.number_stride + j * term.row_stride];
          columns_[to] = term.columns[n * term.number_stride + j * term.row_stride];
        }
      }
    }
  }
}

/// motion += X impulses, openings = Y motion, of a block's.
void ContactSolve::move(std::size_t block, const double* impulses, double* motion) const {
  const std::size_t rows = product_.blocks[block].rows;
  const std::size_t* const at = &unknowns_[widths_[block].first_unknown];
  const double* const column = &columns_[widths_[block].first_number];
  with_width(widths_[block].numbers, [&](auto width) {
    if (rows == 3) {
      const double *const x1 = column, *const x2 = x1 + width, *const x3 = x2 + width;
      const double i1 = impulses[0], i2 = impulses[1], i3 = impulses[2];
      for (std::size_t n = 0; n < width; ++n) motion[at[n]] += x1[n] * i1 + x2[n] * i2 + x3[n] * i3;
      return;
    }
    for (std::size_t j = 0; j < rows; ++j) {
      for (std::size_t n = 0; n < width; ++n) motion[at[n]] += column[j * width + n] * impulses[j];
    }
  });
}
void ContactSolve::open(std::size_t block, const double* motion, double* openings) const {
  const std::size_t rows = product_.blocks[block].rows;
  const std::size_t* const at = &unknowns_[widths_[block].first_unknown];
  const double* const row = &across_[widths_[block].first_number];
  with_width(widths_[block].numbers, [&](auto width) {
    if (rows == 3) {
      const double *const y1 = row, *const y2 = y1 + width, *const y3 = y2 + width;
      double o1 = 0, o2 = 0, o3 = 0;
      for (std::size_t n = 0; n < width; ++n) {
        const double moved = motion[at[n]];
        o1 += y1[n] * moved;
        o2 += y2[n] * moved;
        o3 += y3[n] * moved;
      }
      openings[0] = o1;
      openings[1] = o2;
      openings[2] = o3;
      return;
    }
    for (std::size_t j = 0; j < rows; ++j) {
      double sum = 0;
      for (std::size_t n = 0; n < width; ++n) sum += row[j * width + n] * motion[at[n]];
      openings[j] = sum;
    }
  });
}

/// openings = S impulses.
void ContactSolve::multiply(const Eigen::VectorXd& impulses, Eigen::VectorXd& openings) {
  std::ranges::fill(motion_, 0.0);
  const auto first = [&](std::size_t block) { return static_cast<Eigen::Index>(product_.blocks[block].first); };
  for (std::size_t k = 0; k < product_.blocks.size(); ++k) move(k, &impulses[first(k)], motion_.data());
  for (std::size_t k = 0; k < product_.blocks.size(); ++k) open(k, motion_.data(), &openings[first(k)]);
}

bool ContactSolve::is_near(const Falls& factored, const Falls& now) {
  const double most = std::max({factored[0], factored[2], now[0], now[2]});
  if (std::abs(factored[3] - now[3]) > kSameFalls * std::min(factored[3], now[3])) return false;
  for (const std::size_t k : {0u, 1u, 2u}) {
    if (std::abs(factored[k] - now[k]) > kSameFalls * most) return false;
  }
  for (const std::size_t k : {4u, 5u}) {
    if (std::abs(factored[k] - now[k]) > kSameFalls * now[3]) return false;
  }
  return true;
}

/// The same of turns; along: H along the normal.
bool ContactSolve::are_near(const TurnFalls& factored, const TurnFalls& now, double along) {
  const double most = std::max({factored[0], factored[2], factored[3], now[0], now[2], now[3]});
  for (std::size_t k = 0; k < now.size(); ++k) {
    if (std::abs(factored[k] - now[k]) > kSameFalls * (k < 4 ? most : along)) return false;
  }
  return true;
}

/// Whether anything of a contact does, as the factor has it.
bool ContactSolve::falls_at_all(std::size_t contact) const {
  const Falls& falls = factored_[contact];
  if (falls[0] != 0 || falls[2] != 0 || falls[3] != 0) return true;
  return rows_of_[contact] == kTurning && std::ranges::any_of(factored_turns_[contact], [](double number) { return number != 0; });
}

/// X H Y.
void ContactSolve::add_contact(std::size_t block, double* front, std::size_t stride, const std::size_t* at) {
  if (!falls_at_all(contact_of_[block])) return;
  const Falls& falls = factored_[contact_of_[block]];
  find_places(product_.blocks[block], at);
  if (product_.blocks[block].rows == kTurning) add_turns(block, front, stride);
  with_width(widths_[block].numbers, [&](auto width) {
    const auto& [h11, h12, h22, h33, h13, h23] = falls;
    const double *const x1 = &columns_[widths_[block].first_number], *const x2 = x1 + width, *const x3 = x2 + width;
    const double *const y1 = &across_[widths_[block].first_number], *const y2 = y1 + width, *const y3 = y2 + width;
    for (std::size_t n = 0; n < width; ++n) {
      const double a1 = h11 * x1[n] + h12 * x2[n], a2 = h12 * x1[n] + h22 * x2[n], a3 = h13 * x1[n] + h23 * x2[n] + h33 * x3[n];
      for (std::size_t m = 0; m < width; ++m) gathered_[m] = a1 * y1[m] + a2 * y2[m] + a3 * y3[m];
      double* const row = front + places_[n] * stride;
      for (std::size_t m = 0; m < width; ++m) row[places_[m]] += gathered_[m];
    }
  });
}

/// The same of turns, at places_.
void ContactSolve::add_turns(std::size_t block, double* front, std::size_t stride) {
  const auto& [h44, h45, h55, h66, h43, h53, h63] = factored_turns_[contact_of_[block]];
  const std::size_t width = widths_[block].numbers;
  const auto row = [&](const std::vector<double>& numbers, std::size_t k) { return &numbers[widths_[block].first_number + (k - 1) * width]; };
  const double *const x4 = row(columns_, 4), *const x5 = row(columns_, 5), *const x6 = row(columns_, 6);
  const double *const y3 = row(across_, 3), *const y4 = row(across_, 4), *const y5 = row(across_, 5), *const y6 = row(across_, 6);
  for (std::size_t n = 0; n < width; ++n) {
    const double a3 = h43 * x4[n] + h53 * x5[n] + h63 * x6[n], a4 = h44 * x4[n] + h45 * x5[n], a5 = h45 * x4[n] + h55 * x5[n], a6 = h66 * x6[n];
    double* const to = front + places_[n] * stride;
    for (std::size_t m = 0; m < width; ++m) to[places_[m]] += a3 * y3[m] + a4 * y4[m] + a5 * y5[m] + a6 * y6[m];
  }
}

/// Of each number of a block, its place in a front where its groups begin at these.
void ContactSolve::find_places(const Block& block, const std::size_t* at) {
  std::size_t to = 0;
  for (std::size_t t = block.first_term; t < block.last_term; ++t) {
    for (std::size_t n = 0; n < product_.groups[product_.terms[t].group].size; ++n) places_[to++] = at[t - block.first_term] + n;
  }
}

/// Rows that are held already stay where they are, and nothing feels them.
void ContactSolve::add_linear(std::size_t block, const Rows& rows, double* front, std::size_t stride, const std::size_t* at) {
  const Block& its = product_.blocks[block];
  find_places(its, at);
  const std::size_t own = at[its.last_term - its.first_term], width = widths_[block].numbers;
  for (std::size_t j = 0; j < its.rows; ++j) {
    if (std::isinf(rows.yields[its.first + j])) continue;
    const std::size_t from = widths_[block].first_number + j * width;
    for (std::size_t n = 0; n < width; ++n) {
      front[places_[n] * stride + own + j] -= columns_[from + n];
      front[(own + j) * stride + places_[n]] += across_[from + n];
    }
  }
}

void ContactSolve::factor(const Rows& rows) {
  factored_ = falls_;
  factored_turns_ = turn_falls_;
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
    if (block.touches) return add_contact(k, front, stride, at);
    add_linear(k, rows, front, stride, at);
  });
}

/// change_ from what is left of all rows.
void ContactSolve::correct(const Rows& rows) {
  bool any_left = any_linear_, near = is_factored_;
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    for (std::size_t j = rows.first[c]; j < end_of(rows, c); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      change_[k] = pushes_[k] - rows.multipliers[j] - z_[k];
      any_left = any_left || change_[k] != 0;
    }
    near = near && is_near(factored_[c], falls_[c]) && are_near(factored_turns_[c], turn_falls_[c], falls_[c][3]);
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
      move(k, &change_[static_cast<Eigen::Index>(block.first)], motion_.data());
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
    const auto& [h11, h12, h22, h33, h13, h23] = factored_[contact_of_[k]];
    if (!falls_at_all(contact_of_[k])) continue;
    double opens[kTurning];
    open(k, motion_.data(), opens);
    change[0] -= h11 * opens[0] + h12 * opens[1] + h13 * opens[2];
    change[1] -= h12 * opens[0] + h22 * opens[1] + h23 * opens[2];
    change[2] -= h33 * opens[2];
    if (block.rows != kTurning) continue;
    const auto& [h44, h45, h55, h66, h43, h53, h63] = factored_turns_[contact_of_[k]];
    change[3] -= h44 * opens[3] + h45 * opens[4] + h43 * opens[2];
    change[4] -= h45 * opens[3] + h55 * opens[4] + h53 * opens[2];
    change[5] -= h66 * opens[5] + h63 * opens[2];
  }
  multiply(change_, moved_);
}

/// With pushes_ of what this share of the correction leads to.
double ContactSolve::slope(const Rows& rows, double share) const {
  double sum = 0;
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    for (std::size_t j = rows.first[c]; j < end_of(rows, c); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      sum += (rows.multipliers[j] + z_[k] + share * change_[k] - pushes_[k]) * moved_[k];
    }
  }
  return sum;
}

double ContactSolve::share_of_correction(const Rows& rows, double slope_at_begin) {
  const auto slope_at = [&](double share) {
    tried_ = gaps_ + share * moved_;
    find_pushes(rows, tried_, Load::of_last_round);
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
    turn_falls_[c] = {};
    for (Eigen::Index k = at; k < static_cast<Eigen::Index>(end_of(rows, c)); ++k) pushes_[k] = rows.multipliers[static_cast<std::size_t>(k)] + z_[k];
  }
  correct(rows);
  z_ += change_;
}

/// From z_ and its gaps_; false, and z_ as it was, where corrections do not become ever smaller.
bool ContactSolve::solve_with_own_loads(const Rows& rows) {
  left_ = z_;
  double size_before = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kMostOwnLoadSteps; ++k) {
    find_pushes(rows, gaps_, Load::own);
    correct(rows);
    ++corrections_;
    double most = 0, size = 0;
    for (std::size_t c = 0; c < rows.first.size(); ++c) {
      const std::size_t first = rows.first[c];
      for (std::size_t j = first; j < end_of(rows, c); ++j) size = std::max(size, std::abs(change_[static_cast<Eigen::Index>(j)]));
      most = std::max(most, rows.multipliers[first + 2] + z_[static_cast<Eigen::Index>(first + 2)]);
    }
    const bool rounded = size <= kRoundedLoad * most && size > kHardlyLess * size_before;
    if (!rounded && !(size < size_before)) break;
    z_ += change_;
    gaps_ += moved_;
    if (rounded || size <= kSteadyLoad * most) return true;
    size_before = size;
  }
  z_ = left_;
  return false;
}

/// After a round. Returns the largest load, and the largest change of one that the round asks for.
std::array<double, 2> ContactSolve::renew_loads(const Rows& rows) {
  double most = 0, changed = 0, along = 0, square = 0;
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    const double load = std::max(0.0, rows.multipliers[rows.first[c] + 2] + z_[static_cast<Eigen::Index>(rows.first[c] + 2)]);
    const double change = load - loads_[c], differs = change - changes_[c];
    most = std::max(most, load);
    changed = std::max(changed, std::abs(change));
    along += changes_[c] * differs;
    square += differs * differs;
    changes_[c] = change;
  }
  if (rounds_ < kCalmRound) share_of_change_ = 1;
  if (rounds_ == kCalmRound) share_of_change_ = kCalmShare;
  if (rounds_ > kCalmRound) {
    const double most_share = rounds_ > kSlowRound ? kMostShare : 1;
    share_of_change_ = along < 0 ? std::clamp(-share_of_change_ * along / square, kLeastShare, most_share) : std::min(2 * share_of_change_, kMostShare);
  }
  for (std::size_t c = 0; c < rows.first.size(); ++c) loads_[c] += share_of_change_ * changes_[c];
  return {most, changed};
}

void ContactSolve::solve(const Rows& rows, std::span<double> right_side) {
  read();
  std::ranges::copy(right_side, b_.begin());
  z_.setZero();
  for (std::size_t c = 0; c < rows.first.size(); ++c) {
    for (std::size_t j = rows.first[c]; j < end_of(rows, c); ++j) z_[static_cast<Eigen::Index>(j)] = rows.guess[j];
    loads_[c] = std::max(0.0, rows.multipliers[rows.first[c] + 2] + rows.guess[rows.first[c] + 2]);
  }
  factors_ = 0;
  solve_linear_rows(rows);
  corrections_ = 0;
  const bool rubs = std::ranges::any_of(rows.laws, [](const ContactLaw& law) { return law.friction > 0 || law.rolling > 0 || law.torsion > 0; });
  double enough = kFirstDone, changed_before = std::numeric_limits<double>::infinity();
  for (rounds_ = 1; rounds_ <= kMostLoadRounds; ++rounds_) {
    multiply(z_, gaps_);
    gaps_ -= b_;
    for (int k = 0; k < kMostNewtonSteps; ++k) {
      find_pushes(rows, gaps_, Load::of_last_round);
      correct(rows);
      ++corrections_;
      double work = 0;
      for (std::size_t c = 0; c < rows.first.size(); ++c) {
        for (std::size_t j = rows.first[c]; j < end_of(rows, c); ++j) {
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
    const auto [most, changed] = renew_loads(rows);
    const bool rounded = changed <= kRoundedLoad * most && changed > kHardlyLess * changed_before;
    if (enough <= kDone && (!rubs || changed <= kSteadyLoad * most || rounded)) break;
    const bool far = changed > kNearLoad * most || changed > kHardlyLess * changed_before;
    changed_before = changed;
    if (rubs && far && solve_with_own_loads(rows)) break;
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
