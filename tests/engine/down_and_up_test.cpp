// In which order a tree is gone over.
#include "engine/sweeps/down_and_up.hpp"

#include <oneapi/tbb/global_control.h>

#include <catch2/catch.hpp>
#include <memory>

#include "models/build/generators.hpp"

namespace linden::down_and_up_test {
namespace {

std::vector<Model> trees() {
  return {chain(10), balanced_tree(500), balanced_tree(9000), balanced_tree(6000, 7), chain(3000), random_tree({.bodies = 7000, .seed = 1}),
          humanoids(200)};
}

struct Sum {
  double value = 0;
  void add(const Sum& more) { value += more.value; }
};

/// What happened to a slot: 1 it was met on the way down, 2 on the way up as well.
class Visits {
 public:
  explicit Visits(const Tree& tree) : tree_(tree), met_(static_cast<std::size_t>(tree.shape.slots), 0) { met_[0] = 1; }
  void down(Slots part) {
    for (Index i = part.begin; i < part.end; ++i) {
      if (at(i) != 0 || at(tree_.parent(i)) != 1) wrong_ = true;
      at(i) = 1;
    }
  }
  void up(Slots part) {
    for (Index i = part.end - 1; i >= part.begin; --i) {
      if (at(i) != 1 || at(tree_.parent(i)) != 1) wrong_ = true;
      at(i) = 2;
    }
  }
  bool fine() const {
    return !wrong_ && std::all_of(met_.begin() + 1, met_.end(), [](int visits) { return visits == 2; });
  }

 private:
  int& at(Index i) { return met_[static_cast<std::size_t>(i)]; }

  const Tree& tree_;
  std::vector<int> met_;
  std::atomic<bool> wrong_ = false;
};

TEST_CASE("parents come before their children on the way down and after them on the way up, by however many threads") {
  const oneapi::tbb::global_control allowed(oneapi::tbb::global_control::max_allowed_parallelism, 5);
  for (const Model& model : trees()) {
    INFO(model.names.model);
    const Tree& tree = model.tree;
    DownAndUp<Sum> way(tree);
    for (const bool last_first : {false, true}) {
      std::vector<double> sums;
      for (const int threads : {1, 2, 5}) {
        oneapi::tbb::task_arena arena(threads);
        Visits visits(tree);
        arena.execute([&] {
          const auto add = [](Slots part, Sum& sum) {
            for (Index i = part.begin; i < part.end; ++i) sum.value += 1.0 / (i + 1);
          };
          const Sum sum = way.run(
              last_first, false,
              [&](Slots part, Sum& own) {
                visits.down(part);
                add(part, own);
              },
              [&](Slots part, Sum& own) {
                visits.up(part);
                add(part, own);
              });
          sums.push_back(sum.value);
        });
        CHECK(visits.fine());
      }
      CHECK((sums[1] == sums[0] && sums[2] == sums[0]));
      double expected = 0;
      for (Index i = 1; i < tree.shape.slots; ++i) expected += 2.0 / (i + 1);
      CHECK(sums[0] == Approx(expected).epsilon(1e-13));
    }
  }
}

TEST_CASE("branches that share rows lie behind the trunk, each thread's apart from the others'") {
  const Model model = balanced_tree(20'000);
  const Tree& tree = model.tree;
  REQUIRE(tree.most_threads() > 3);
  const oneapi::tbb::global_control allowed(oneapi::tbb::global_control::max_allowed_parallelism, 4);
  oneapi::tbb::task_arena arena(4);
  std::vector<std::atomic<int>> in_use(static_cast<std::size_t>(tree.shape.slots));
  std::atomic<bool> clash = false, outside = false;
  DownAndUp<Sum> way(tree);
  arena.execute([&] {
    const auto rows = [&](Slots part, const auto& action) {
      if (part.branch == 0) return;  // the trunk
      for (Index i = part.begin; i < part.end; ++i) {
        if (part.row(i) < tree.trunk.end || part.row(i) >= tree.shape.slots) outside = true;
        action(in_use[static_cast<std::size_t>(part.row(i))]);
      }
    };
    way.run(
        true, true, [&](Slots part, Sum&) { rows(part, [&](std::atomic<int>& users) { clash = clash || users++ != 0; }); },
        [&](Slots part, Sum&) { rows(part, [&](std::atomic<int>& users) { clash = clash || --users != 0; }); });
  });
  CHECK_FALSE(clash);
  CHECK_FALSE(outside);
}

}  // namespace
}  // namespace linden::down_and_up_test
