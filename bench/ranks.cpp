// What ranks cost beside the steps: the figures of 10^6 instances, what is sent for them, and the master of a recording in thousands of parts.
//
//   build/release/bench/bench_ranks                      one process
//   mpirun -n 4 build/release/bench/bench_ranks          and between several, where linden is built with MPI
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <vector>

#include "engine/distributed/ranks.hpp"
#include "engine/files/h5_master.hpp"
#include "engine/files/rollout_file.hpp"
#include "engine/instance_record.hpp"
#include "engine/program/energy_change.hpp"
#include "layout/names.hpp"

namespace linden {
namespace {

using Clock = std::chrono::steady_clock;

/// Seconds of one of `repeats` calls, of the slowest rank.
double time_of(Ranks& ranks, int repeats, const std::function<void()>& work) {
  ranks.barrier();
  const Clock::time_point begin = Clock::now();
  for (int k = 0; k < repeats; ++k) work();
  double taken = std::chrono::duration<double>(Clock::now() - begin).count() / repeats;
  ranks.most({&taken, 1});
  return taken;
}

void row(const Ranks& ranks, const std::string& what, const std::string& value) {
  if (ranks.first()) fmt::print("{:<66} {}\n", what, value);
}

/// Energies whose changes are 0, 1, 2, ... thousandths of the kinetic energy, up and down by turns.
void measure_figures(Ranks& ranks, std::int64_t instances) {
  const InstanceRange own = share_of(instances, ranks.rank(), ranks.count());
  std::vector<double> first, last, kinetic;
  for (std::int64_t i = own.first; i < own.end(); ++i) {
    const double change = static_cast<double>(i) / 1024;
    first.push_back(0), last.push_back(i % 2 == 0 ? change : -change), kinetic.push_back(1);
  }
  EnergyChange found;
  const double taken = time_of(ranks, 5, [&] { found = energy_change(ranks, own, instances, first, last, kinetic); });
  const bool right = found.most == static_cast<double>(instances - 1) / 1024 && found.worst == instances - 1 &&
                     found.median == static_cast<double>(instances / 2) / 1024 && found.mean == -0.5 / 1024;
  if (!right) {
    fmt::print(stderr, "bench_ranks: the change of energy is wrong: mean {}, median {}, most {}\n", found.mean, found.median, found.most);
    std::exit(1);
  }
  row(ranks, fmt::format("figures of {} instances, once a rollout", instances), fmt::format("{:.2f} ms", 1e3 * taken));
  row(ranks, "  memory for them, of an instance", fmt::format("{} bytes", 5 * sizeof(double) + sizeof(InstanceRecord)));
}

void measure_messages(Ranks& ranks) {
  constexpr int kRepeats = 2000;
  std::vector<std::int64_t> numbers(256, 0);
  for (const std::size_t count : {3, 69, 256}) {
    row(ranks, fmt::format("sum of {} integers over {} ranks", count, ranks.count()),
        fmt::format("{:.2f} us", 1e6 * time_of(ranks, kRepeats, [&] { ranks.sum(std::span(numbers).first(count)); })));
  }
  const std::int64_t told[] = {0, 0, 0};
  row(ranks, "what is told at the end of a stretch, begun and ended", fmt::format("{:.2f} us", 1e6 * time_of(ranks, kRepeats, [&] {
                                                                                             ranks.begin_most(told);
                                                                                             (void)ranks.end_most();
                                                                                           })));
}

void measure_master(int count, std::int64_t instances, std::int64_t frames) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("linden_bench_ranks_{}", Destination::letters());
  std::filesystem::create_directory(folder);
  Names names;
  for (int k = 0; k < 41; ++k) names.position.push_back(fmt::format("joint{}", k));
  for (int k = 0; k < 40; ++k) names.velocity.push_back(fmt::format("joint{}", k));
  const std::string file = (folder / "run.h5").string();
  const Clock::time_point begin = Clock::now();
  std::vector<RecordingPart> parts;
  for (int rank = 0; rank < count; ++rank) {
    const InstanceRange share = share_of(instances, rank, count);
    parts.push_back({fmt::format("run.h5.01234567.parts/0.{}-of-{}.h5", rank, count), 0, frames, share.first, share.count});
  }
  H5Master master(file, std::move(parts));
  declare<double>(master, instances, {recorded_positions(names), recorded_velocities(names)}, {});
  master.commit([] {});
  const double taken = std::chrono::duration<double>(Clock::now() - begin).count();
  const auto bytes = static_cast<double>(std::filesystem::file_size(file));
  fmt::print("{:<66} {:.1f} ms, {:.1f} KiB: {:.0f} bytes of a part of an array\n", fmt::format("master of {} parts", count), 1e3 * taken,
             bytes / 1024, bytes / count / 4);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace linden

int main() {
  const std::unique_ptr<linden::Ranks> ranks = linden::ranks_of_program();
  linden::measure_figures(*ranks, 1'000'000);
  linden::measure_messages(*ranks);
  if (ranks->first()) {
    for (const int count : {100, 1000, 10'000}) linden::measure_master(count, 1'000'000, 1000);
  }
  ranks->barrier();
}
