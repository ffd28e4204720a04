#include "engine/guess/stage_guess.hpp"

#include <Eigen/Dense>
#include <algorithm>

#include "engine/guess/extrapolation.hpp"

namespace linden {

StageGuess::StageGuess(std::span<const double> stages, Index velocities)
    : stages_(stages),
      velocities_(static_cast<std::size_t>(velocities)),
      weights_(stages.size()),
      known_(stages.size(), 0),
      numbers_(stages.size() * (kRows + 1) * velocities_, 0.0),
      extrapolated_(velocities_, 0.0) {
  std::vector<double> middle;  // of each sub-step, in steps
  double begin = 0;
  for (const double stage : stages) {
    middle.push_back(begin + stage / 2);
    begin += stage;
  }
  const std::size_t count = stages.size();
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Matrix<double, kMisses, 3> powers;
    for (std::size_t k = 1; k <= kMisses; ++k) {
      const double at = middle[(i + count - k) % count] - (k > i ? 1 : 0) - middle[i];
      powers.row(static_cast<Eigen::Index>(k - 1)) << 1, at, at * at;
    }
    // the value at zero of the fitted parabola is a sum of the four values: these are its weights
    const Eigen::Matrix3d normal = powers.transpose() * powers;
    const Eigen::Matrix<double, kMisses, 1> w = powers * normal.inverse().col(0);
    std::ranges::copy(w, weights_[i].begin());
  }
}

bool StageGuess::predict(std::size_t stage, Field<double, kHistory>& history) {
  const std::int64_t known = known_[stage];
  if (known == 0) return false;
  // rows that are not known are zero
  const std::array<double, kHistory>& c = polynomial_through(static_cast<int>(known));
  const double *d0 = row(stage, 0), *d1 = row(stage, 1), *d2 = row(stage, 2), *d3 = row(stage, 3);
  // misses of lesser polynomials are larger than those to come
  const auto share = [&](std::size_t k) { return known < kRows ? 0 : stages_[stage] * weights_[stage][k - 1]; };
  const auto miss = [&](std::size_t k) { return row((stage + stages_.size() - k) % stages_.size(), kRows); };
  const double w1 = share(1), w2 = share(2), w3 = share(3), w4 = share(4);
  const double *m1 = miss(1), *m2 = miss(2), *m3 = miss(3), *m4 = miss(4);
  for (std::size_t v = 0; v < velocities_; ++v) {
    extrapolated_[v] = c[0] * d0[v] + c[1] * d1[v] + c[2] * d2[v] + c[3] * d3[v];
    history(static_cast<Index>(v), 0) = extrapolated_[v] + w1 * m1[v] + w2 * m2[v] + w3 * m3[v] + w4 * m4[v];
  }
  return true;
}

bool StageGuess::repeat(std::size_t stage, Field<double, kHistory>& history) {
  if (known_[stage] == 0) return false;
  const double* last = row(stage, 0);
  for (std::size_t v = 0; v < velocities_; ++v) history(static_cast<Index>(v), 0) = last[v];
  return true;
}

void StageGuess::learn(std::size_t stage, const Field<double, kHistory>& history) {
  const double share = known_[stage] == kRows ? 1 / stages_[stage] : 0;
  double *d0 = row(stage, 0), *d1 = row(stage, 1), *d2 = row(stage, 2), *d3 = row(stage, 3), *miss = row(stage, kRows);
  for (std::size_t v = 0; v < velocities_; ++v) {
    const double delta = history(static_cast<Index>(v), 0);
    miss[v] = share * (delta - extrapolated_[v]);
    d3[v] = d2[v];
    d2[v] = d1[v];
    d1[v] = d0[v];
    d0[v] = delta;
  }
  known_[stage] = std::min<std::int64_t>(known_[stage] + 1, kRows);
}

void StageGuess::forget(std::size_t stage) {
  known_[stage] = 0;
  std::fill(row(stage, 0), row(stage, kRows + 1), 0.0);
}

void StageGuess::change_length(double times) {
  for (double& number : numbers_) number *= times;
}

void StageGuess::forget() {
  std::ranges::fill(known_, 0);
  std::ranges::fill(numbers_, 0.0);
}

}  // namespace linden
