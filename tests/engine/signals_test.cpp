// What there is of every output after a signal at every moment: engine/files/README.md has the table.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/command_line.hpp"
#include "tests/engine/traced.hpp"

namespace linden::signals_test {
namespace {

constexpr std::int64_t kSteps = 4000, kFrames = 300;
const std::string kOld = "linden checkpoint of old";

struct Kind {
  std::string file;
  bool of_run;
};
// in the order in which a command puts them in place
const std::vector<Kind> kKinds = {{"a.csv", true}, {"a.checkpoint", true}, {"a.png", true}, {"a.json", true}, {"a.npz", false}, {"a.h5", false}};

enum class Moment { starting, stepping, packing, renaming };
constexpr Moment kMoments[] = {Moment::starting, Moment::stepping, Moment::packing, Moment::renaming};
const char* const kMomentNames[] = {"starting", "stepping", "packing", "renaming"};

std::vector<std::string> command(const Kind& kind) {
  if (kind.of_run) return {"run", "scene.yaml", "--record", "a.csv", "--json", "a.json", "--plot", "a.png", "--save", "a.checkpoint"};
  return {"rollout", "scene.yaml", "--threads", "1", "--instances", "5", "--duration", "0.3", "--record", kind.file};
}

/// Whether the program has come to that moment of that output.
std::function<bool(const Traced::Call&)> at(Moment moment, const Kind& kind) {
  const std::string part = fmt::format("/.{}.linden.", kind.file);
  const auto writes = [](const Traced::Call& call, const std::string& to) {
    return call.is({SYS_write, SYS_pwrite64, SYS_fallocate}) && call.file(0).find(to) != std::string::npos;
  };
  switch (moment) {
    case Moment::starting:
      return [](const Traced::Call& call) { return call.is({SYS_openat}) && call.text(1).ends_with("scene.yaml"); };
    case Moment::stepping: {
      const std::string recording = kind.of_run ? "/.a.csv.linden." : part;
      return [=, count = 0](const Traced::Call& call) mutable { return writes(call, recording) && ++count == 3; };
    }
    case Moment::packing:
      if (kind.file == "a.npz") {
        return [](const Traced::Call& call) { return call.is({SYS_openat}) && call.text(1).find("/whole.npz") != std::string::npos; };
      }
      if (kind.file == "a.h5" || kind.file == "a.csv") {  // has been written all along
        return [=](const Traced::Call& call) { return call.is({SYS_ftruncate, SYS_fsync}) && call.file(0).find(part) != std::string::npos; };
      }
      return [=](const Traced::Call& call) { return writes(call, part); };
    case Moment::renaming: break;
  }
  return [=](const Traced::Call& call) {
#ifdef SYS_rename
    if (call.is({SYS_rename})) return call.text(1) == kind.file;
#endif
    return call.is({SYS_renameat, SYS_renameat2}) && call.text(3) == kind.file;
  };
}

/// Steps that a file holds, after a look at all that makes it whole; -1: it is the old one.
std::int64_t steps_in(const Shell& shell, const std::string& file) {
  const std::string text = text_of(shell / file);
  if (text == kOld) return -1;
  if (file == "a.csv") {
    REQUIRE(text.ends_with('\n'));
    std::istringstream lines(text);
    std::int64_t rows = 0;
    for (std::string line; std::getline(lines, line); ++rows) REQUIRE(std::ranges::count(line, ',') == 4);
    return rows - 2;  // the header, the start
  }
  if (file == "a.json") return nlohmann::json::parse(text).at("steps");
  if (file == "a.checkpoint") {
    Simulation simulation(load_scene(shell.file("scene.yaml")));
    simulation.load(shell.file(file));
    return simulation.steps();
  }
  if (file == "a.png") {
    CHECK(text.starts_with("\x89PNG\r\n"));
    CHECK(text.substr(text.size() - 8, 4) == "IEND");
    return kSteps;  // nobody can tell
  }
  const Arrays arrays = read(shell.file(file));
  for (const char* name : {"q", "v", "energy", "status"}) CHECK(arrays.at(name).shape[0] == arrays.at("time").shape[0]);
  return arrays.at("time").shape[0] - 1;
}

std::int64_t all_steps(const Kind& kind) { return kind.of_run ? kSteps : kFrames; }

/// Hidden names, which are temporary.
std::size_t leftovers(const Shell& shell) {
  const std::filesystem::directory_iterator all(shell.path());
  return static_cast<std::size_t>(std::distance(begin(all), end(all))) - shell.visible().size();
}

void prepare(const Shell& shell) {
  shell.write("scene.yaml", fmt::format("model: chain:3\nduration: {}\neffects: {{gravity: [0, 0, -9.81]}}\n", 1e-3 * kSteps));
  for (const Kind& kind : kKinds) shell.write(kind.file, kOld);
}

struct Signal {
  const char* name;
  std::vector<int> numbers;  // one after the other
};
const std::vector<Signal> kSignals = {{"INT twice", {SIGINT, SIGINT}}, {"TERM", {SIGTERM}}, {"HUP", {SIGHUP}}, {"XFSZ", {SIGXFSZ}}, {"KILL", {SIGKILL}}};

TEST_CASE("after any signal at any moment every output is the old one, or whole", "[command line]") {
  for (const Kind& kind : kKinds) {
    for (const Moment moment : kMoments) {
      if (moment < Moment::packing && kind.of_run && kind.file != "a.csv") continue;  // one command has them all
      for (const Signal& signal : kSignals) {
        INFO(kind.file << ", " << kMomentNames[static_cast<int>(moment)] << ", " << signal.name);
        const Shell shell;
        prepare(shell);
        Traced program(shell, command(kind));
        if (!program.possible()) {
          WARN("no program may be traced here");
          return;
        }
        REQUIRE(program.run_to(at(moment, kind)));
        for (const int number : signal.numbers) {
          program.send(number);
          if (number != SIGKILL) program.run_to([](const Traced::Call&) { return true; });
        }
        program.finish();
        INFO(program.err());

        const int number = signal.numbers[0];
        const bool killed = number == SIGKILL || (moment == Moment::starting && number != SIGXFSZ);
        if (killed) {
          CHECK(program.ended_by() == number);
        } else {
          CHECK(program.exit_code() == (moment == Moment::stepping && number != SIGXFSZ ? 128 + number : 0));
        }
        bool before = true;  // it was put in place before the moment
        for (const Kind& other : kKinds) {
          if (other.of_run != kind.of_run || (!kind.of_run && other.file != kind.file)) continue;
          if (other.file == kind.file) before = false;
          const std::int64_t steps = steps_in(shell, other.file);
          INFO(other.file << " has " << steps << " steps");
          if (killed && (moment < Moment::packing || !before)) {
            CHECK(steps == -1);
          } else if (moment == Moment::stepping && number != SIGXFSZ && other.file != "a.png") {
            CHECK(steps >= 0);
            CHECK(steps < all_steps(kind));
          } else {
            CHECK(steps == all_steps(kind));
          }
        }
        CHECK(leftovers(shell) == (killed && moment != Moment::starting ? 1 : 0));
        if (number != SIGKILL || moment != Moment::renaming) continue;
        const Outcome again = shell.linden(fmt::format("{}", fmt::join(command(kind), " ")));
        CHECK(again.exit_code == 0);
        CHECK_THAT(again.err, Contains(fmt::format(".{}.linden.", kind.file)) &&
                                  Contains(fmt::format(".part: removed; it was left by a process that was killed while it wrote {}\n", kind.file)));
        CHECK(leftovers(shell) == 0);
        CHECK(steps_in(shell, kind.file) == all_steps(kind));
      }
    }
  }
}

TEST_CASE("what another process still writes is not taken for a leftover, nor what bears another name", "[command line]") {
  const Shell shell;
  prepare(shell);
  shell.write(".a.csv.linden.0123456.part", "seven digits");
  shell.write(".a.csv.linden.0123456x.part", "no number");
  shell.write(".b.csv.linden.01234567.part", "another output's");
  shell.write(".a.csv.linden.01234567.part", "ours");
  Traced program(shell, command(kKinds[0]));
  if (!program.possible()) return;
  REQUIRE(program.run_to(at(Moment::stepping, kKinds[0])));
  const Outcome other = shell.linden("run chain:3 --duration 0.01 --record a.csv");
  CHECK(other.exit_code == 0);
  CHECK(other.err.empty());  // the one there was has been removed by the first
  CHECK(leftovers(shell) == 4);
  program.finish();
  CHECK(program.exit_code() == 0);
  CHECK_THAT(program.err(), Contains(".a.csv.linden.01234567.part: removed"));
  CHECK(steps_in(shell, "a.csv") == kSteps);
  CHECK(leftovers(shell) == 3);
}

TEST_CASE("a second Ctrl-C does not cut off the packing, which may take long, and is answered", "[command line]") {
  const Shell shell;
  prepare(shell);
  Traced program(shell, command(kKinds[4]));
  if (!program.possible()) return;
  REQUIRE(program.run_to(at(Moment::stepping, kKinds[4])));
  program.send(SIGINT);
  REQUIRE(program.run_to(at(Moment::packing, kKinds[4])));
  for (int again = 0; again < 3; ++again) {
    program.send(SIGINT);
    REQUIRE(program.run_to([](const Traced::Call&) { return true; }));
  }
  program.finish();
  CHECK(program.exit_code() == 130);
  CHECK_THAT(program.err(), Contains("linden: interrupted after") && Contains("a.npz is valid up to there"));
  CHECK(steps_in(shell, "a.npz") < kFrames);
}

}  // namespace
}  // namespace linden::signals_test
