#include "engine/distributed/mpi_ranks.hpp"

#include <mpi.h>
#include <sched.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>

namespace linden {
namespace {

int cores_of(const cpu_set_t& cores) { return CPU_COUNT(&cores); }

/// Errors of MPI end all ranks (MPI_ERRORS_ARE_FATAL, the default), so what its functions return is not looked at.
class MpiRanks final : public Ranks {
 public:
  MpiRanks() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);  // threads of a rank compute and leave MPI alone
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    look_at_machine();
  }
  ~MpiRanks() override { MPI_Finalize(); }

  int rank() const override { return rank_; }
  int count() const override { return count_; }
  int threads() const override { return threads_; }
  int neighbours() const override { return neighbours_; }
  void barrier() override { MPI_Barrier(MPI_COMM_WORLD); }
  void sum(std::span<std::int64_t> numbers) override { reduce(numbers, MPI_INT64_T, MPI_SUM); }
  void least(std::span<std::int64_t> numbers) override { reduce(numbers, MPI_INT64_T, MPI_MIN); }
  void most(std::span<std::int64_t> numbers) override { reduce(numbers, MPI_INT64_T, MPI_MAX); }
  void most(std::span<double> numbers) override { reduce(numbers, MPI_DOUBLE, MPI_MAX); }

  std::string broadcast(std::string bytes) override {
    int size = static_cast<int>(bytes.size());
    MPI_Bcast(&size, 1, MPI_INT, 0, MPI_COMM_WORLD);
    bytes.resize(static_cast<std::size_t>(size));
    MPI_Bcast(bytes.data(), size, MPI_CHAR, 0, MPI_COMM_WORLD);
    return bytes;
  }

  std::vector<std::string> gather(const std::string& bytes) override {
    const int size = static_cast<int>(bytes.size());
    std::vector<int> sizes(first() ? static_cast<std::size_t>(count_) : 0), places(sizes.size());
    MPI_Gather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, 0, MPI_COMM_WORLD);
    std::exclusive_scan(sizes.begin(), sizes.end(), places.begin(), 0);
    std::string all(static_cast<std::size_t>(std::accumulate(sizes.begin(), sizes.end(), 0)), '\0');
    MPI_Gatherv(bytes.data(), size, MPI_CHAR, all.data(), sizes.data(), places.data(), MPI_CHAR, 0, MPI_COMM_WORLD);
    std::vector<std::string> by_rank;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      by_rank.push_back(all.substr(static_cast<std::size_t>(places[k]), static_cast<std::size_t>(sizes[k])));
    }
    return by_rank;
  }

  void begin_most(std::span<const std::int64_t> numbers) override {
    begun_.assign(numbers.begin(), numbers.end());
    reduced_.resize(begun_.size());
    MPI_Iallreduce(begun_.data(), reduced_.data(), static_cast<int>(begun_.size()), MPI_INT64_T, MPI_MAX, MPI_COMM_WORLD, &request_);
  }
  std::vector<std::int64_t> end_most() override {
    MPI_Wait(&request_, MPI_STATUS_IGNORE);
    return reduced_;
  }

  void abort(int exit_code) override {
    MPI_Abort(MPI_COMM_WORLD, exit_code);
    std::_Exit(exit_code);  // it does not return
  }

 private:
  template <class Number>
  static void reduce(std::span<Number> numbers, MPI_Datatype type, MPI_Op operation) {
    MPI_Allreduce(MPI_IN_PLACE, numbers.data(), static_cast<int>(numbers.size()), type, operation, MPI_COMM_WORLD);
  }

  /// mpirun may give a rank cores of its own, or some to share, or all.
  void look_at_machine() {
    cpu_set_t own, all;
    CPU_ZERO(&own);
    sched_getaffinity(0, sizeof own, &own);
    MPI_Comm machine;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    MPI_Comm_size(machine, &neighbours_);
    MPI_Allreduce(&own, &all, static_cast<int>(sizeof own), MPI_BYTE, MPI_BOR, machine);
    MPI_Comm_free(&machine);
    threads_ = std::max(1, std::min(cores_of(own), cores_of(all) / neighbours_));
  }

  int rank_ = 0, count_ = 1, threads_ = 1, neighbours_ = 1;
  MPI_Request request_ = MPI_REQUEST_NULL;
  std::vector<std::int64_t> begun_, reduced_;
};

}  // namespace

bool has_mpi() { return true; }

std::string mpi_library() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING];
  int length = 0;
  MPI_Get_library_version(text, &length);
  const std::string whole(text, static_cast<std::size_t>(length));
  return whole.substr(0, whole.find_first_of(",\n"));
}

std::unique_ptr<Ranks> mpi_ranks() { return std::make_unique<MpiRanks>(); }

}  // namespace linden
