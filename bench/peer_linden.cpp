#include <fmt/format.h>

#include <stdexcept>

#include "bench/peer.hpp"
#include "engine/batch.hpp"
#include "engine/mass_distribution.hpp"

namespace linden {
namespace {

class AlonePeer : public Peer {
 public:
  AlonePeer(const Robot& robot, const Plan& plan, int order = 2) : simulation_(robot.model, options(plan, order)) {}

  double mass() const override { return mass_distribution(simulation_.model(), simulation_.positions()).mass; }
  Index degrees_of_freedom() const override { return simulation_.model().degrees_of_freedom(); }

  void reset(std::int64_t, const InitialState& start) override {
    simulation_.set_positions(start.positions);
    simulation_.set_velocities(start.velocities);
  }
  void step(int n) override {
    if (const StepsReport report = simulation_.run(n); !report.ok()) throw std::runtime_error(simulation_.describe(report.last));
  }

  std::vector<double> positions(std::int64_t) override {
    const auto rows = simulation_.positions();
    return {rows.begin(), rows.end()};
  }
  Energy energy(std::int64_t) override { return simulation_.energy(); }
  std::optional<Momentum> momentum(std::int64_t) override { return simulation_.momentum(); }

 private:
  static Options options(const Plan& plan, int order) {
    Options options{.step = plan.step, .gravity = {0, 0, -plan.gravity}};
    options.order = order;
    use_default_tolerance(options);
    return options;
  }

  Simulation simulation_;
};

template <class Real>
class BatchPeer : public Peer {
 public:
  BatchPeer(const Robot& robot, const Plan& plan) : batch_(robot.model, plan.instances, options(plan), {}, {.threads = plan.threads}) {}

  double mass() const override { return mass_distribution(batch_.model(), batch_.model().neutral()).mass; }
  Index degrees_of_freedom() const override { return batch_.model().degrees_of_freedom(); }

  void reset(std::int64_t i, const InitialState& start) override { batch_.reset(i, start.positions, start.velocities); }
  void step(int n) override {
    batch_.step(n);
    if (batch_.summary().frozen > 0) throw std::runtime_error("instances of the batch are frozen");
  }

  std::vector<double> positions(std::int64_t i) override {
    const auto rows = batch_.positions().instance(i);
    return {rows.begin(), rows.end()};
  }
  Energy energy(std::int64_t i) override {
    const auto seen = batch_.observe();
    return {.kinetic = seen.energies()(i, 0), .potential = seen.energies()(i, 1)};
  }

 private:
  static Options options(const Plan& plan) { return {.step = plan.step, .gravity = {0, 0, -plan.gravity}}; }

  BatchOf<Real> batch_;
};

template <class Held>
std::unique_ptr<Peer> make(const Robot& robot, const Plan& plan) {
  return std::make_unique<Held>(robot, plan);
}

}  // namespace

Contender linden_of_order(int order) {
  return {fmt::format("linden-order-{}", order), fmt::format("linden, Simulation, order {}", order), true, false, 1e-12,
          [order](const Robot& robot, const Plan& plan) { return std::make_unique<AlonePeer>(robot, plan, order); }};
}

std::vector<Contender> linden_contenders() {
  const std::string lanes(name(best_instructions()));
  return {{"linden", "linden, Simulation", true, false, 1e-7, make<AlonePeer>},
          {"linden-batch", "linden, Batch, " + lanes, false, true, 1e-7, make<BatchPeer<double>>},
          {"linden-float-batch", "linden, FloatBatch, " + lanes, false, true, 1e-5, make<BatchPeer<float>>}};
}

}  // namespace linden
