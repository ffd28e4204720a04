// engine/drift.hpp
// What a run should have kept and how far it strayed: energy, and momentum where nothing outside takes or gives any.
//
//   band     max H - min H
//   slope    of the line through H(t) by least squares, with its standard error
//   scale    the largest kinetic energy met: what energy there was to exchange. H itself has no zero.
//
// Neighbouring samples go up and down together, so the error of the slope comes from the means of 20 equal stretches of the run,
// widened by sqrt((1 + c) / (1 - c)) where neighbouring stretches still have a correlation c: a slope within two or three errors of
// zero is no drift that one can see.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/simulation.hpp"

namespace linden {

/// Steps from one sample of the energy to the next in a run of so many: every step of one that is no longer than 20,000. Whoever tells an energy
/// band looks as often, since one that is looked at seldom is narrower.
std::int64_t energy_stride(std::int64_t steps);

/// What is said of a run without any motion.
inline constexpr const char* kNothingMoves = "none: nothing moves at the start, and no force sets anything moving";

/// Whether that much kinetic energy is more than rounding makes of rest: more than the whole mass has at 1e-12 m/s.
bool is_motion(const Model& model, double kinetic);

/// Least squares through (x, y), one point after another.
class LineFit {
 public:
  void add(double x, double y);
  std::int64_t points() const { return points_; }
  double mean_x() const { return mean_x_; }
  double mean_y() const { return mean_y_; }
  /// NaN below two points.
  double slope() const;
  /// NaN below three points.
  double slope_error() const;

 private:
  std::int64_t points_ = 0;
  double mean_x_ = 0, mean_y_ = 0, xx_ = 0, xy_ = 0, yy_ = 0;
};

class EnergyDrift {
 public:
  /// `samples`: how many are expected.
  explicit EnergyDrift(std::int64_t samples = 1) : samples_expected_(samples) {}

  /// Energy, and what effects took and gave since the first sample: H plus the one less the other is what stays.
  void add(double time, const Energy& energy, double taken = 0, double given = 0);

  std::int64_t samples() const { return samples_; }
  double initial() const { return initial_; }         // H at the first sample [J]
  double band() const { return highest_ - lowest_; }  // [J]
  double slope() const { return line_.slope(); }      // [J/s]
  double slope_error() const;                         // [J/s]; NaN where the run is too short to tell
  double scale() const { return scale_; }             // [J]
  /// Energy that went to and fro: the largest of kinetic energy, change of potential energy, what effects took, what they gave. Not zero
  /// where things are held or come to rest [J].
  double exchanged() const { return exchanged_; }
  /// The largest sum of the account's parts: what rounding is relative to [J].
  double magnitude() const { return magnitude_; }
  /// How much of the band there was already between the first two samples [J].
  double first_change() const { return first_change_; }

 private:
  static constexpr int kStretches = 20;

  std::int64_t samples_expected_, samples_ = 0;
  double begin_ = 0, initial_ = 0, lowest_ = 0, highest_ = 0, scale_ = 0;
  double exchanged_ = 0, magnitude_ = 0, first_potential_ = 0, first_change_ = 0;
  LineFit line_;
  std::array<LineFit, kStretches> stretches_;
};

/// For systems that nothing ties to the world. Without gravity all six numbers are kept. With gravity P - m g t is, and of the angular
/// momentum the component along gravity; neither is relative to a place.
class MomentumDrift {
 public:
  /// Nothing where something outside takes momentum.
  static std::optional<MomentumDrift> of(Simulation& simulation);
  /// The same of whoever moves the model: `first` is its momentum at `positions` and `time`.
  static std::optional<MomentumDrift> of(const Model& model, const std::array<double, 3>& gravity, double time,
                                         std::span<const double> positions, const Momentum& first);

  void add(Simulation& simulation, const Energy& energy) { add(simulation.time(), simulation.momentum(), energy); }
  void add(double time, const Momentum& now, const Energy& energy);

  bool gravity() const { return gravity_ != std::array<double, 3>{0, 0, 0}; }
  /// Largest drift so far, relative to the largest momentum that the kinetic energy allows: |P| <= sqrt(2 m T),
  /// |L| <= sqrt(2 J T), J the polar moment about the world's origin at the start.
  double linear() const;
  double angular() const;

 private:
  MomentumDrift() = default;

  std::array<double, 3> gravity_{};
  double mass_ = 0, polar_moment_ = 0, begin_ = 0, kinetic_ = 0;
  double linear_ = 0, angular_ = 0;  // largest drift [kg m/s], [kg m^2/s]
  Momentum first_;
};

}  // namespace linden
