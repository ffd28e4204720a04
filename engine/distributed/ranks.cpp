#include "engine/distributed/ranks.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <initializer_list>
#include <stdexcept>
#include <utility>

#include "engine/distributed/mpi_ranks.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/threads.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

class Alone final : public Ranks {
 public:
  int rank() const override { return 0; }
  int count() const override { return 1; }
  int threads() const override { return threads_here(); }
  int neighbours() const override { return 1; }
  void barrier() override {}
  void sum(std::span<std::int64_t>) override {}
  void least(std::span<std::int64_t>) override {}
  void most(std::span<std::int64_t>) override {}
  void most(std::span<double>) override {}
  std::string broadcast(std::string bytes) override { return bytes; }
  std::vector<std::string> gather(const std::string& bytes) override { return {bytes}; }
  void begin_most(std::span<const std::int64_t> numbers) override { begun_.assign(numbers.begin(), numbers.end()); }
  std::vector<std::int64_t> end_most() override { return std::move(begun_); }
  void abort(int exit_code) override { std::_Exit(exit_code); }

 private:
  std::vector<std::int64_t> begun_;
};

/// The first of these variables that there is, as a number; -1 without any.
int number_in_environment(std::initializer_list<const char*> variables) {
  for (const char* variable : variables) {
    if (const char* text = std::getenv(variable)) return std::atoi(text);
  }
  return -1;
}

std::string host() {
  char name[256] = "?";
  ::gethostname(name, sizeof name - 1);
  return name;
}

}  // namespace

std::unique_ptr<Ranks> alone() { return std::make_unique<Alone>(); }

int told_rank() { return std::max(0, number_in_environment({"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "SLURM_PROCID"})); }

std::unique_ptr<Ranks> ranks_of_program() {
  // as Open MPI, MPICH and its kin, and Slurm tell those they start
  const int rank = number_in_environment({"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK"});
  const int told = number_in_environment({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"});
  std::unique_ptr<Ranks> ranks = rank >= 0 && has_mpi() ? mpi_ranks() : alone();
  if (told <= 1 || ranks->count() == told) return ranks;
  if (told_rank() > 0) throw ToldElsewhere{2};
  throw InputError(fmt::format(
      "this is one of {} processes that were started together, and {}; expected all of them, or each would do the same; {}", told,
      has_mpi() ? fmt::format("its MPI ({}) finds {}", mpi_library(), ranks->count()) : "linden was built without MPI",
      has_mpi() ? "start it with the mpirun of that MPI" : "build it with -DLINDEN_MPI=ON (engine/distributed/README.md)"));
}

std::string first_text(Ranks& ranks, const std::string& own) {
  std::int64_t told = own.empty() ? 0 : 1;
  ranks.most({&told, 1});
  if (told == 0) return "";
  for (std::string& text : ranks.gather(own)) {
    if (!text.empty()) return ranks.broadcast(std::move(text));
  }
  return ranks.broadcast("");  // which takes what rank 0 has
}

int exit_code_of(const std::exception& error) {
  return dynamic_cast<const InputError*>(&error) != nullptr && dynamic_cast<const MemoryError*>(&error) == nullptr ? 2 : 1;
}

void together(Ranks& ranks, const std::function<void()>& work) {
  if (!ranks.several()) return work();
  std::exception_ptr failure;
  std::string message;
  std::int64_t first = ranks.count();
  int exit_code = 0;
  try {
    work();
  } catch (const std::exception& error) {
    failure = std::current_exception();
    message = error.what();
    first = ranks.rank(), exit_code = exit_code_of(error);
  }
  constexpr std::int64_t kCodes = 256;
  std::int64_t told = first * kCodes + exit_code;
  ranks.least({&told, 1});
  if (told == ranks.count() * kCodes) return;
  ranks.ending_ = true;
  exit_code = static_cast<int>(told % kCodes);
  if (told / kCodes != ranks.rank()) throw ToldElsewhere{exit_code};
  if (ranks.first()) std::rethrow_exception(failure);
  message = fmt::format("rank {} of {} on {}: {}", ranks.rank(), ranks.count(), host(), message);
  if (exit_code == 2) throw InputError(message);
  throw std::runtime_error(message);
}

}  // namespace linden
