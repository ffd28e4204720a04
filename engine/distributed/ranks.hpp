// engine/distributed/ranks.hpp
// Processes that compute one rollout together, on one machine or on many: as mpirun starts them, or one alone.
//
//   std::unique_ptr<Ranks> ranks = ranks_of_program();
//   const InstanceRange own = share_of(instances, ranks->rank(), ranks->count());
//   ...                                                         each rank steps and records what is its own
//   ranks->sum(counts);                                         and what is told of all is reduced at the end
//
// Whatever is reduced has the same bits for any number of ranks: sums are of integers alone (a sum of real numbers is an ExactSum,
// engine/distributed/exact_sum.hpp, which is made of integers), and the least and the most of real numbers do not depend on their order.
//
// All functions that exchange something are called by every rank in the same order, from the thread that made the ranks. What a rank throws
// that the others do not would leave them waiting: work that may fail is done in together().
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/distributed/instance_range.hpp"

namespace linden {

class Ranks {
 public:
  Ranks() = default;
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  virtual int rank() const = 0;
  virtual int count() const = 0;
  /// Threads that this rank may use so that all ranks of its machine together use the cores that they have, each once.
  virtual int threads() const = 0;
  /// Ranks of this machine, this one included.
  virtual int neighbours() const = 0;
  bool first() const { return rank() == 0; }
  bool several() const { return count() > 1; }

  /// All have come to this place.
  virtual void barrier() = 0;
  /// Element by element over all ranks, known to all afterwards.
  virtual void sum(std::span<std::int64_t> numbers) = 0;
  virtual void least(std::span<std::int64_t> numbers) = 0;
  virtual void most(std::span<std::int64_t> numbers) = 0;
  /// No element is NaN.
  virtual void most(std::span<double> numbers) = 0;
  /// What rank 0 has, known to all afterwards.
  virtual std::string broadcast(std::string bytes) = 0;
  /// What each has, by rank: at rank 0, nothing elsewhere. Some kilobytes in all; results of instances go into files.
  virtual std::vector<std::string> gather(const std::string& bytes) = 0;

  /// The most of each number, begun here and known when end_most is called, so that none waits for the others in between. One at a time.
  virtual void begin_most(std::span<const std::int64_t> numbers) = 0;
  virtual std::vector<std::int64_t> end_most() = 0;

  /// Ends all ranks at once, where one failed that the others do not know of.
  [[noreturn]] virtual void abort(int exit_code) = 0;
  /// Whether what was thrown last is known to all.
  bool ending() const { return ending_; }

 private:
  friend void together(Ranks& ranks, const std::function<void()>& work);
  bool ending_ = false;
};

/// One that is the only one.
std::unique_ptr<Ranks> alone();
/// The number of this process among those that mpirun started, by what that says before any of them knows of the others; 0 where it is alone.
int told_rank();
/// Those that mpirun started, or one alone where it did not. Throws InputError where this process was started as one of several and does
/// not find the others: they would all do and write the same.
std::unique_ptr<Ranks> ranks_of_program();

/// Thrown at ranks that did not fail themselves, or are not the first that did: another one tells why.
struct ToldElsewhere {
  int exit_code;
};

/// The text of the lowest rank that has one that is not empty, known to all afterwards; empty where none has.
std::string first_text(Ranks& ranks, const std::string& own);

/// Exit code of an error (engine/program/main.cpp): 2 for bad input, else 1.
int exit_code_of(const std::exception& error);

/// Does `work` at every rank. Where it throws a std::exception at some, the first of them throws that (its message says which rank
/// it was, but for rank 0), and all others throw ToldElsewhere with the same exit code.
void together(Ranks& ranks, const std::function<void()>& work);

}  // namespace linden
