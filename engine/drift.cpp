#include "engine/drift.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/mass_distribution.hpp"
#include "models/build/vectors.hpp"

namespace linden {

bool is_motion(const Model& model, double kinetic) {
  constexpr double kRest = 1e-12;  // [m/s]
  return kinetic > 0.5 * model.constants.subtree_mass(0) * kRest * kRest;
}
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Whether no joint ties any body to the world: all roots are carried by free joints.
bool floats(const Tree& tree) {
  return std::ranges::all_of(tree.roots(), [&](Index root) { return tree.kind(root) == JointKind::free; });
}

/// Nothing moved and nothing drifted: 0.
double relative(double drift, double scale) { return drift == 0 ? 0 : drift / scale; }

}  // namespace

std::int64_t energy_stride(std::int64_t steps) {
  constexpr std::int64_t kSamples = 20'000;
  return std::max<std::int64_t>(1, (steps + kSamples - 1) / kSamples);
}

void LineFit::add(double x, double y) {
  points_ += 1;
  const double dx = x - mean_x_, dy = y - mean_y_, n = static_cast<double>(points_);
  mean_x_ += dx / n;
  mean_y_ += dy / n;
  xx_ += dx * (x - mean_x_);
  xy_ += dx * (y - mean_y_);
  yy_ += dy * (y - mean_y_);
}

double LineFit::slope() const { return points_ < 2 ? kUnknown : xy_ / xx_; }

double LineFit::slope_error() const {
  if (points_ < 3) return kUnknown;
  const double left = std::max(0.0, yy_ - xy_ * xy_ / xx_);  // squares that the line does not explain
  return std::sqrt(left / static_cast<double>(points_ - 2) / xx_);
}

void EnergyDrift::add(double time, const Energy& energy, double taken, double given) {
  const double account = energy.total() + taken - given;
  if (samples_ == 0) {
    begin_ = time;
    initial_ = lowest_ = highest_ = account;
    first_potential_ = energy.potential;
  }
  lowest_ = std::min(lowest_, account);
  highest_ = std::max(highest_, account);
  if (samples_ == 1) first_change_ = std::abs(account - initial_);
  scale_ = std::max(scale_, energy.kinetic);
  exchanged_ = std::max({exchanged_, energy.kinetic, std::abs(energy.potential - first_potential_), std::abs(taken), std::abs(given)});
  magnitude_ = std::max(magnitude_, energy.kinetic + std::abs(energy.potential) + std::abs(taken) + std::abs(given));
  const std::int64_t stretch = std::min<std::int64_t>(samples_ * kStretches / samples_expected_, kStretches - 1);
  line_.add(time - begin_, account - initial_);
  stretches_[static_cast<std::size_t>(stretch)].add(time - begin_, account - initial_);
  samples_ += 1;
}

double EnergyDrift::slope_error() const {
  LineFit means;
  for (const LineFit& stretch : stretches_) {
    if (stretch.points() > 0) means.add(stretch.mean_x(), stretch.mean_y());
  }
  if (means.points() < kStretches / 2) return kUnknown;
  // what is left of one stretch resembles the next: correlation of neighbours, as of a first-order process
  double products = 0, squares = 0, before = 0;
  for (const LineFit& stretch : stretches_) {
    if (stretch.points() == 0) continue;
    const double left = stretch.mean_y() - means.mean_y() - means.slope() * (stretch.mean_x() - means.mean_x());
    products += left * before;
    squares += left * left;
    before = left;
  }
  constexpr double kMostCorrelation = 0.95;
  const double correlation = squares > 0 ? std::clamp(products / squares, 0.0, kMostCorrelation) : 0;
  return means.slope_error() * std::sqrt((1 + correlation) / (1 - correlation));
}

std::optional<MomentumDrift> MomentumDrift::of(Simulation& simulation) {
  return of(simulation.model(), simulation.options().gravity, simulation.time(), simulation.positions(), simulation.momentum());
}

std::optional<MomentumDrift> MomentumDrift::of(const Model& model, const std::array<double, 3>& gravity, double time,
                                               std::span<const double> positions, const Momentum& first) {
  if (!floats(model.tree)) return std::nullopt;
  const MassDistribution masses = mass_distribution(model, positions);
  MomentumDrift drift;
  drift.gravity_ = gravity;
  drift.begin_ = time;
  drift.first_ = first;
  drift.mass_ = masses.mass;
  drift.polar_moment_ = masses.polar_moment;
  return drift;
}

void MomentumDrift::add(double time, const Momentum& now, const Energy& energy) {
  const Eigen::Vector3d field = vector_of(gravity_);
  const Eigen::Vector3d angular_change = vector_of(now.angular) - vector_of(first_.angular);
  const Eigen::Vector3d linear_change = vector_of(now.linear) - vector_of(first_.linear);
  linear_ = std::max(linear_, (linear_change - mass_ * (time - begin_) * field).norm());
  angular_ = std::max(angular_, gravity() ? std::abs(angular_change.dot(field.normalized())) : angular_change.norm());
  kinetic_ = std::max(kinetic_, energy.kinetic);
}

double MomentumDrift::linear() const { return relative(linear_, std::sqrt(2 * mass_ * kinetic_)); }

double MomentumDrift::angular() const { return relative(angular_, std::sqrt(2 * polar_moment_ * kinetic_)); }

}  // namespace linden
