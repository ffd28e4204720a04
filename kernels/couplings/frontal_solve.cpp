#include "kernels/couplings/frontal_solve.hpp"

#include <Eigen/Dense>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace linden {
namespace {

/// Unknowns that are eliminated before others see them; in fronts beyond kWide, where products of matrices pay.
constexpr std::size_t kPanel = 6, kWidePanel = 48, kWide = 96;

/// Fronts of a child and its parent become one where both eliminate no more than this, and the child's grows by this share at most.
constexpr std::size_t kSmall = 12;
constexpr double kGrows = 0.35;

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Of groups that are not late, the order that fills in least.
std::vector<std::size_t> minimum_degree(std::span<const FrontalSolve::Group> groups, const FrontalSolve::Elements& elements) {
  std::vector<std::size_t> early;
  std::vector<int> number(groups.size(), -1);
  for (std::size_t k = 0; k < groups.size(); ++k) {
    if (groups[k].late) continue;
    number[k] = static_cast<int>(early.size());
    early.push_back(k);
  }
  Pairs pairs;
  for (std::size_t k = 0; k < early.size(); ++k) pairs.emplace_back(k, k);  // without its diagonal a group counts as one that meets all others
  for (std::size_t e = 0; e + 1 < elements.first.size(); ++e) {
    for (std::size_t i = elements.first[e]; i < elements.first[e + 1]; ++i) {
      for (std::size_t j = elements.first[e]; j < elements.first[e + 1]; ++j) {
        const int row = number[elements.groups[i]], column = number[elements.groups[j]];
        if (row >= 0 && column >= 0 && row != column) pairs.emplace_back(column, row);
      }
    }
  }
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const auto count = static_cast<int>(early.size());
  Eigen::SparseMatrix<double, Eigen::ColMajor, int> pattern(count, count);
  pattern.reserve(static_cast<Eigen::Index>(pairs.size()));
  auto next = pairs.begin();
  for (int column = 0; column < count; ++column) {
    pattern.startVec(column);
    for (; next != pairs.end() && next->first == static_cast<std::size_t>(column); ++next) pattern.insertBack(static_cast<int>(next->second), column) = 1;
  }
  pattern.finalize();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> found(count);
  if (count > 0) Eigen::AMDOrdering<int>()(pattern, found);
  std::vector<std::size_t> order;
  for (int k = 0; k < count; ++k) order.push_back(early[static_cast<std::size_t>(found.indices()[k])]);
  return order;
}

}  // namespace

/// Late groups come right after the last that they share an element with.
void FrontalSolve::order(std::span<const Group> groups, const Elements& elements) {
  const std::vector<std::size_t> early = minimum_degree(groups, elements);
  std::vector<std::size_t> turn(groups.size(), 0);
  for (std::size_t k = 0; k < early.size(); ++k) turn[early[k]] = k + 1;
  for (std::size_t e = 0; e + 1 < elements.first.size(); ++e) {
    const auto of = std::span(elements.groups).subspan(elements.first[e], elements.first[e + 1] - elements.first[e]);
    std::size_t last = 0;
    for (const std::size_t group : of) {
      if (!groups[group].late) last = std::max(last, turn[group]);
    }
    for (const std::size_t group : of) {
      if (groups[group].late) turn[group] = std::max(turn[group], last);
    }
  }
  order_.resize(groups.size());
  for (std::size_t k = 0; k < groups.size(); ++k) order_[k] = k;
  std::ranges::sort(order_, {}, [&](std::size_t k) { return std::tuple(turn[k], groups[k].late, k); });
  turn_.resize(groups.size());
  for (std::size_t k = 0; k < order_.size(); ++k) turn_[order_[k]] = k;
}

void FrontalSolve::analyse(std::span<const Group> groups, const Elements& elements) {
  first_.clear();
  size_.clear();
  unknowns_ = 0;
  for (const Group& group : groups) {
    first_.push_back(unknowns_);
    size_.push_back(group.size);
    unknowns_ += group.size;
  }
  order(groups, elements);
  make_fronts(elements);
}

void FrontalSolve::make_fronts(const Elements& elements) {
  const std::size_t count = order_.size(), none = count;
  // of each turn, elements whose first group it is, and turns that it is passed on to
  std::vector<std::vector<std::size_t>> elements_of(count), passed(count), children(count);
  for (std::size_t e = 0; e + 1 < elements.first.size(); ++e) {
    std::size_t first = none;
    for (std::size_t k = elements.first[e]; k < elements.first[e + 1]; ++k) first = std::min(first, turn_[elements.groups[k]]);
    if (first < none) elements_of[first].push_back(e);
  }
  std::vector<std::size_t> parent(count, none), met(count, none);
  for (std::size_t turn = 0; turn < count; ++turn) {
    std::vector<std::size_t>& to = passed[turn];
    met[turn] = turn;
    const auto meet = [&](std::size_t other) {
      if (std::exchange(met[other], turn) != turn) to.push_back(other);
    };
    for (const std::size_t e : elements_of[turn]) {
      for (std::size_t k = elements.first[e]; k < elements.first[e + 1]; ++k) meet(turn_[elements.groups[k]]);
    }
    for (const std::size_t child : children[turn]) std::ranges::for_each(passed[child], meet);
    std::ranges::sort(to);
    if (to.empty()) continue;
    parent[turn] = to.front();
    children[to.front()].push_back(turn);
  }
  // turns that are eliminated with another: with the last child of all that leaves room for no others
  const auto size_of = [&](std::span<const std::size_t> turns) {
    std::size_t sum = 0;
    for (const std::size_t turn : turns) sum += size_[order_[turn]];
    return sum;
  };
  std::vector<std::vector<std::size_t>> own(count);
  for (std::size_t turn = 0; turn < count; ++turn) {
    own[turn].push_back(turn);
    std::vector<std::size_t> left;
    const std::size_t rest = size_of(passed[turn]);
    for (const std::size_t child : children[turn]) {
      const std::size_t mine = size_of(own[turn]), its = size_of(own[child]), its_front = its + size_of(passed[child]);
      const std::size_t together = its + mine + rest;
      const bool as_it_is = together == its_front;
      if (as_it_is || (its + mine <= kSmall && static_cast<double>(together) <= (1 + kGrows) * static_cast<double>(its_front))) {
        own[turn].insert(own[turn].begin(), own[child].begin(), own[child].end());
        left.insert(left.end(), children[child].begin(), children[child].end());
      } else {
        left.push_back(child);
      }
    }
    std::ranges::sort(own[turn]);
    std::ranges::sort(left);
    children[turn] = left;
  }
  // children first
  fronts_.clear();
  std::vector<std::size_t> number_of(count, none);
  std::vector<std::pair<std::size_t, std::size_t>> open;  // a front, and how many of its children have been met
  for (std::size_t root = 0; root < count; ++root) {
    if (parent[root] != none) continue;
    open.emplace_back(root, 0);
    while (!open.empty()) {
      auto& [turn, done] = open.back();
      if (done < children[turn].size()) {
        open.emplace_back(children[turn][done++], 0);
        continue;
      }
      number_of[turn] = fronts_.size();
      Front& front = fronts_.emplace_back();
      for (const std::size_t one : own[turn]) {
        front.groups.push_back(order_[one]);
        front.elements.insert(front.elements.end(), elements_of[one].begin(), elements_of[one].end());
      }
      front.own = size_of(own[turn]);
      for (const std::size_t one : passed[turn]) front.groups.push_back(order_[one]);
      for (const std::size_t child : children[turn]) front.children.push_back(number_of[child]);
      open.pop_back();
    }
  }
  // where numbers are
  at_.clear();
  first_at_ = elements.first;
  at_.resize(elements.groups.size());
  std::vector<std::size_t> row(first_.size(), 0);  // of each group in the front that is looked at
  std::size_t numbers = 0, swaps = 0, widest = 0, stack = 0, most_stack = 0;
  for (Front& front : fronts_) {
    for (const std::size_t group : front.groups) {
      row[group] = front.size;
      for (std::size_t k = 0; k < size_[group]; ++k) front.unknowns.push_back(first_[group] + k);
      front.size += size_[group];
    }
    std::ranges::sort(front.elements);
    for (const std::size_t e : front.elements) {
      for (std::size_t k = elements.first[e]; k < elements.first[e + 1]; ++k) at_[k] = row[elements.groups[k]];
    }
    for (const std::size_t number : front.children) {
      Front& child = fronts_[number];
      std::size_t unknown = child.own;
      for (const std::size_t group : child.groups) {
        if (unknown == child.size || first_[group] != child.unknowns[unknown]) continue;
        for (std::size_t k = 0; k < size_[group]; ++k, ++unknown) child.at.push_back(row[group] + k);
      }
      stack -= (child.size - child.own) * (child.size - child.own);
    }
    const std::size_t rest = front.size - front.own;
    stack += rest * rest;
    most_stack = std::max(most_stack, stack);
    widest = std::max(widest, front.size);
    front.first_number = numbers;
    numbers += front.own * (front.size + rest);
    front.first_swap = swaps;
    swaps += front.own;
  }
  numbers_.resize(numbers);
  swaps_.resize(swaps);
  front_.resize(widest * widest);
  stack_.resize(most_stack);
  passed_.resize(widest);
}

/// Its own unknowns from the front there is; what stands left of and above the rest is the factor.
void FrontalSolve::eliminate(const Front& front, double* numbers, std::uint32_t* swaps) const {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Block = Eigen::Map<Matrix, 0, Eigen::OuterStride<>>;
  const std::size_t size = front.size;
  const std::size_t width = size > kWide ? kWidePanel : kPanel;
  const auto row = [&](std::size_t i) { return numbers + i * size; };
  for (std::size_t begin = 0; begin < front.own; begin += width) {
    const std::size_t end = std::min(front.own, begin + width);
    for (std::size_t k = begin; k < end; ++k) {
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i < front.own; ++i) {
        if (std::abs(row(i)[k]) > std::abs(row(pivot)[k])) pivot = i;
      }
      swaps[k] = static_cast<std::uint32_t>(pivot);
      if (pivot != k) std::swap_ranges(row(k), row(k) + size, row(pivot));
      const double* const top = row(k);
      const double inverse = 1 / top[k];
      for (std::size_t i = k + 1; i < size; ++i) {
        double* const low = row(i);
        const double share = low[k] *= inverse;
        for (std::size_t j = k + 1; j < end; ++j) low[j] -= share * top[j];
      }
    }
    for (std::size_t k = begin; k < end; ++k) {
      for (std::size_t i = k + 1; i < end; ++i) {
        const double share = row(i)[k];
        const double* const top = row(k);
        double* const low = row(i);
        for (std::size_t j = end; j < size; ++j) low[j] -= share * top[j];
      }
    }
    if (end == size) continue;
    if (size > kWide) {
      const auto at = [&](std::size_t i, std::size_t j, std::size_t rows, std::size_t columns) {
        return Block(row(i) + j, static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns), Eigen::OuterStride<>(static_cast<Eigen::Index>(size)));
      };
      at(end, end, size - end, size - end).noalias() -= at(end, begin, size - end, end - begin) * at(begin, end, end - begin, size - end);
      continue;
    }
    const double* top[kPanel];
    for (std::size_t k = begin; k < end; ++k) top[k - begin] = row(k);
    if (end - begin == 6) {  // a free body
      for (std::size_t i = end; i < size; ++i) {
        double* const low = row(i);
        const double a = low[begin], b = low[begin + 1], c = low[begin + 2], d = low[begin + 3], e = low[begin + 4], f = low[begin + 5];
        const double *t0 = top[0], *t1 = top[1], *t2 = top[2], *t3 = top[3], *t4 = top[4], *t5 = top[5];
        for (std::size_t j = end; j < size; ++j) low[j] -= a * t0[j] + b * t1[j] + c * t2[j] + d * t3[j] + e * t4[j] + f * t5[j];
      }
      continue;
    }
    for (std::size_t i = end; i < size; ++i) {
      double* const low = row(i);
      for (std::size_t k = begin; k < end; ++k) {
        const double share = low[k];
        const double* const t = top[k - begin];
        for (std::size_t j = end; j < size; ++j) low[j] -= share * t[j];
      }
    }
  }
}

void FrontalSolve::factor(std::span<const double> diagonal, const Add& add) {
  std::size_t stack = 0;
  for (const Front& front : fronts_) {
    const std::size_t size = front.size, rest = size - front.own;
    std::fill_n(front_.begin(), size * size, 0.0);
    for (std::size_t k = 0; k < front.own; ++k) front_[k * size + k] = diagonal[front.unknowns[k]];
    for (const std::size_t e : front.elements) add(e, front_.data(), size, &at_[first_at_[e]]);
    for (std::size_t k = front.children.size(); k-- > 0;) {
      const Front& child = fronts_[front.children[k]];
      const std::size_t left = child.size - child.own;
      stack -= left * left;
      for (std::size_t i = 0; i < left; ++i) {
        const double* const from = &stack_[stack + i * left];
        double* const to = &front_[child.at[i] * size];
        for (std::size_t j = 0; j < left; ++j) to[child.at[j]] += from[j];
      }
    }
    eliminate(front, front_.data(), &swaps_[front.first_swap]);
    double* const numbers = numbers_.data() + front.first_number;
    std::copy_n(front_.begin(), front.own * size, numbers);
    for (std::size_t i = 0; i < rest; ++i) {
      const double* const from = &front_[(front.own + i) * size];
      std::copy_n(from, front.own, numbers + front.own * size + i * front.own);
      std::copy_n(from + front.own, rest, stack_.data() + stack + i * rest);
    }
    stack += rest * rest;
  }
}

void FrontalSolve::solve(std::span<double> b) {
  for (const Front& front : fronts_) {
    const double* const numbers = numbers_.data() + front.first_number;
    for (std::size_t k = 0; k < front.own; ++k) passed_[k] = b[front.unknowns[k]];
    for (std::size_t k = 0; k < front.own; ++k) std::swap(passed_[k], passed_[swaps_[front.first_swap + k]]);
    for (std::size_t k = 0; k < front.own; ++k) {
      double sum = passed_[k];
      for (std::size_t j = 0; j < k; ++j) sum -= numbers[k * front.size + j] * passed_[j];
      passed_[k] = b[front.unknowns[k]] = sum;
    }
    const double* below = numbers + front.own * front.size;
    for (std::size_t i = front.own; i < front.size; ++i, below += front.own) {
      double sum = 0;
      for (std::size_t j = 0; j < front.own; ++j) sum += below[j] * passed_[j];
      b[front.unknowns[i]] -= sum;
    }
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    const double* const numbers = numbers_.data() + front.first_number;
    for (std::size_t k = front.own; k < front.size; ++k) passed_[k] = b[front.unknowns[k]];
    for (std::size_t k = front.own; k-- > 0;) {
      double sum = b[front.unknowns[k]];
      for (std::size_t j = k + 1; j < front.size; ++j) sum -= numbers[k * front.size + j] * passed_[j];
      passed_[k] = b[front.unknowns[k]] = sum / numbers[k * front.size + k];
    }
  }
}

}  // namespace linden
