#include "engine/program/accuracy_mover.hpp"

#include <fmt/format.h>

#include "engine/baseline/baseline.hpp"
#include "engine/batch.hpp"

namespace linden {
namespace {

using Kind = AccuracyMethod::Kind;

class ComposedMover final : public Mover {
 public:
  ComposedMover(const AccuracySetup& setup, const Options& options) : simulation_(setup.model, options, setup.effects) {
    if (!setup.start.positions.empty()) simulation_.set_positions(setup.start.positions);
    if (!setup.start.velocities.empty()) simulation_.set_velocities(setup.start.velocities);
  }
  bool step() override {
    const StepReport report = simulation_.step();
    evaluations_ += report.evaluations;
    split_ += report.substeps > 1 ? 1 : 0;
    if (!report.ok()) failure_ = simulation_.describe(report);
    return report.ok();
  }
  Energy energy() override { return simulation_.energy(); }
  std::optional<Momentum> momentum() override { return simulation_.momentum(); }
  double gone() override { return simulation_.effect_work().taken() - simulation_.effect_work().given(); }
  std::span<const double> positions() override { return simulation_.positions(); }
  std::int64_t evaluations() const override { return evaluations_; }
  std::int64_t split_steps() const override { return split_; }
  std::string failure() const override { return fmt::format("at {:.4g} s: {}", simulation_.time(), failure_); }

 private:
  Simulation simulation_;
  std::int64_t evaluations_ = 0, split_ = 0;
  std::string failure_;
};

class BaselineMover final : public Mover {
 public:
  BaselineMover(const AccuracySetup& setup, Scheme scheme, const Options& options)
      : baseline_(setup.model, scheme, options, setup.effects) {
    ComposedMover start(setup, options);  // says what the scene's start is where it leaves something out
    std::vector<double> v = setup.start.velocities;
    if (v.empty()) v.resize(static_cast<std::size_t>(setup.model->tree.shape.velocities));
    baseline_.set(start.positions(), v);
  }
  bool step() override { return baseline_.step(); }
  Energy energy() override { return baseline_.energy(); }
  std::optional<Momentum> momentum() override { return baseline_.momentum(); }
  std::span<const double> positions() override { return baseline_.positions(); }
  std::int64_t evaluations() const override { return baseline_.evaluations(); }
  std::string failure() const override { return fmt::format("at {:.4g} s: the result is not finite", baseline_.time()); }

 private:
  Baseline baseline_;
};

class SingleMover final : public Mover {
 public:
  SingleMover(const AccuracySetup& setup, const Options& options) : batch_(setup.model, 1, stepping(options), setup.effects, {.threads = 1}) {
    ComposedMover start(setup, options);
    std::vector<double> v = setup.start.velocities;
    if (v.empty()) v.resize(static_cast<std::size_t>(setup.model->tree.shape.velocities));
    batch_.reset(0, start.positions(), v);
    positions_.resize(start.positions().size());
  }
  bool step() override {
    batch_.step();
    return batch_.summary().frozen == 0;
  }
  Energy energy() override {
    const auto seen = batch_.observe();
    return {static_cast<double>(seen.energies()(0, 0)), static_cast<double>(seen.energies()(0, 1))};
  }
  std::optional<Momentum> momentum() override { return std::nullopt; }
  std::span<const double> positions() override {
    const auto found = batch_.positions();
    for (std::size_t row = 0; row < positions_.size(); ++row) positions_[row] = static_cast<double>(found(0, static_cast<Index>(row)));
    return positions_;
  }
  std::int64_t evaluations() const override { return batch_.summary().evaluations; }
  std::string failure() const override { return batch_.describe(0); }

 private:
  static Options stepping(const Options& options) { return {.step = options.step, .gravity = options.gravity}; }
  FloatBatch batch_;
  std::vector<double> positions_;
};

}  // namespace

std::unique_ptr<Mover> mover_of(const AccuracySetup& setup, const AccuracyMethod& method, double step, double tolerance) {
  Options options = setup.options;
  options.step = step;
  options.order = method.kind == Kind::composed ? method.order : 2;
  if (tolerance > 0) {
    options.tolerance = tolerance;
    options.reduction = 0;
  } else {
    use_default_tolerance(options);
  }
  switch (method.kind) {
    case Kind::rk4: return std::make_unique<BaselineMover>(setup, Scheme::rk4, options);
    case Kind::semi_implicit_euler: return std::make_unique<BaselineMover>(setup, Scheme::semi_implicit_euler, options);
    case Kind::single: return std::make_unique<SingleMover>(setup, options);
    default: return std::make_unique<ComposedMover>(setup, options);
  }
}

}  // namespace linden
