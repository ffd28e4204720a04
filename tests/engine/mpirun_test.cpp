// `mpirun linden rollout`: the bits of one process for any number of ranks, one message for all of them, and what is left of those killed.
// Where linden is built with an MPI (LINDEN_MPIEXEC names its mpirun).
#ifdef LINDEN_MPIEXEC
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/engine/array_reader.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::mpirun_test {
namespace {

namespace fs = std::filesystem;

const std::string kScene =
    "model: chain:3\nduration: 0.04\n"
    "effects: {gravity: [0, 0, -9.81], damping: 0.1, servo: {stiffness: 4, damping: 0.1}}\nrandomize: {masses: 0.2, gains: 0.1}\n";
const std::string kRecorded = " --spread 1 --every 4 --observe com,pose:link3 --record ";

/// More ranks than cores, and by root too, as Open MPI wants to be told; others read none of this.
std::string mpirun(int ranks) {
  return fmt::format("OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 "
                     "OMPI_MCA_hwloc_base_binding_policy=none '{}' -n {} ", LINDEN_MPIEXEC, ranks);
}

/// Those of the program, between what mpirun says of exit codes.
std::vector<std::string> messages(const Outcome& outcome) {
  std::vector<std::string> found;
  std::istringstream lines(outcome.err);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("linden: ")) found.push_back(line);
  }
  return found;
}

/// What does not depend on the machine and on who computes.
std::string without_times(const std::string& summary) {
  std::istringstream lines(summary);
  std::string kept;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("speed ") || line.starts_with("processor ")) continue;
    if (line.starts_with("instances ")) line = line.substr(0, line.find(','));  // memory: idle lanes of blocks are counted
    kept += line + '\n';
  }
  return kept;
}

nlohmann::json json_without_times(const fs::path& file) {
  nlohmann::json json = nlohmann::json::parse(text_of(file));
  for (const char* key : {"ranks", "threads", "bytes", "wall_seconds", "total_seconds", "env_steps_per_second", "ns_per_body_step"}) {
    CHECK(json.erase(key) == 1);
  }
  return json;
}

void check_equal(const Arrays& found, const Arrays& expected) {
  CHECK(found.size() == expected.size());
  for (const auto& [name, array] : expected) {
    INFO(name);
    REQUIRE(found.contains(name));
    CHECK(found.at(name).shape == array.shape);
    CHECK(found.at(name).bytes == array.bytes);
    CHECK(found.at(name).words == array.words);
  }
}

TEST_CASE("1, 2, 3 and 4 ranks record the bits of one process and report its figures, in double and single precision", "[command line]") {
  const Shell shell;
  shell.write("scene.yaml", kScene);
  for (const std::string real : {"", " --float"}) {
    const std::string rollout = "rollout scene.yaml --instances 21 " + real + kRecorded;
    const Outcome alone = shell.linden(rollout + "a.h5 --json a.json --threads 1");
    REQUIRE(alone.exit_code == 0);
    const Arrays expected = read(shell.file("a.h5"));
    CHECK(expected.at("q").shape == std::vector<std::int64_t>{11, 21, 3});
    CHECK(expected.contains("mass_factors"));
    fs::remove(shell / "a.h5");
    for (int ranks = 1; ranks <= 4; ++ranks) {
      INFO(ranks << " ranks" << real);
      const Outcome outcome = shell.linden(rollout + fmt::format("a.h5 --json b.json --threads {}", 1 + ranks % 2), mpirun(ranks));
      INFO(outcome.err);
      CHECK(outcome.exit_code == 0);
      CHECK(messages(outcome).empty());
      CHECK(without_times(outcome.out) == without_times(alone.out));
      CHECK((outcome.out.find(fmt::format("processor   {} ranks, ", ranks)) != outcome.out.npos) == (ranks > 1));
      CHECK(json_without_times(shell / "b.json") == json_without_times(shell / "a.json"));
      check_equal(read(shell.file("a.h5")), expected);
      CHECK(shell.visible().size() == (ranks == 1 ? 4 : 5));  // with the folder of parts, and none of those before
    }
    shell.linden("rollout chain:1 --instances 1 --duration 0.001 --record a.h5");  // takes the place of all parts
  }
}

TEST_CASE("instances that fail are told by number, of all ranks, with exit code 1", "[command line]") {
  const Shell shell;
  const std::string rollout = "rollout chain:3 --instances 12 --duration 2 --dt 0.5 --spread 500";
  const Outcome alone = shell.linden(rollout), outcome = shell.linden(rollout, mpirun(3));
  CHECK(outcome.exit_code == 1);
  CHECK(without_times(outcome.out) == without_times(alone.out));
  CHECK(messages(outcome) == messages(alone));
}

TEST_CASE("bad input is told once, with the exit code of one process", "[command line]") {
  const Shell shell;
  for (const auto& [arguments, expected] : std::map<std::string, std::string>{
           {"rollout no.urdf", "no.urdf"},
           {"rollout chain:2 --instance 5", "did you mean --instances?"},
           {"rollout chain:2 --instances 2", "there are 3 ranks; expected an instance for each"},
           {"rollout chain:2 --record a.npz", "--record a.npz: 3 ranks write one recording in parts, which .h5 alone has; expected .h5"},
           {"rollout chain:2 --record no/a.h5", "there is no folder no; create it first"},
           {"rollout chain:2 --instances 9 --shown 4 --gltf a.glb", "--shown 4: rank 0 shows those of its own instances, which are 3"}}) {
    INFO(arguments);
    const Outcome outcome = shell.linden(arguments, mpirun(3));
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.out.find("model") == outcome.out.npos);
    const std::vector<std::string> told = messages(outcome);
    REQUIRE(told.size() == 1);
    CHECK_THAT(told[0], Contains(expected));
  }
  CHECK(shell.files().empty());
}

TEST_CASE("a process that was started as one of several and does not find the others does nothing", "[command line]") {
  const Shell shell;
  const Outcome first = shell.linden("rollout chain:2 --record a.h5", "SLURM_STEP_NUM_TASKS=4 SLURM_PROCID=0");
  CHECK(first.exit_code == 2);
  CHECK_THAT(first.err, Contains("this is one of 4 processes that were started together"));
  const Outcome other = shell.linden("rollout chain:2 --record a.h5", "SLURM_STEP_NUM_TASKS=4 SLURM_PROCID=2");
  CHECK(other.exit_code == 2);
  CHECK(other.err.empty());
  CHECK(shell.files().empty());
}

/// Runs the program by each rank after a line of the shell.
std::string mpirun_with(const Folder& scripts, int ranks, const std::string& before) {
  scripts.write("rank", "rank=${OMPI_COMM_WORLD_RANK:-$PMI_RANK}\n" + before + "\nexec \"$@\"\n");
  return mpirun(ranks) + fmt::format("sh '{}' ", scripts.file("rank"));
}

TEST_CASE("a full disk at one rank ends all after the same step, with one message and the frames that all have", "[command line]") {
  const Shell shell;
  const Folder scripts;
  const Outcome outcome = shell.linden("rollout chain:3 --instances 40 --duration 100 --record a.h5 --json a.json",
                                       // memory that Open MPI shares is a file too
                                       "OMPI_MCA_btl=self,tcp " + mpirun_with(scripts, 3, "[ $rank = 1 ] && ulimit -f 2000"));
  CHECK(outcome.exit_code == 1);
  const std::vector<std::string> told = messages(outcome);
  INFO(outcome.err);
  REQUIRE(told.size() == 1);
  CHECK_THAT(told[0], StartsWith("linden: a.h5: cannot be written: File too large; it holds ") && Contains("; the rollout ended after "));
  const nlohmann::json json = nlohmann::json::parse(text_of(shell / "a.json"));
  const std::int64_t frames = json.at("frames");
  CHECK(frames > 100);
  CHECK(frames <= json.at("steps"));
  const Arrays arrays = read(shell.file("a.h5"));
  CHECK(arrays.at("q").shape == std::vector<std::int64_t>{frames, 40, 3});
  REQUIRE(shell.linden(fmt::format("rollout chain:3 --instances 40 --duration {} --record b.h5", 1e-3 * static_cast<double>(frames - 1))).exit_code == 0);
  check_equal(arrays, read(shell.file("b.h5")));
}

/// Starts ranks that record, does something to them when all of them do, and waits for the end.
Outcome disturbed(const Shell& shell, int ranks, const std::string& how) {
  const Folder scripts;
  scripts.write("rank", fmt::format("echo $$ > '{}'/pid.${{OMPI_COMM_WORLD_RANK:-$PMI_RANK}}\nexec \"$@\"\n", scripts.path().string()));
  // all have begun their parts, and a second has passed
  scripts.write("disturbed", fmt::format("{} sh '{}/rank' \"$@\" & mpirun=$!\n"
                                         "until [ \"$(ls -d .a.h5.linden.*.part/.*-of-{}.h5.*.part 2>/dev/null | wc -l)\" = {} ]; do sleep 0.05; done\n"
                                         "sleep 1\ncd '{}'\n{}\nwait $mpirun\n",
                                         mpirun(ranks), scripts.path().string(), ranks, ranks, scripts.path().string(), how));
  return shell.linden("rollout chain:3 --instances 30 --duration 100000 --every 100 --record a.h5 --json a.json",
                      fmt::format("sh '{}'", scripts.file("disturbed")));
}

TEST_CASE("a signal to one rank ends all after the same step, with valid files", "[command line]") {
  const Shell shell;
  const Outcome outcome = disturbed(shell, 3, "kill -TERM $(cat pid.1)");
  INFO(outcome.err);
  CHECK(outcome.exit_code == 128 + SIGTERM);
  const std::vector<std::string> told = messages(outcome);
  REQUIRE(told.size() == 1);
  CHECK_THAT(told[0], Contains("interrupted after ") && Contains("; a.h5 is valid up to there"));
  const nlohmann::json json = nlohmann::json::parse(text_of(shell / "a.json"));
  CHECK(json.at("interrupted") == true);
  const std::int64_t steps = json.at("steps");
  CHECK(json.at("env_steps") == 30 * steps);
  const std::int64_t frames = (steps + 99) / 100 + 1;
  CHECK(json.at("frames") == frames);
  REQUIRE(shell.linden(fmt::format("rollout chain:3 --instances 30 --duration {:.3f} --every 100 --record b.h5", 1e-3 * static_cast<double>(steps))).exit_code == 0);
  check_equal(read(shell.file("a.h5")), read(shell.file("b.h5")));
}

TEST_CASE("ranks that are killed while they write leave what was there before, and the next run removes what they began", "[command line]") {
  for (const char* how : {"kill -KILL $(cat pid.1)", "kill -KILL $mpirun $(cat pid.*)"}) {
    INFO(how);
    const Shell shell;
    REQUIRE(shell.linden("rollout chain:2 --instances 6 --duration 0.01 --record a.h5", mpirun(2)).exit_code == 0);
    const Arrays before = read(shell.file("a.h5"));
    const Outcome outcome = disturbed(shell, 3, how);
    CHECK(outcome.exit_code != 0);
    check_equal(read(shell.file("a.h5")), before);
    const Outcome again = shell.linden("rollout chain:2 --instances 6 --duration 0.01 --record a.h5", mpirun(2));
    CHECK(again.exit_code == 0);
    const std::vector<std::string> told = messages(again);
    REQUIRE(told.size() == 1);
    CHECK_THAT(told[0], Contains(".a.h5.linden.") && Contains(".part: removed; it was left by a process that was killed while it wrote a.h5"));
    check_equal(read(shell.file("a.h5")), before);
    CHECK(shell.visible().size() == 2);
  }
}

}  // namespace
}  // namespace linden::mpirun_test
#endif
