// Rollouts that survive: whatever happens to a process at whatever moment, what goes on from its checkpoints ends to the bit as if nothing
// had happened.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/solve/instructions.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/command_line.hpp"
#include "tests/engine/traced.hpp"

namespace linden::rollout_checkpoint_test {
namespace {

namespace fs = std::filesystem;

/// Figures of a rollout without the times by the clock.
nlohmann::json lasting(const Shell& shell, const std::string& file) {
  nlohmann::json json = nlohmann::json::parse(text_of(shell / file));
  for (const char* time : {"wall_seconds", "total_seconds", "env_steps_per_second", "ns_per_body_step", "threads"}) json.erase(time);
  return json;
}

/// Steps of the checkpoints in a folder, of those that are whole as far as their manifest tells.
std::vector<std::int64_t> checkpoints_in(const fs::path& folder) {
  std::vector<std::int64_t> steps;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") == name.npos && fs::exists(entry.path() / "manifest.json")) steps.push_back(std::stoll(name));
  }
  std::ranges::sort(steps);
  return steps;
}

fs::path newest_in(const fs::path& folder) {
  const std::vector<std::int64_t> steps = checkpoints_in(folder);
  REQUIRE_FALSE(steps.empty());
  return folder / fmt::format("{:013}", steps.back());
}

/// Both are recordings of one rollout, the second of as many frames at least, and what is in both is the same.
void check_begins(const Arrays& all, const Arrays& begin, std::int64_t frames) {
  REQUIRE(begin.size() == all.size());
  for (const auto& [name, array] : all) {
    CAPTURE(name);
    const Array& other = begin.at(name);
    CHECK(other.type == array.type);
    const std::size_t both = std::min(array.bytes.size(), other.bytes.size());
    CHECK(array.bytes.substr(0, both) == other.bytes.substr(0, both));
    if (name == "time") CHECK(other.shape[0] >= frames);
    CHECK(std::vector(array.shape.begin() + 1, array.shape.end()) == std::vector(other.shape.begin() + 1, other.shape.end()));
  }
}

// as often as there is time to
const std::string kKeeping = " --checkpoint-every 1e-9 --checkpoint kept";

/// One with masses and gains of its own for each, so fast that about a third freeze, whatever the instructions.
std::string rollout(const Shell& shell) {
  shell.write("rope.yaml",
              "model: chain:3\nduration: 0.5\ninitial: {positions: {joint1: 1}}\n"
              "effects: {gravity: [0, 0, -9.81], damping: 0.1, servo: {stiffness: 4}}\n");
  return "rollout rope.yaml --instances 21 --spread 800 --threads 1 --randomize masses=0.3,gains=0.2";
}

bool changes_disk(const Traced::Call& call) {
#ifdef SYS_mkdir
  if (call.is({SYS_mkdir, SYS_rename, SYS_unlink, SYS_rmdir})) return true;
#endif
  return call.is({SYS_pwrite64, SYS_mkdirat, SYS_fsync, SYS_ftruncate, SYS_renameat, SYS_renameat2, SYS_unlinkat});
}

TEST_CASE("a rollout that is killed at any moment goes on to the bit", "[command line]") {
  const Shell shell;
  const std::string command = rollout(shell) + " --duration 0.05 --every 6";
  const Outcome whole = shell.linden(command + " --json whole.json --record whole.h5");
  REQUIRE(whole.exit_code == 1);
  const nlohmann::json expected = lasting(shell, "whole.json");
  const Arrays recorded = read(shell.file("whole.h5"));
  REQUIRE(expected["failures"] > 0);
  REQUIRE(expected["failures"] < 21);
  REQUIRE(expected["frames"] == 10);  // 0, 6, ..., 48, and the last, 50

  std::vector<std::string> words;
  std::istringstream split(command + kKeeping + " --json a.json --record a.h5");
  for (std::string word; split >> word;) words.push_back(word);
  int killed = 0, anew = 0;
  for (int moment = 3;; moment += 61) {  // of all calls that change something on the disk
    CAPTURE(moment);
    for (const std::string& name : shell.visible()) {
      if (name.starts_with("a.") || name == "kept") fs::remove_all(shell / name);
    }
    Traced program(shell, words);
    if (!program.possible()) {
      WARN("no program may be traced here");
      return;
    }
    const bool reached = program.run_to([&, count = 0](const Traced::Call& call) mutable { return changes_disk(call) && count++ == moment; });
    if (reached) program.send(SIGKILL);
    program.finish();
    if (!reached) break;
    ++killed;
    const bool there = !checkpoints_in(shell / "kept").empty();
    anew += there ? 0 : 1;
    // what was recorded before the newest checkpoint is there to be read
    const std::int64_t frames = there ? checkpoints_in(shell / "kept").back() / 6 + 1 : 0;
    if (there) check_begins(recorded, read(shell.file("a.h5")), frames);
    const Outcome again = shell.linden(command + (there ? " --resume kept" : kKeeping) + " --json a.json --record a.h5");
    CHECK(again.exit_code == 1);
    CHECK_THAT(again.err, !Contains("damaged"));
    CHECK((lasting(shell, "a.json") == expected));
    check_begins(read(shell.file("a.h5")), recorded, 10);
    check_begins(recorded, read(shell.file("a.h5")), 10);
    CHECK(checkpoints_in(shell / "kept").back() == 50);
    CHECK(checkpoints_in(shell / "kept").size() <= 3);  // one more where it was killed between the last one and the removal of the oldest
    for (const auto& entry : fs::recursive_directory_iterator(shell / "kept")) CHECK_THAT(entry.path().string(), !Catch::EndsWith(".part"));
  }
  CHECK(killed > 4);
  CHECK(anew < killed / 2);
}

TEST_CASE("a rollout that is interrupted says how to go on, and does so without a loss", "[command line]") {
  const Shell shell;
  const std::string command = "rollout chain:4 --instances 64 --duration 300 --threads 1 --spread 0.5";
  const Outcome interrupted = shell.interrupted(command + " --checkpoint 'a folder' --json a.json");
  CHECK(interrupted.exit_code == 130);
  const std::string before = "to go on: ";
  const std::size_t at = interrupted.err.find(before);
  REQUIRE(at != std::string::npos);
  const std::string said = interrupted.err.substr(at + before.size());
  CHECK_THAT(said, StartsWith(LINDEN_PROGRAM) && Catch::EndsWith("--json a.json --resume 'a folder'\n"));
  const std::int64_t steps = nlohmann::json::parse(text_of(shell / "a.json")).at("steps");
  CHECK(checkpoints_in(shell / "a folder") == std::vector<std::int64_t>{steps});
  // to a nearer end than it had, as this is to be quick
  const std::string duration = fmt::format(" --duration {} --json", 1e-3 * static_cast<double>(steps + 100));
  const std::string there = "rollout chain:4 --instances 64 --threads 1 --spread 0.5" + duration;
  CHECK(shell.linden(there + " whole.json").exit_code == 0);
  const Outcome resumed = shell.linden(there + " b.json --resume 'a folder'");
  CHECK(resumed.exit_code == 0);
  CHECK_THAT(resumed.err, Contains("goes on after ") && Contains(", from a folder"));
  CHECK((lasting(shell, "b.json") == lasting(shell, "whole.json")));
}

TEST_CASE("a rollout that is done is done when it is resumed, and goes on where it is to be longer", "[command line]") {
  const Shell shell;
  const std::string command = "rollout chain:3 --instances 9 --spread 1";
  REQUIRE(shell.linden(command + " --duration 0.2 --json a.json --keep 3" + kKeeping).exit_code == 0);
  CHECK(checkpoints_in(shell / "kept").size() == 3);
  REQUIRE(shell.linden(command + " --duration 0.2 --json b.json --resume kept").exit_code == 0);
  CHECK((lasting(shell, "a.json") == lasting(shell, "b.json")));
  REQUIRE(shell.linden(command + " --duration 0.3 --json c.json --resume kept --threads 3").exit_code == 0);
  REQUIRE(shell.linden(command + " --duration 0.3 --json d.json").exit_code == 0);
  CHECK((lasting(shell, "c.json") == lasting(shell, "d.json")));
  CHECK(checkpoints_in(shell / "kept").size() == 2);
  CHECK(checkpoints_in(shell / "kept").back() == 300);
  check_refused(shell, command + " --duration 0.1 --resume kept", "--resume kept: its checkpoint is after 300 steps, the rollout is to end after 100");
}

TEST_CASE("a checkpoint that is damaged is told and put aside, and the one before is taken", "[command line]") {
  const Shell shell;
  const std::string command = "rollout chain:3 --instances 9 --spread 1 --duration 0.2";
  REQUIRE(shell.linden(command + " --json whole.json").exit_code == 0);
  struct Damage {
    std::string file;
    std::function<std::string(std::string)> change;
    std::string said;
  };
  const auto flip = [](std::string text) { return text[text.size() / 2] ^= 4, text; };
  const auto halve = [](const std::string& text) { return text.substr(0, text.size() / 2); };
  for (const Damage& damage : {Damage{"part-0", flip, "part-0: this part of a checkpoint is damaged: its checksum"},
                               {"part-0", halve, "part-0: this part of a checkpoint is damaged: it has"},
                               {"manifest.json", flip, "manifest.json: the manifest is damaged"},
                               {"manifest.json", halve, "manifest.json: the manifest is damaged: it does not read"}}) {
    CAPTURE(damage.said);
    fs::remove_all(shell / "kept");
    REQUIRE(shell.linden(command + kKeeping).exit_code == 0);
    const fs::path newest = newest_in(shell / "kept"), file = newest / damage.file;
    const std::string text = damage.change(text_of(file));
    std::ofstream(file, std::ios::binary) << text;
    const Outcome resumed = shell.linden(command + " --resume kept --json a.json");
    CHECK(resumed.exit_code == 0);
    CHECK_THAT(resumed.err, Contains(damage.said) && Contains("the checkpoint before it is taken") && Contains("goes on after "));
    CHECK((lasting(shell, "a.json") == lasting(shell, "whole.json")));
    CHECK(fs::exists(newest.string() + ".damaged"));
    CHECK(newest_in(shell / "kept") == newest);
  }
  for (const std::int64_t steps : checkpoints_in(shell / "kept")) fs::remove(shell / fmt::format("kept/{:013}/part-0", steps));
  const Outcome lost = shell.linden(command + " --resume kept");
  CHECK(lost.exit_code == 2);
  CHECK_THAT(lost.err, Contains("part-0: there is no such file") && Contains("this folder holds no checkpoint that is whole"));
}

TEST_CASE("another command line than that of the checkpoints is refused, and what differs is named", "[command line]") {
  const Shell shell;
  const std::string command = rollout(shell);
  REQUIRE(shell.linden(command + kKeeping).exit_code == 1);
  const auto refused = [&](const std::string& other, const std::string& said) {
    check_refused(shell, other + " --resume kept", "--resume kept: its checkpoints are of another rollout: " + said);
  };
  refused("rollout rope.yaml --instances 22 --spread 800 --seed 4 --randomize masses=0.3,gains=0.2",
          "--instances is 21 there and 22 here, --seed is 1 there and 4 here; expected the same");
  refused(command + " --dt 2e-3", "--dt is 0.001 there and 0.002 here");
  refused(command + " --float", "--float is not given there and given here");
  refused(command + " --gravity 0,0,1", "--gravity is 0,0,-9.81 there and 0,0,1 here");
  refused(command + " --record a.h5", "--record is not given there and given here");
  refused("rollout chain:2 --instances 21 --spread 800", "the model is ");
  refused("rollout rope.yaml --instances 21 --spread 800", "--randomize is masses ");
  shell.write("rope.yaml", "model: chain:3\nduration: 0.5\ninitial: {positions: {joint1: 1}}\n"
                           "effects: {gravity: [0, 0, -9.81], damping: 0.2, servo: {stiffness: 4}}\n");
  refused(command, "the scene's effects is damping, servo");
}

TEST_CASE("instructions are those of the checkpoint where none are named", "[command line]") {
  const Shell shell;
  const std::string command = "rollout chain:3 --instances 9 --spread 1 --duration 0.1";
  REQUIRE(shell.linden(command + " --instructions scalar --json a.json" + kKeeping).exit_code == 0);
  REQUIRE(shell.linden(command + " --resume kept --json b.json").exit_code == 0);
  CHECK((lasting(shell, "a.json") == lasting(shell, "b.json")));
  const fs::path manifest = newest_in(shell / "kept") / "manifest.json";
  if (best_instructions() != Instructions::scalar) {
    check_refused(shell, fmt::format("{} --resume kept --instructions {}", command, name(best_instructions())), "--instructions is scalar there and ");
  }
}

TEST_CASE("folders that can hold no checkpoints are refused before any work", "[command line]") {
  const Shell shell;
  const std::string command = "rollout chain:3 --instances 9 --duration 0.1";
  shell.write("file", "text");
  check_refused(shell, command + " --checkpoint file", "--checkpoint file: this is no folder; expected one, or a name that is free");
  check_refused(shell, command + " --checkpoint nothing/kept", "--checkpoint nothing/kept: there is no folder nothing; create it first");
  check_refused(shell, command + " --checkpoint /proc/kept", "/proc/kept: cannot be written", 1);
  check_refused(shell, command + " --resume nothing", "--resume nothing: this is no folder");
  check_refused(shell, command + " --resume file", "--resume file: this is no folder");
  check_refused(shell, command + " --checkpoint a --resume b", "leave --checkpoint out");
  check_refused(shell, command + " --keep 3", "--keep is about checkpoints");
  check_refused(shell, command + " --checkpoint-every 5", "--checkpoint-every is about checkpoints");
  check_refused(shell, command + " --checkpoint kept --checkpoint-every 0", "--checkpoint-every 0: expected seconds by the clock above zero");
  check_refused(shell, command + " --checkpoint kept --keep 0", "--keep 0: expected 1 checkpoint or more");
  check_refused(shell, command + " --checkpoint kept --view a.html", "leave --view, --gltf, --picture and --film out");
  fs::create_directory(shell / "empty");
  check_refused(shell, command + " --resume empty", "--resume empty: this folder holds no checkpoint that is whole");
  REQUIRE(shell.linden(command + " --checkpoint empty").exit_code == 0);
  check_refused(shell, command + " --checkpoint empty",
                "--checkpoint empty: this folder holds checkpoints of a rollout, the newest after 100 steps; expected none; --resume empty goes on");
}

TEST_CASE("two processes do not keep checkpoints in one folder", "[command line]") {
  const Shell shell;
  std::vector<std::string> words{"rollout", "chain:3", "--instances", "9", "--duration", "1", "--checkpoint", "kept"};
  Traced program(shell, words);
  if (!program.possible()) return;
  REQUIRE(program.run_to([](const Traced::Call& call) { return call.is({SYS_pwrite64}) && call.file(0).find("/kept/") != std::string::npos; }));
  const Outcome other = shell.linden("rollout chain:3 --instances 9 --duration 1 --checkpoint kept");
  CHECK(other.exit_code == 2);
  CHECK_THAT(other.err, Contains("kept: another process keeps its checkpoints there"));
  program.finish();
  CHECK(program.exit_code() == 0);
  CHECK(checkpoints_in(shell / "kept") == std::vector<std::int64_t>{1000});
}

TEST_CASE("where a recording goes on it is the one that was begun, in parts that are there", "[command line]") {
  const Shell shell;
  const std::string command = "rollout chain:3 --instances 9 --spread 1 --every 7 --record a.h5 --duration ";
  REQUIRE(shell.linden("rollout chain:3 --instances 9 --spread 1 --every 7 --record whole.h5 --duration 0.2 --compress").exit_code == 0);
  REQUIRE(shell.linden(command + "0.05" + kKeeping).exit_code == 0);
  check_refused(shell, "rollout chain:3 --record b.npz --resume kept", "--record b.npz: with --checkpoint and --resume a recording grows part by part");
  // the last frame of the shorter rollout, after 50 steps, is none of the longer one
  CHECK(read(shell.file("a.h5")).at("time").shape[0] == 9);
  REQUIRE(shell.linden(command + "0.1 --resume kept --compress").exit_code == 0);
  REQUIRE(shell.linden(command + "0.2 --resume kept").exit_code == 0);
  const Arrays whole = read(shell.file("whole.h5"));
  CHECK(whole.at("time").shape[0] == 30);
  check_begins(whole, read(shell.file("a.h5")), 30);
  // a rollout that begins with this name takes its place with all its parts
  const Outcome other = shell.linden("rollout chain:2 --instances 3 --duration 0.01 --record a.h5");
  CHECK(other.exit_code == 0);
  CHECK(shell.visible() == std::set<std::string>{"a.h5", "kept", "whole.h5"});
  const Outcome lost = shell.linden(command + "0.3 --resume kept");
  CHECK(lost.exit_code == 1);
  CHECK_THAT(lost.err, StartsWith("linden: a.h5: cannot be written: its parts a.h5."));
}

}  // namespace
}  // namespace linden::rollout_checkpoint_test
