// What a factor of loops takes: as counted from paths, and as numbers count that are used up on the way.
#include <catch2/catch.hpp>

#include <cmath>

#include "engine/sweeps/closure_work.hpp"
#include "engine/sweeps/coupling_sweeps.hpp"
#include "engine/sweeps/tree_kernels.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/generators.hpp"
#include "tests/engine/mechanisms.hpp"

namespace linden::closure_work_test {
namespace {

/// A number that counts what is done with it.
struct Counted {
  static inline double operations = 0;
  double value = 0;

  Counted() = default;
  Counted(double number) : value(number) {}
  friend Counted operator+(const Counted& a, const Counted& b) { return counted(a.value + b.value); }
  friend Counted operator-(const Counted& a, const Counted& b) { return counted(a.value - b.value); }
  friend Counted operator*(const Counted& a, const Counted& b) { return counted(a.value * b.value); }
  friend Counted operator/(const Counted& a, const Counted& b) { return counted(a.value / b.value); }
  friend bool operator<(const Counted& a, const Counted& b) { return a.value < b.value; }
  friend Counted sqrt(const Counted& a) { return counted(std::sqrt(a.value)); }
  friend Counted abs(const Counted& a) { return std::abs(a.value); }
  friend Counted atan2(const Counted& a, const Counted& b) { return counted(std::atan2(a.value, b.value)); }
  friend Counted max(const Counted& a, const Counted& b) { return std::max(a.value, b.value); }

 private:
  static Counted counted(double number) {
    operations += 1;
    return number;
  }
};

template <class From, class To>
void copy(const From& from, To& to) {
  std::ranges::transform(from.flat(), to.flat().begin(), [](double number) { return Counted(number); });
}

/// Of a factor for velocities, in the zero configuration, of all closures.
double counted_operations(const Model& model) {
  Workspace<double> work;
  work.allocate(model.tree.shape);
  Field<double> q;
  q.allocate(model.tree.shape.positions);
  std::ranges::copy(model.neutral(), q.flat().begin());
  placement_map(model.tree, model.constants, q, all_slots(model.tree), work.placement);
  articulated_inertia_up(model.tree, model.constants, work.placement, all_slots(model.tree), work.articulated,
                         Gains<double>{work.gain_up, work.gain_down, work.joint_inverse}, NothingAdded{});
  Workspace<Counted> counted;
  counted.allocate(model.tree.shape);
  copy(work.placement, counted.placement);
  copy(work.gain_up, counted.gain_up);
  copy(work.gain_down, counted.gain_down);
  copy(work.joint_inverse, counted.joint_inverse);
  Field<Counted> counted_q;
  counted_q.allocate(model.tree.shape.positions);
  copy(q, counted_q);
  const Gains<Counted> gains{counted.gain_up, counted.gain_down, counted.joint_inverse};
  MimicTies<Counted> ties(model.mimics, model.tree);
  CouplingSweeps<Counted> couplings(model, {});
  couplings.place(counted.placement, counted_q);
  Counted::operations = 0;
  couplings.up_to_closures([](Slots) {}, [&](std::size_t closure) {
    couplings.close(closure, Coupled::velocities, model.constants, counted.placement, nullptr, gains, ties, true);
  });
  return Counted::operations;
}

double all_of(const std::vector<ClosureWork>& closures) {
  double sum = 0;
  for (const ClosureWork& one : closures) sum += one.operations;
  return sum;
}

/// Two chains from the world, tied rung by rung: every loop closes there.
Model two_branches(int cells) {
  TreeBuilder builder("two branches");
  std::vector<CouplingSpec> rungs;
  for (const std::string side : {"left", "right"}) {
    for (int k = 0; k < cells; ++k) {
      const double x = side == "left" ? 0 : 1;
      const Eigen::Vector3d from(x, 0, k), to(x, 0, k + 1);
      builder.add(bar(side + std::to_string(k), k == 0 ? "" : side + std::to_string(k - 1), k == 0 ? from : Eigen::Vector3d(0, 0, 1), to - from));
    }
  }
  for (int k = 0; k < cells; ++k) {
    const std::string number = std::to_string(k);
    rungs.push_back({.name = "rung" + number, .kind = CouplingKind::rod, .link_a = "left" + number, .link_b = "right" + number});
  }
  return coupled(builder.build(), rungs);
}

}  // namespace

TEST_CASE("The operations that are told of a factor are those that it takes") {
  const std::pair<const char*, Model> models[] = {
      {"ring", hanging_ring(30)}, {"four-bars", four_bars(4)}, {"ladder", ladder(10)}, {"net", rope_net(4, 5)}, {"two branches", two_branches(8)}};
  for (const auto& [name, model] : models) {
    CAPTURE(name);
    const double told = all_of(closure_work(model)), taken = counted_operations(model);
    CHECK(told == Approx(taken).epsilon(0.15));
  }
}

TEST_CASE("Where loops are cut decides what they take: a ladder on one trunk is linear in its cells, on two branches cubic") {
  const std::vector<ClosureWork> trunk = closure_work(ladder(40)), longer = closure_work(ladder(80));
  CHECK(trunk.size() == 40);
  CHECK(all_of(longer) == Approx(2 * all_of(trunk)).epsilon(0.05));
  CHECK(all_of(longer) < 3 * kTreeFactorOperations * ladder(80).tree.bodies());
  const std::vector<ClosureWork> branches = closure_work(two_branches(40)), more = closure_work(two_branches(80));
  REQUIRE(branches.size() == 1);
  CHECK(branches[0].slot == 0);
  CHECK(branches[0].rows == 40);
  CHECK(branches[0].couplings.size() == 40);
  CHECK(branches[0].velocities == 40 * 41);
  CHECK(all_of(more) > 5 * all_of(branches));
}

TEST_CASE("Closures are told the dearest first") {
  const std::vector<ClosureWork> all = closure_work(rope_net(4, 5));
  CHECK(std::ranges::is_sorted(all, std::ranges::greater(), &ClosureWork::operations));
}

}  // namespace linden::closure_work_test
