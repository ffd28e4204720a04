#include <catch2/catch.hpp>
#include <string>

#include "engine/view/page_template.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::view_command_test {
namespace {

const std::string kHumanoid = LINDEN_MODELS_DIR "/humanoid.urdf";
const std::string kDrop = LINDEN_MODELS_DIR "/scenes/humanoid_drop.yaml";

bool has_page() { return !page_template().empty(); }

/// A number of the page's header.
std::int64_t number_in(const std::string& page, const std::string& key) {
  const std::size_t at = page.find("\"" + key + "\":", page.find("linden-header"));
  REQUIRE(at != page.npos);
  return std::stoll(page.substr(at + key.size() + 3));
}

TEST_CASE("a model is shown as it stands, a scene as it moves, each in a page called after it") {
  if (!has_page()) return;
  const Shell shell;
  const Outcome still = shell.linden("view '" + kHumanoid + "' --base floating");
  CHECK(still.err == "");
  CHECK(still.exit_code == 0);
  CHECK_THAT(still.out, Contains("humanoid.html: 1 frame, "));
  CHECK(number_in(text_of(shell / "humanoid.html"), "frames") == 1);
  const Outcome moving = shell.linden("view '" + kDrop + "' --duration 0.1");
  CHECK(moving.exit_code == 0);
  CHECK_THAT(moving.out, Contains("humanoid_drop.html: 7 frames, "));
  CHECK(number_in(text_of(shell / "humanoid_drop.html"), "frames") == 7);
  CHECK(shell.files() == std::set<std::string>{"humanoid.html", "humanoid_drop.html"});
}

TEST_CASE("what is shown beside a run or a rollout changes nothing of it") {
  if (!has_page()) return;
  const Shell shell;
  const std::string run = "run '" + kDrop + "' --duration 0.3 --record ";
  REQUIRE(shell.linden(run + "a.csv").exit_code == 0);
  const Outcome shown = shell.linden(run + "b.csv --view b.html --gltf b.glb --fps 50");
  REQUIRE(shown.exit_code == 0);
  CHECK_THAT(shown.out, Contains("b.html: 16 frames") && Contains("b.glb: 16 frames"));
  CHECK(text_of(shell / "a.csv") == text_of(shell / "b.csv"));
  CHECK(text_of(shell / "b.glb").starts_with("glTF"));
  const std::string rollout = "rollout chain:3 --instances 20 --duration 0.1 --record ";
  REQUIRE(shell.linden(rollout + "a.npz").exit_code == 0);
  const Outcome some = shell.linden(rollout + "b.npz --view some.html --shown 4");
  REQUIRE(some.exit_code == 0);
  CHECK_THAT(some.err, Contains("the first 4 of 20 instances"));
  CHECK(number_in(text_of(shell / "some.html"), "instances") == 4);
  CHECK(text_of(shell / "a.npz") == text_of(shell / "b.npz"));
}

TEST_CASE("a recording is shown as the run that made it, whatever its format") {
  if (!has_page()) return;
  const Shell shell;
  const std::string run = "run '" + kHumanoid + "' --base floating --duration 0.2 --seed 3 --dt 0.01 --fps 100 --gltf run.glb --record ";
  for (const std::string ending : {"npz", "h5", "csv"}) {
    INFO(ending);
    REQUIRE(shell.linden(run + "motion." + ending).exit_code == 0);
    const Outcome shown = shell.linden("view motion." + ending + " --model '" + kHumanoid + "' --base floating --fps 100 --gltf again.glb");
    CHECK(shown.exit_code == 0);
    CHECK_THAT(shown.out, Contains("again.glb: 21 frames"));
    CHECK(text_of(shell / "again.glb") == text_of(shell / "run.glb"));
  }
}

TEST_CASE("what cannot be shown is refused before anything is done") {
  const Shell shell;
  shell.write("motion.npz", "nothing");
  check_refused(shell, "view motion.npz", "--model has to say what it was recorded of");
  check_refused(shell, "view motion.npz --model chain:3", "motion.npz: ");
  check_refused(shell, "view motion.npz --model chain:3 --seed 1", "--seed 1: motion.npz is a recording");
  check_refused(shell, "view chain:3 --model chain:3", "--model is about recordings");
  check_refused(shell, "view chain:3 --view page.htm", "expected .html");
  check_refused(shell, "view chain:3 --gltf page.html", "expected .glb");
  check_refused(shell, "view chain:3 --fps 0", "--fps 0");
  check_refused(shell, "run chain:3 --fps 30", "--fps says what --view");
  check_refused(shell, "view chain:3 --moments 1", "--moments are those of a picture");
  check_refused(shell, "view chain:3 --size 100x100", "--size is about pictures");
  check_refused(shell, "rollout chain:3 --shown 3", "--shown says which instances");
  check_refused(shell, "rollout chain:3 --shown 0 --view a.html", "--shown 0");
  check_refused(shell, "view nowhere.urdf", "nowhere.urdf");
}

TEST_CASE("a recording of another model is refused by the name of a position") {
  if (!has_page()) return;
  const Shell shell;
  REQUIRE(shell.linden("run chain:3 --duration 0.01 --record chain.npz").exit_code == 0);
  check_refused(shell, "view chain.npz --model '" + kHumanoid + "'", "chain.npz: position ");
}

TEST_CASE("pictures need a browser, which is said before the first step") {
  const Shell shell;
  const auto refused = [&](const std::string& arguments, const std::string& before, const std::string& expected) {
    const Outcome outcome = shell.linden(arguments, before);
    CHECK(outcome.exit_code == 2);
    CHECK_THAT(outcome.err, StartsWith("linden: ") && Contains(expected));
    CHECK(shell.files().empty());
  };
  refused("view chain:3 --picture a.png", "LINDEN_BROWSER= PATH=/nowhere", "--picture: no Chromium to draw with was found");
  refused("view chain:3 --film a.mp4", "LINDEN_BROWSER= PATH=/nowhere", "--film: no Chromium");
  refused("view chain:3 --picture a.png", "LINDEN_BROWSER=/nowhere/chrome", "LINDEN_BROWSER names /nowhere/chrome");
  refused("view chain:3 --picture a.png --look azimut=3", "LINDEN_BROWSER=/bin/true", "did you mean azimuth=?");
  refused("view chain:3 --picture a.png --look theme=blue", "LINDEN_BROWSER=/bin/true", "expected light or dark");
  refused("view chain:3 --picture a.png --size 101x100", "LINDEN_BROWSER=/bin/true", "even numbers from 64 to 4096");
  refused("view chain:3 --picture a.png --look follow=link_9", "LINDEN_BROWSER=/bin/true", "--look follow=link_9: chain:3 has no body of that name");
  refused("run chain:3 --duration 1 --picture a.png --moments 0,2", "LINDEN_BROWSER=/bin/true", "--moments 2: the motion ends at 1 s");
  refused("view chain:3 --picture a.png --moments 0,x", "LINDEN_BROWSER=/bin/true", "--moments");
}

TEST_CASE("a browser that is none leaves no picture, and says so") {
  if (!has_page()) return;
  const Shell shell;
  const Outcome outcome = shell.linden("view chain:3 --picture a.png --view a.html", "LINDEN_BROWSER=/bin/true");
  CHECK(outcome.exit_code == 1);
  CHECK_THAT(outcome.err, Contains("the browser that draws pictures has ended by itself"));
  CHECK(shell.files() == std::set<std::string>{"a.html"});
}

}  // namespace
}  // namespace linden::view_command_test
