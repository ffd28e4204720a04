// One block of instances of one tree, each hard in its own way.
#include <cmath>
#include <cstring>

#include "engine/batch.hpp"
#include "models/build/random.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

constexpr Index kLinks = 10;

/// Masses of the links of one instance, and how it starts.
struct Hard {
  const char* what;
  std::function<double(Index link)> mass;
  double spread;  // of the start
  double speed;   // of the last joint, on top [rad/s]
};

const std::vector<Hard>& instances() {
  static const std::vector<Hard> list{
      {"plain", [](Index) { return 1.0; }, 0.3, 0},
      {"light tip", [](Index i) { return std::pow(10.0, -i); }, 0.1, 0},
      {"heavy tip", [](Index i) { return std::pow(10.0, 0.5 * i); }, 0.1, 0},
      {"grams and tonnes in turn", [](Index i) { return i % 2 == 0 ? 1e-3 : 1e3; }, 0.2, 0},
      {"as light as dust", [](Index) { return 1e-9; }, 0.3, 0},
      {"as heavy as a crane", [](Index) { return 1e6; }, 0.3, 0},
      {"last joint at 500 rad/s", [](Index) { return 1.0; }, 0.1, 500},
      {"last joint at 1e7 rad/s: fails", [](Index) { return 1.0; }, 0.1, 1e7},
      {"at rest", [](Index) { return 1.0; }, 0, 0},
      {"wild", [](Index) { return 1.0; }, 2, 0},
  };
  return list;
}

/// Bytes of the state and record of every given instance after `steps`, in the order given.
struct Rolled {
  std::vector<std::string> ends;
  std::vector<std::string> failures;
  int lanes = 0;
};

Rolled roll(const std::vector<std::size_t>& order, int threads, std::int64_t steps, std::int64_t part) {
  const auto model = std::make_shared<const Model>(hinged_chain("block", kLinks, 0.1, [](Index) { return rod(1, 0.1); }));
  Batch batch(model, static_cast<std::int64_t>(order.size()), {.step = 1e-3}, {}, {.threads = threads});
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto at = static_cast<std::int64_t>(i);
    const Hard& hard = instances()[order[i]];
    for (Index link = 0; link < kLinks; ++link) {
      std::array<double, 10> inertia = batch.inertia(at, link + 1);
      for (double& number : inertia) number *= hard.mass(link);
      batch.set_inertia(at, link + 1, inertia);
    }
    InitialState start = random_state(*model, 7, hard.spread);
    start.velocities.back() += hard.speed;
    batch.reset(at, start.positions, start.velocities);
  }
  for (std::int64_t done = 0; done < steps; done += part) batch.step(std::min(part, steps - done));
  Rolled rolled;
  rolled.lanes = batch.lanes();
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto at = static_cast<std::int64_t>(i);
    const Eigen::VectorXd q = batch.positions().instance(at), p = batch.momenta().instance(at);
    std::string bytes(static_cast<std::size_t>(q.size() + p.size()) * sizeof(double), '\0');
    std::memcpy(bytes.data(), q.data(), static_cast<std::size_t>(q.size()) * sizeof(double));
    std::memcpy(bytes.data() + static_cast<std::size_t>(q.size()) * sizeof(double), p.data(),
                static_cast<std::size_t>(p.size()) * sizeof(double));
    rolled.ends.push_back(bytes);
    rolled.failures.push_back(batch.describe(at));
  }
  return rolled;
}

void one_block(Report& report) {
  const auto steps = report.pick<std::int64_t>(100, 1000, 5000);
  std::vector<std::size_t> all(instances().size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  const Rolled whole = roll(all, 1, steps, steps);
  // each alone; all in other orders, among copies of the one that fails; in parts and on two threads
  int disturbed = 0, compared = 0;
  const auto compare = [&](const std::vector<std::size_t>& order, const Rolled& other) {
    for (std::size_t i = 0; i < order.size(); ++i) {
      compared += 1;
      disturbed += other.ends[i] != whole.ends[order[i]] || other.failures[i] != whole.failures[order[i]];
    }
  };
  for (const std::size_t i : all) compare({i}, roll({i}, 1, steps, steps));
  Random random(3);
  for (int round = 0; round < 4; ++round) {
    std::vector<std::size_t> order;
    for (int k = 0; k < 23; ++k) order.push_back(random.below(3) == 0 ? 7 : random.below(all.size()));
    compare(order, roll(order, 1 + round % 2, steps, round < 2 ? steps : 17));
  }
  report.at_most("instances whose bits depend on company, threads or calls", disturbed, 0,
                 "a lane knows nothing of its neighbours");
  const bool one_failed = !whole.failures[7].empty();
  report.at_least("the instance that cannot be stepped is frozen and named", one_failed ? 1 : 0, 1,
                  "10,000 rad a step have no solution, even split");
  int others = 0;
  for (const std::size_t i : all) others += i != 7 && !whole.failures[i].empty();
  for (const std::size_t i : all) {
    if (!whole.failures[i].empty()) report.note(fmt::format("{}: {}", instances()[i].what, whole.failures[i]));
  }
  report.note(fmt::format("{} comparisons, blocks of {} lanes, {} other instances refused", compared, whole.lanes, others));
}

}  // namespace

std::vector<Case> batch_cases() {
  return {{"one-block", "instances from dust to cranes, slow and whirling, one of them impossible, in one block of lanes",
           one_block, ""}};
}

}  // namespace linden
