// Ranks within one process, for tests: a thread each, one of which runs at a time (HDF5 knows no threads), until it waits for the others.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "engine/distributed/ranks.hpp"

namespace linden {

/// What each has goes to all; who waits here lets another run.
class Turns {
 public:
  explicit Turns(int ranks) : given_(static_cast<std::size_t>(ranks)) {}

  std::vector<std::string> exchange(int rank, std::string bytes) {
    given_[static_cast<std::size_t>(rank)] = std::move(bytes);
    if (++arrived_ == given_.size()) {
      arrived_ = 0;
      taken_ = given_;
      ++rounds_;
      all_.notify_all();
    } else {
      std::unique_lock<std::mutex> lock(turn, std::adopt_lock);
      all_.wait(lock, [&, round = rounds_] { return rounds_ != round; });
      lock.release();
    }
    return taken_;
  }

  std::mutex turn;  // held by the one that runs

 private:
  std::condition_variable all_;
  std::vector<std::string> given_, taken_;
  std::size_t arrived_ = 0, rounds_ = 0;
};

class ThreadRanks final : public Ranks {
 public:
  ThreadRanks(Turns& turns, int rank, int count) : turns_(turns), rank_(rank), count_(count) {}

  int rank() const override { return rank_; }
  int count() const override { return count_; }
  int threads() const override { return 1; }
  int neighbours() const override { return count_; }
  void barrier() override { turns_.exchange(rank_, ""); }
  void sum(std::span<std::int64_t> numbers) override {
    fold(numbers, [](std::int64_t a, std::int64_t b) { return a + b; });
  }
  void least(std::span<std::int64_t> numbers) override {
    fold(numbers, [](std::int64_t a, std::int64_t b) { return std::min(a, b); });
  }
  void most(std::span<std::int64_t> numbers) override {
    fold(numbers, [](std::int64_t a, std::int64_t b) { return std::max(a, b); });
  }
  void most(std::span<double> numbers) override {
    fold(numbers, [](double a, double b) { return std::max(a, b); });
  }
  std::string broadcast(std::string bytes) override { return turns_.exchange(rank_, std::move(bytes)).front(); }
  std::vector<std::string> gather(const std::string& bytes) override {
    std::vector<std::string> all = turns_.exchange(rank_, bytes);
    return first() ? all : std::vector<std::string>();
  }
  void begin_most(std::span<const std::int64_t> numbers) override { begun_.assign(numbers.begin(), numbers.end()); }
  std::vector<std::int64_t> end_most() override {
    most(std::span<std::int64_t>(begun_));
    return begun_;
  }
  void abort(int exit_code) override { std::_Exit(exit_code); }

 private:
  template <class Number, class Operation>
  void fold(std::span<Number> numbers, Operation operation) {
    const std::size_t bytes = numbers.size_bytes();
    const std::vector<std::string> all = turns_.exchange(rank_, std::string(reinterpret_cast<const char*>(numbers.data()), bytes));
    std::vector<Number> other(numbers.size());
    for (std::size_t rank = 0; rank < all.size(); ++rank) {
      std::memcpy(other.data(), all[rank].data(), bytes);
      for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = rank == 0 ? other[k] : operation(numbers[k], other[k]);
    }
  }

  Turns& turns_;
  int rank_, count_;
  std::vector<std::int64_t> begun_;
};

/// Runs `work` at each of so many ranks. What it throws there, by rank.
inline std::vector<std::exception_ptr> at_ranks(int count, const std::function<void(Ranks&)>& work) {
  Turns turns(count);
  std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(count));
  std::vector<std::thread> threads;
  for (int rank = 0; rank < count; ++rank) {
    threads.emplace_back([&, rank] {
      const std::lock_guard<std::mutex> turn(turns.turn);
      ThreadRanks ranks(turns, rank, count);
      try {
        work(ranks);
      } catch (...) {
        thrown[static_cast<std::size_t>(rank)] = std::current_exception();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  return thrown;
}

}  // namespace linden
