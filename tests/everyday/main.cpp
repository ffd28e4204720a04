// tests/everyday/main.cpp
// The program `linden_everyday`: tries random everyday scenes and says what differs from what they must give.
//
//   exit codes  0 nothing differs, 1 something does, 2 bad input
#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <mutex>

#include "check.hpp"
#include "engine/program/progress.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

struct Asked {
  std::uint64_t scenes = 2000, seed = 1, first = 1;
  int threads = 0;
  std::optional<Check> only;
  bool verbose = false, touching = false;
};

Asked asked(int argc, char** argv, bool& help) {
  CLI::App program("Tries random everyday scenes against a plain simulator and against what must hold for any of them.", "linden_everyday");
  Asked result;
  std::string only;
  program.add_option("--scenes", result.scenes, "How many (2000); each takes some 0.4 s of a core");
  program.add_option("--seed", result.seed, "All scenes follow from it (1)");
  program.add_option("--first", result.first, "Number of the first scene (1)");
  program.add_option("--threads", result.threads, "0: all that the machine has (0)");
  program.add_option("--only", only, "One check: refused, position, energy, rest, velocity, bits, observations, contact or blow");
  program.add_flag("--touching", result.touching, "Only scenes in which bodies touch each other: one in six of the numbers");
  program.add_flag("--verbose", result.verbose, "Tell every scene, also where nothing differs");
  try {
    program.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    fmt::print("{}", program.help());
    help = true;
    return result;
  } catch (const CLI::ParseError& error) {
    throw InputError(fmt::format("{}; linden_everyday --help says more", error.what()));
  }
  if (!only.empty()) {
    const auto found = std::ranges::find(kChecks, only, [](Check check) { return name(check); });
    if (found == kChecks.end()) {
      throw InputError(
          fmt::format("--only {}: no such check; expected refused, position, energy, rest, velocity, bits, observations, contact or blow", quoted(only)));
    }
    result.only = *found;
  }
  if (result.threads < 0) throw InputError(fmt::format("--threads {}: expected 0 or more", result.threads));
  return result;
}

std::string text_of(const EverydayScene& scene, const std::vector<Difference>& list, bool verbose) {
  std::string text;
  for (const Difference& one : list) {
    text += fmt::format("scene {} {}: {} [{}]; alone: --seed {} --first {} --scenes 1 --only {}\n", scene.number, name(one.check), one.text,
                        scene.text(), scene.seed, scene.number, name(one.check));
  }
  if (list.empty() && verbose) text = fmt::format("scene {}: nothing differs [{}]\n", scene.number, scene.text());
  return text;
}

/// Says what differs in the order of the scenes, however many threads try them.
class Teller {
 public:
  Teller(const Asked& what, std::uint64_t scenes)
      : what_(what), lines_(scenes), ready_(scenes, 0), progress_(static_cast<std::int64_t>(scenes), 1, "scenes") {}

  void tell(std::uint64_t at, const EverydayScene& scene, const std::vector<Difference>& list) {
    const std::string text = text_of(scene, list, what_.verbose);
    const std::lock_guard lock(mutex_);
    differing_ += list.empty() ? 0 : 1;
    for (const Difference& one : list) ++counts_[{one.check, one.what}];
    tell(at, text);
  }
  /// It was not asked for.
  void pass(std::uint64_t at) {
    const std::lock_guard lock(mutex_);
    tell(at, "");
  }

  std::uint64_t finish() {
    progress_.erase();
    for (const auto& [kind, count] : counts_) fmt::print("{:<10} {:<40} {:>8}\n", name(kind.first), kind.second, count);
    return differing_;
  }

 private:
  void tell(std::uint64_t at, const std::string& text) {
    lines_[at] = text;
    ready_[at] = 1;
    if (next_ < ready_.size() && ready_[next_] != 0) progress_.erase();
    for (; next_ < ready_.size() && ready_[next_] != 0; ++next_) {
      fmt::print("{}", lines_[next_]);
      lines_[next_].clear();
    }
    std::fflush(stdout);
    progress_.update(static_cast<std::int64_t>(++done_), Progress::Clock::now());
  }

  const Asked& what_;
  std::vector<std::string> lines_;
  std::vector<char> ready_;
  Progress progress_;
  std::mutex mutex_;
  std::map<std::pair<Check, std::string>, std::uint64_t> counts_;
  std::uint64_t next_ = 0, done_ = 0, differing_ = 0;
};

std::vector<Difference> tried(const EverydayScene& scene, std::optional<Check> only) {
  try {
    return differences(scene, only);
  } catch (const std::exception& error) {
    return {{Check::refused, "exception", fmt::format("an exception: {}; expected none", printable(error.what()))}};
  }
}

int run_everyday(int argc, char** argv) {
  bool help = false;
  const Asked what = asked(argc, argv, help);
  if (help) return 0;
  const auto begin = Progress::Clock::now();
  Teller teller(what, what.scenes);
  oneapi::tbb::task_arena arena(what.threads > 0 ? what.threads : oneapi::tbb::task_arena::automatic);
  arena.execute([&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<std::uint64_t>(0, what.scenes, 1),
        [&](const oneapi::tbb::blocked_range<std::uint64_t>& range) {
          for (std::uint64_t at = range.begin(); at < range.end(); ++at) {
            // a wait within must not take up another scene
            oneapi::tbb::this_task_arena::isolate([&] {
              if (what.touching && !touches(what.first + at)) return teller.pass(at);
              const EverydayScene scene = everyday_scene(what.seed, what.first + at);
              teller.tell(at, scene, tried(scene, what.only));
            });
          }
        },
        oneapi::tbb::simple_partitioner());
  });
  const std::uint64_t differing = teller.finish();
  fmt::print("{} in {:.0f} s, {} differ\n", counted(static_cast<std::int64_t>(what.scenes), "scene"),
             seconds(Progress::Clock::now() - begin), differing);
  return differing == 0 ? 0 : 1;
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  try {
    return linden::run_everyday(argc, argv);
  } catch (const linden::InputError& error) {
    fmt::print(stderr, "linden_everyday: {}\n", linden::printable(error.what()));
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "linden_everyday: {}\n", linden::printable(error.what()));
    return 1;
  }
}
