#include "engine/threads.hpp"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <pthread.h>

#include <latch>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

namespace linden {
namespace {

void* wait_for(void* gate) {
  static_cast<std::latch*>(gate)->wait();
  return nullptr;
}

/// Starts so many threads at once and ends them. Returns how many of them there were, and the errno of the next.
std::pair<int, int> try_threads(int count) {
  pthread_attr_t like_those{};
  ::pthread_attr_init(&like_those);
  ::pthread_attr_setstacksize(&like_those, oneapi::tbb::global_control::active_value(oneapi::tbb::global_control::thread_stack_size));
  std::latch gate(1);
  std::vector<pthread_t> started;
  started.reserve(static_cast<std::size_t>(count));
  int error = 0;
  while (error == 0 && static_cast<int>(started.size()) < count) {
    pthread_t thread{};
    error = ::pthread_create(&thread, &like_those, wait_for, &gate);
    if (error == 0) started.push_back(thread);
  }
  gate.count_down();
  for (const pthread_t thread : started) ::pthread_join(thread, nullptr);
  ::pthread_attr_destroy(&like_those);
  return {static_cast<int>(started.size()), error};
}

/// oneTBB starts no more threads than the machine has cores unless it is allowed to; of several allowances the least counts, so there is one.
void allow_threads(int threads) {
  using oneapi::tbb::global_control;
  static std::unique_ptr<global_control> allowance;
  const auto count = static_cast<std::size_t>(threads);
  if (count <= global_control::active_value(global_control::max_allowed_parallelism)) return;
  allowance.reset();
  allowance = std::make_unique<global_control>(global_control::max_allowed_parallelism, count);
}

}  // namespace

void require_threads(int threads) {
  static std::mutex trying;
  static int known = 1;
  const std::lock_guard<std::mutex> alone(trying);
  if (threads <= known) return;
  const auto [more, error] = try_threads(threads - 1);  // beside this one
  if (error != 0) {
    throw std::runtime_error(fmt::format("{} threads were to work and only {} can be started: {}; ask for fewer (--threads, a task arena), or "
                                         "allow more (ulimit -u, ulimit -v)",
                                         threads, more + 1, std::generic_category().message(error)));
  }
  allow_threads(threads);
  known = threads;
}

int threads_here() { return oneapi::tbb::this_task_arena::max_concurrency(); }

}  // namespace linden
