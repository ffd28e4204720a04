// What several processes exchange: shares of instances, sums with equal bits, and errors that all end with.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "engine/distributed/exact_sum.hpp"
#include "engine/distributed/order_statistic.hpp"
#include "engine/distributed/stretches.hpp"
#include "engine/program/energy_change.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/turns.hpp"

namespace linden::ranks_test {
namespace {

TEST_CASE("every instance belongs to one rank, neighbours lie together and no rank has two more than another") {
  for (const std::int64_t instances : {1, 2, 7, 64, 1000, 1001}) {
    for (const int ranks : {1, 2, 3, 4, 7, 64, 2000}) {
      std::int64_t next = 0;
      for (int rank = 0; rank < ranks; ++rank) {
        const InstanceRange share = share_of(instances, rank, ranks);
        CHECK(share.first == next);
        CHECK(share.count >= instances / ranks);
        CHECK(share.count <= instances / ranks + 1);
        next = share.end();
      }
      CHECK(next == instances);
    }
  }
  constexpr std::int64_t kMany = 1'000'000'000'000;
  CHECK(share_of(kMany, 9999, 10'000) == InstanceRange{kMany - kMany / 10'000, kMany / 10'000});
}

double sum_of(const std::vector<double>& numbers) {
  ExactSum sum;
  for (const double number : numbers) sum.add(number);
  return sum.value();
}

TEST_CASE("a sum is the double nearest to the true one") {
  constexpr double kTiny = std::numeric_limits<double>::denorm_min(), kHuge = std::numeric_limits<double>::max();
  CHECK(sum_of({}) == 0);
  CHECK(sum_of({1, 1e100, 1, -1e100}) == 2);
  CHECK(sum_of({1e16, 1, 1}) == 1e16 + 2);
  CHECK(sum_of({1, std::ldexp(1, -53)}) == 1);                                 // halfway, to even
  CHECK(sum_of({1, std::ldexp(1, -53), kTiny}) == 1 + std::ldexp(1, -52));     // just above
  CHECK(sum_of({1, std::ldexp(3, -53)}) == 1 + std::ldexp(1, -51));            // halfway, to even
  CHECK(sum_of({-1, -std::ldexp(1, -53), -kTiny}) == -1 - std::ldexp(1, -52));
  CHECK(sum_of({kTiny, kTiny, kTiny}) == 3 * kTiny);
  CHECK(sum_of({-kTiny}) == -kTiny);
  CHECK(sum_of({kHuge, kHuge, -kHuge}) == kHuge);
  CHECK(sum_of({kHuge, kHuge}) == std::numeric_limits<double>::infinity());
  CHECK(std::isnan(sum_of({1, std::numeric_limits<double>::infinity()})));
  std::vector<double> ones(1000, 0.1);
  CHECK(sum_of(ones) == 100.00000000000000555);  // 1000 times the double next to 0.1, rounded once
  // what adds up to a double: a number, and what others leave of it
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto number = [&] { return std::ldexp(static_cast<double>(random() >> 11) - std::ldexp(1, 52), static_cast<int>(random() % 1900) - 1074); };
    const double a = number(), b = number(), both = a + b, lost = b - (both - a);
    CHECK(sum_of({a, b}) == both);
    if (std::abs(a) >= std::abs(b) && std::isfinite(both)) CHECK(sum_of({a, b, -both}) == lost);
  }
}

TEST_CASE("sums, least and most are the same for any number of ranks, and known to all of them") {
  std::mt19937_64 random(2);
  std::vector<double> numbers(1000);
  for (double& number : numbers) number = std::ldexp(static_cast<double>(random() >> 11) - std::ldexp(1, 52), static_cast<int>(random() % 60) - 30);
  const double whole = sum_of(numbers);
  for (const int count : {1, 2, 3, 7}) {
    for (const std::exception_ptr& thrown : at_ranks(count, [&](Ranks& ranks) {
           const InstanceRange own = share_of(1000, ranks.rank(), ranks.count());
           ExactSum sum;
           for (std::int64_t i = own.first; i < own.end(); ++i) sum.add(numbers[static_cast<std::size_t>(i)]);
           ranks.sum(sum.limbs());
           if (sum.value() != whole) throw std::runtime_error("sum");
           if (first_text(ranks, ranks.rank() == count / 2 ? "middle" : "") != "middle") throw std::runtime_error("text");
         })) {
      CHECK_FALSE(thrown);
    }
  }
}

void check_none(const std::vector<std::exception_ptr>& thrown) {
  for (const std::exception_ptr& one : thrown) CHECK_FALSE(one);
}

void require(bool condition, const char* what) {
  if (!condition) throw std::runtime_error(what);
}

TEST_CASE("mean, median, most and the first instance with it are those of sorted numbers, for any number of ranks") {
  std::mt19937_64 random(3);
  for (const std::int64_t instances : {1, 2, 7, 200}) {
    std::vector<double> last, sizes, zeros(static_cast<std::size_t>(instances)), ones(static_cast<std::size_t>(instances), 1);
    for (std::int64_t i = 0; i < instances; ++i) {
      last.push_back(std::ldexp(static_cast<double>(random() % 9) - 4, static_cast<int>(random() % 3)));
      sizes.push_back(std::abs(last.back()));
    }
    const auto most = std::ranges::max_element(sizes);
    const std::int64_t worst = *most > 0 ? most - sizes.begin() : 0;
    const double top = *most;
    std::vector<double> sorted = sizes;
    std::ranges::sort(sorted);
    for (const int count : {1, 2, 5}) {
      if (count > instances) continue;
      check_none(at_ranks(count, [&](Ranks& ranks) {
        const InstanceRange own = share_of(instances, ranks.rank(), ranks.count());
        const auto part = [&](const std::vector<double>& all) {
          return std::span(all).subspan(static_cast<std::size_t>(own.first), static_cast<std::size_t>(own.count));
        };
        const EnergyChange found = energy_change(ranks, own, instances, part(zeros), part(last), part(ones));
        require(found.mean == sum_of(last) / static_cast<double>(instances), "mean");
        require(found.median == sorted[static_cast<std::size_t>(instances / 2)], "median");
        require(found.most == top && found.worst == worst, "most");
        for (std::int64_t n = 0; n < instances; ++n) {
          require(nth_smallest(ranks, part(sizes), n) == sorted[static_cast<std::size_t>(n)], "n-th");
        }
      }));
    }
  }
}

TEST_CASE("ranks of different speed go through the same stretches, and end after the same step where one has a signal or has failed") {
  for (const int count : {1, 2, 3}) {
    for (const int kind : {0, 1, 2}) {  // to the end, a signal, a failure
      std::vector<std::vector<std::int64_t>> ends(static_cast<std::size_t>(count));
      check_none(at_ranks(count, [&](Ranks& ranks) {
        Stretches stretches(ranks, 1000);
        bool more = true;
        while (more) {
          ends[static_cast<std::size_t>(ranks.rank())].push_back(stretches.end());
          const bool now = ranks.rank() == count - 1 && stretches.end() > 100;
          more = stretches.next(0.002 * (1 + ranks.rank()), kind == 1 && now ? 15 : 0, kind == 2 && now);
        }
        require(stretches.signal() == (kind == 1 ? 15 : 0), "signal");
        require(stretches.failed() == (kind == 2), "failed");
      }));
      for (const std::vector<std::int64_t>& of_rank : ends) CHECK(of_rank == ends.front());
      CHECK(std::ranges::is_sorted(ends.front()));
      CHECK((kind == 0 ? ends.front().back() == 1000 : ends.front().back() < 1000));
    }
  }
}

TEST_CASE("work that fails at some ranks ends at all with one message and one exit code") {
  const auto codes_and_messages = [](int count, const std::function<void(int)>& work) {
    std::vector<std::pair<int, std::string>> found;
    for (const std::exception_ptr& thrown : at_ranks(count, [&](Ranks& ranks) { together(ranks, [&] { work(ranks.rank()); }); })) {
      try {
        if (thrown) std::rethrow_exception(thrown);
        found.emplace_back(0, "");
      } catch (const ToldElsewhere& elsewhere) {
        found.emplace_back(elsewhere.exit_code, "");
      } catch (const std::exception& error) {
        found.emplace_back(exit_code_of(error), error.what());
      }
    }
    return found;
  };
  using Found = std::vector<std::pair<int, std::string>>;
  CHECK(codes_and_messages(3, [](int) {}) == Found(3, {0, ""}));
  CHECK(codes_and_messages(3, [](int) { throw InputError("bad"); }) == Found{{2, "bad"}, {2, ""}, {2, ""}});
  CHECK(codes_and_messages(1, [](int) { throw std::runtime_error("full"); }) == Found{{1, "full"}});
  CHECK(codes_and_messages(3, [](int rank) { if (rank == 0) throw InputError("seen by one"); }) == Found{{2, "seen by one"}, {2, ""}, {2, ""}});
  const Found some = codes_and_messages(4, [](int rank) {
    if (rank == 3) throw InputError("no file");
    if (rank == 2) throw std::runtime_error("full");
  });
  CHECK(some[2].first == 1);
  CHECK_THAT(some[2].second, Catch::Matchers::StartsWith("rank 2 of 4 on ") && Catch::Matchers::EndsWith(": full"));
  for (const std::size_t other : {0u, 1u, 3u}) CHECK(some[other] == std::pair<int, std::string>(1, ""));
}

}  // namespace
}  // namespace linden::ranks_test
