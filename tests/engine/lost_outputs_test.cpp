// Full disks, streams that nobody reads, special files, memory and threads that are not to be had: a sentence and a code, and all that fits.
#include <sys/stat.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/simulation.hpp"
#include "models/build/generators.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::lost_outputs_test {
namespace {

/// Rows behind the header; every line is whole.
std::int64_t rows_of(const std::filesystem::path& file, std::int64_t columns) {
  const std::string text = text_of(file);
  CHECK(text.ends_with('\n'));
  std::istringstream lines(text);
  std::int64_t rows = -1;
  for (std::string line; std::getline(lines, line); ++rows) REQUIRE(std::ranges::count(line, ',') == columns - 1);
  return rows;
}

bool has_hidden(const Shell& shell) {
  const std::set<std::string> files = shell.files();
  return std::ranges::any_of(files, [](const std::string& name) { return name[0] == '.'; });
}

/// The program with `full` for a disk of some size, as only root can have one; what is on it afterwards lies in `kept`. Exit code 99: there
/// can be none here.
Outcome on_full_disk(const Shell& shell, const std::string& size, const std::string& arguments) {
  const Folder scripts;
  scripts.write("script",
                "mkdir -p full kept; mount -t tmpfs -o size=" + size + " none full || exit 99\n" +
                    "cp old/* full/ 2>/dev/null\n\"$@\"; code=$?\ncp -a full/. kept/\nexit $code\n");
  std::filesystem::create_directory(shell / "old");
  return shell.linden(arguments, fmt::format("unshare -m true || exit 99; unshare -m sh '{}'", scripts.file("script")));
}

TEST_CASE("a full disk keeps the rows and frames that fit, and what goes to another one is written", "[command line]") {
  {
    const Shell shell;
    const Outcome csv = on_full_disk(shell, "256k", "run chain:3 --duration 100 --record full/a.csv --json b.json --save c.checkpoint --plot d.svg");
    if (csv.exit_code == 99) {
      WARN("no disk can be made here");
      return;
    }
    CHECK(csv.exit_code == 1);
    const std::int64_t rows = rows_of(shell / "kept" / "a.csv", 5);
    CHECK(rows > 1000);
    const std::string expected = fmt::format("linden: full/a.csv: cannot be written: No space left on device; it holds {},{:03} rows; the run ended at ",
                                             rows / 1000, rows % 1000);
    CHECK_THAT(csv.err, StartsWith(expected));
    const nlohmann::json figures = nlohmann::json::parse(text_of(shell / "b.json"));
    CHECK(figures.at("steps") < 100'000);
    CHECK_THAT(figures.at("recording_failure").get<std::string>(), Contains("No space left on device"));
    Simulation simulation(chain(3));
    simulation.load(shell.file("c.checkpoint"));
    CHECK(simulation.steps() == figures.at("steps"));
    CHECK(text_of(shell / "d.svg").ends_with("</svg>\n"));
    CHECK_FALSE(has_hidden(shell));
  }
  for (const std::string ending : {"npz", "h5"}) {
    INFO(ending);
    const Shell shell;
    const Outcome outcome =
        on_full_disk(shell, "2m", fmt::format("rollout chain:3 --instances 100 --duration 1 --record full/a.{} --json b.json", ending));
    CHECK(outcome.exit_code == 1);
    const Arrays arrays = read(shell.file("kept/a." + ending));
    const std::int64_t frames = arrays.at("time").shape[0];
    CHECK(frames > 50);
    CHECK(arrays.at("q").shape == std::vector<std::int64_t>{frames, 100, 3});
    CHECK_THAT(outcome.err, StartsWith(fmt::format("linden: full/a.{}: cannot be written: No space left on device; it holds {} frames; the rollout ended "
                                                   "after {} of 1,000 steps",
                                                   ending, frames, frames)));
    CHECK(nlohmann::json::parse(text_of(shell / "b.json")).at("frames") == frames);
    CHECK_FALSE(has_hidden(shell));
  }
  const Shell shell;
  std::filesystem::create_directory(shell / "old");
  for (const char* name : {"old/a.json", "old/a.svg", "old/a.checkpoint"}) shell.write(name, "linden checkpoint of old");
  const Outcome rest =
      on_full_disk(shell, "16k", "run chain:5000 --duration 0.01 --json full/a.json --plot full/a.svg --save full/a.checkpoint --record b.csv");
  CHECK(rest.exit_code == 1);
  CHECK(rows_of(shell / "b.csv", 5002) == 11);
  for (const char* name : {"a.svg", "a.checkpoint"}) {
    CHECK(text_of(shell / "kept" / name) == "linden checkpoint of old");
    CHECK_THAT(rest.err, Contains(fmt::format("linden: full/{}: cannot be written: No space left on device\n", name)));
  }
  CHECK(nlohmann::json::parse(text_of(shell / "kept" / "a.json")).at("steps") == 10);
  CHECK_FALSE(has_hidden(shell));
}

TEST_CASE("checkpoints on a full disk give way to newer ones but for the last, and the rollout goes on", "[command line]") {
  const std::string command = "rollout chain:30 --instances 70 --duration 0.1";
  for (const auto& [size, room] : {std::pair<std::string, int>{"450k", 2}, {"250k", 1}, {"64k", 0}}) {  // a checkpoint takes 168 KB
    INFO(size);
    const Shell shell;
    const Outcome outcome = on_full_disk(shell, size, command + " --keep 5 --checkpoint full/state --checkpoint-every 1e-9 --json a.json");
    if (outcome.exit_code == 99) return;
    CHECK(nlohmann::json::parse(text_of(shell / "a.json")).at("steps") == 100);
    const std::filesystem::path state = shell / "kept" / "state";
    std::set<std::string> there;
    for (const auto& entry : std::filesystem::directory_iterator(state)) there.insert(entry.path().filename().string());
    CHECK(static_cast<int>(there.size()) == room);
    CHECK_FALSE(has_hidden(shell));
    if (room == 2) {
      CHECK(outcome.exit_code == 0);
      CHECK(outcome.err.empty());
      CHECK(there.contains("0000000000100"));
    } else {
      CHECK(outcome.exit_code == 1);
      CHECK_THAT(outcome.err, Contains("part-0: cannot be written: No space left on device; ") &&
                                  Contains(room == 1 ? "the newest checkpoint stays that after " : "there is no checkpoint yet"));
    }
    if (room > 0) CHECK(shell.linden(command + " --resume kept/state").exit_code == 0);
  }
}

TEST_CASE("a recording whose disk was full goes on when there is room, to the bit", "[command line]") {
  for (const char* packed : {"", " --compress"}) {
    INFO(packed);
    const Shell shell;
    const std::string command = fmt::format("rollout chain:3 --instances 100 --duration 0.6{}", packed);
    REQUIRE(shell.linden(command + " --record whole.h5").exit_code == 0);
    const Outcome full = on_full_disk(shell, "2m", command + " --record full/a.h5 --checkpoint state");
    if (full.exit_code == 99) return;
    CHECK(full.exit_code == 1);
    CHECK_THAT(full.err, StartsWith("linden: full/a.h5: cannot be written: No space left on device; it holds ") && Contains("; to go on: "));
    const Arrays whole = read(shell.file("whole.h5")), kept = read(shell.file("kept/a.h5"));
    const auto frames = static_cast<std::size_t>(kept.at("time").shape[0]);
    CHECK(frames > 200);
    CHECK(frames < 601);
    CHECK((kept.at("q").bytes == whole.at("q").bytes.substr(0, frames * 100 * 3 * 8)));
    std::filesystem::copy(shell / "kept", shell / "full", std::filesystem::copy_options::recursive);
    const Outcome resumed = shell.linden(command + " --record full/a.h5 --resume state");
    CHECK(resumed.exit_code == 0);
    CHECK_THAT(resumed.err, Contains(fmt::format("goes on after {} of 600 steps", frames)));
    const Arrays all = read(shell.file("full/a.h5"));
    for (const char* array : {"time", "q", "v", "energy", "status"}) CHECK((all.at(array).bytes == whole.at(array).bytes));
  }
}

TEST_CASE("a file that may not grow ends a run like a full disk", "[command line]") {
  const Shell shell;
  const std::string limited = "ulimit -f 64; ";  // blocks of 512 or 1,024 bytes
  const Outcome csv = shell.linden("run chain:3 --duration 10 --record a.csv --json a.json", limited);
  CHECK(csv.exit_code == 1);
  CHECK(rows_of(shell / "a.csv", 5) > 100);
  CHECK_THAT(csv.err, StartsWith("linden: a.csv: cannot be written: File too large; it holds "));
  CHECK(nlohmann::json::parse(text_of(shell / "a.json")).at("steps") < 10'000);
  const Outcome npz = shell.linden("rollout chain:3 --instances 10 --duration 1 --record a.npz", limited);
  CHECK(npz.exit_code == 1);
  CHECK(read(shell.file("a.npz")).at("time").shape[0] > 10);
  shell.write("b.checkpoint", "linden checkpoint of old");
  const Outcome checkpoint = shell.linden("run chain:5000 --duration 0.001 --save b.checkpoint", limited);
  CHECK(checkpoint.exit_code == 1);
  CHECK_THAT(checkpoint.err, Contains("linden: b.checkpoint: cannot be written: File too large\n"));
  CHECK(text_of(shell / "b.checkpoint") == "linden checkpoint of old");
  CHECK(shell.files() == std::set<std::string>{"a.csv", "a.json", "a.npz", "b.checkpoint"});
}

TEST_CASE("an output that has no room for its first row leaves the old one", "[command line]") {
  const Shell shell;
  for (const char* name : {"a.csv", "a.npz", "a.h5"}) shell.write(name, "old");
  const std::string limited = "ulimit -f 1; ";
  CHECK(shell.linden("run chain:300 --duration 0.01 --record a.csv", limited).exit_code == 1);
  for (const char* name : {"a.npz", "a.h5"}) {
    CHECK(shell.linden(fmt::format("rollout chain:3 --instances 100 --duration 0.01 --record {}", name), limited).exit_code == 1);
  }
  for (const char* name : {"a.csv", "a.npz", "a.h5"}) CHECK(text_of(shell / name) == "old");
  CHECK(shell.files().size() == 3);
}

/// A shell command in which PROGRAM stands for the program; what it prints.
std::string said_by(const Shell& shell, std::string command) {
  const std::string word = "PROGRAM";
  for (std::size_t at = 0; (at = command.find(word, at)) != command.npos;) command.replace(at, word.size(), fmt::format("'{}'", LINDEN_PROGRAM));
  const Folder outputs;
  outputs.write("script", command);
  const std::string line = fmt::format("cd '{}' && bash '{}' > '{}' 2>&1 < /dev/null", shell.path().string(), outputs.file("script"), outputs.file("out"));
  REQUIRE(std::system(line.c_str()) != -1);
  return text_of(outputs / "out");
}

TEST_CASE("standard streams that are closed, full or read by nobody end with a code, never by a signal", "[command line]") {
  struct Case {
    const char* command;
    const char* said;
  };
  const Shell shell;
  for (const auto& [command, said] : std::initializer_list<Case>{
           {"PROGRAM run chain:3 --duration 0.01 >&-; echo $?", "linden: standard output cannot be written: Bad file descriptor\n1\n"},
           {"PROGRAM run chain:3 --duration 0.01 > /dev/full; echo $?", "linden: standard output cannot be written: No space left on device\n1\n"},
           {"PROGRAM --help > /dev/full; echo $?", "linden: standard output cannot be written: No space left on device\n1\n"},
           {"PROGRAM inspect chain:5000 --all | head -1; echo ${PIPESTATUS[0]}",
            "model       chain:5000, fixed base\nlinden: standard output cannot be written: Broken pipe\n1\n"},
           {"PROGRAM run chain:3 --duration 0.01 2>&- > out; echo $?", "0\n"},
           {"PROGRAM run chain:0 2>&-; echo $?", "2\n"},
           {"PROGRAM run chain:0 2> /dev/full; echo $?", "2\n"},
           {"PROGRAM run chain:0 2> >(true) ; echo $?", "2\n"},
           {"PROGRAM run chain:3 --duration 0.01 --record a.csv --json a.json <&- >&- 2>&-; echo $?", "1\n"},
       }) {
    INFO(command);
    CHECK(said_by(shell, command) == said);
  }
  // what was to be written was, and nothing of the closed streams went there
  CHECK(rows_of(shell / "a.csv", 5) == 11);
  CHECK(nlohmann::json::parse(text_of(shell / "a.json")).at("steps") == 10);
}

TEST_CASE("a checkpoint is loaded from ordinary files alone, and nothing is waited for", "[command line]") {
  const Shell shell;
  REQUIRE(::mkfifo((shell / "pipe").c_str(), 0600) == 0);
  std::filesystem::create_symlink("pipe", shell / "link");
  for (const char* file : {"pipe", "link", "/dev/zero", "/dev/null", "."}) {
    check_refused(shell, fmt::format("run chain:3 --load {}", file),
                  fmt::format("{}: this is not an ordinary file; expected a checkpoint that linden saved", file));
  }
  check_refused(shell, "run chain:3 --load nothing", "nothing: the checkpoint cannot be read; does the file exist?");
}

#ifndef LINDEN_SANITIZED  // AddressSanitizer takes more memory than there is
TEST_CASE("memory and threads that cannot be had are said in one line", "[command line]") {
  const Shell shell;
  const Outcome memory = shell.linden("run chain:500000 --duration 0.01 --json a.json", "ulimit -v 400000; ");
  CHECK(memory.exit_code == 1);
  CHECK_THAT(memory.err, StartsWith("linden: there is not enough memory for that; "));
  CHECK(std::ranges::count(memory.err, '\n') == 1);
  const Outcome threads = shell.linden("rollout chain:3 --instances 10 --threads 4096 --duration 0.01 --json a.json", "ulimit -v 2000000; ");
  CHECK(threads.exit_code == 1);
  CHECK_THAT(threads.err, StartsWith("linden: 4096 threads were to work and only ") && Contains("ask for fewer (--threads"));
  CHECK(std::ranges::count(threads.err, '\n') == 1);
  CHECK(shell.files().empty());
}
#endif

}  // namespace
}  // namespace linden::lost_outputs_test
