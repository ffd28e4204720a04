#include <catch2/catch.hpp>
#include <random>
#include <string>

#include "engine/view/page_template.hpp"
#include "tests/engine/live_client.hpp"

namespace linden::live_view_test {
namespace {

const std::string kArm = LINDEN_MODELS_DIR "/scenes/arm_servo.yaml";
const std::string kDrop = LINDEN_MODELS_DIR "/scenes/humanoid_drop.yaml";

bool shows_pages() { return !page_template().empty(); }

/// Bytes that mean nothing, or nearly something.
std::string noise(std::mt19937& random, std::size_t most, const std::string& like) {
  std::string bytes(random() % most, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  if (random() % 2 == 0) {
    bytes = like;
    for (int k = 0; k < 4; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
  }
  return bytes;
}

TEST_CASE("a live page is served to its own address, and to nobody who calls this machine something else") {
  if (!shows_pages()) return;
  const LiveProgram program("chain:2");
  const std::string port = std::to_string(program.port());
  for (const std::string host : {"localhost", "127.0.0.1", "[::1]", "LocalHost"}) {
    for (const std::string& with : {host, host + ":" + port, host + ":9000"}) {
      const std::string page = asked(program, "/", "", with);
      INFO(with);
      CHECK(page.starts_with("HTTP/1.1 200 OK"));
      CHECK_THAT(page, Contains("\"live\":{\"session\":") && Contains("X-Frame-Options: DENY") && Contains("no-store") && Contains("</html>"));
    }
  }
  for (const std::string& host : std::vector<std::string>{"evil.example", "evil.example:" + port, "127.0.0.1.evil.example", "localhost.", "10.0.0.1", "127.0.0.1:80:80", "127.0.0.1@evil.example", "[::1", ""}) {
    INFO(host);
    CHECK(asked(program, "/", "", host).starts_with("HTTP/1.1 403"));
    CHECK(asked(program, "/stream", kUpgrade, host).starts_with("HTTP/1.1 403"));
  }
  CHECK(asked(program, "/", "Host: localhost\r\n", "evil.example").starts_with("HTTP/1.1 40"));
  const std::string own = "localhost:" + port;
  for (const std::string& origin : std::vector<std::string>{"http://evil.example", "null", "https://" + own, "http://localhost", "http://" + own + "/", "file://", ""}) {
    INFO(origin);
    CHECK(asked(program, "/stream", "Origin: " + origin + "\r\n" + kUpgrade, own).starts_with("HTTP/1.1 403"));
  }
  Client same(program.port());
  same.send("GET /stream HTTP/1.1\r\nHost: " + own + "\r\nOrigin: http://" + own + "\r\n" + kUpgrade + "\r\n");
  CHECK(same.read_header().starts_with("HTTP/1.1 101"));
}

TEST_CASE("a live page answers what it does not know, and what is too long, in one sentence") {
  if (!shows_pages()) return;
  const LiveProgram program("chain:2");
  CHECK_THAT(asked(program, "/other"), StartsWith("HTTP/1.1 404") && Contains("nothing here but / and /stream."));
  CHECK_THAT(asked(program, "/../../etc/passwd"), StartsWith("HTTP/1.1 404"));
  CHECK_THAT(asked(program, "/", "", "localhost", "DELETE"), StartsWith("HTTP/1.1 405"));
  CHECK_THAT(asked(program, "/stream"), StartsWith("HTTP/1.1 426"));
  CHECK_THAT(asked(program, "/", "X: " + std::string(100'000, 'a') + "\r\n"), StartsWith("HTTP/1.1 431"));
  CHECK_THAT(asked(program, "/", "Content-Length: 1000000000\r\n"), StartsWith("HTTP/1.1 413"));
  CHECK_THAT(asked(program, "/", "", "localhost", "\x01\x02"), StartsWith("HTTP/1.1 400"));
}

TEST_CASE("bytes of strangers end their own connection and nothing else") {
  if (!shows_pages()) return;
  LiveProgram program("chain:2");
  std::mt19937 random(7);
  for (int k = 0; k < 100; ++k) {
    Client client(program.port());
    client.send(noise(random, 3000, "GET /stream HTTP/1.1\r\nHost: localhost\r\n" + kUpgrade + "\r\n"));
    client.end();
    client.read_to_end();
  }
  // frames of the protocol, torn and false, of a watcher
  for (int k = 0; k < 40; ++k) {
    LiveClient watcher(program);
    watcher.send_bytes(noise(random, 300, std::string("\x81\x8d\0\0\0\0{\"do\":\"run\"}", 19)));
  }
  // and messages that are no commands
  LiveClient watcher(program);
  for (int k = 0; k < 300; ++k) {
    std::string text = noise(random, 200, R"({"do": "pull", "body": 1, "point": [0, 0, 0], "to": [1e3, 0, 1]})");
    for (char& c : text) c = static_cast<char>(c & 127);
    REQUIRE(watcher.send(text));
    if (k % 8 == 7) {
      // whatever else it may have been, this is none, and is answered
      watcher.send("{}");
      while (watcher.text("error")["message"].get<std::string>().find("does nothing") == std::string::npos) {}
    }
  }
  CHECK(asked(program).starts_with("HTTP/1.1 200"));
  CHECK(program.interrupt() == 0);
}

TEST_CASE("a live simulation begins with its first page, and does what pages say") {
  if (!shows_pages()) return;
  const LiveProgram program("'" + kArm + "'");
  LiveClient watcher(program);
  const nlohmann::json first = watcher.status("state", "running");
  CHECK(first["targets"].size() == 7);
  CHECK(first["speed"] == 1);
  while (LiveClient::head(watcher.frame()).steps < 100) {}

  watcher.send(R"({"do": "pause"})");
  watcher.status("state", "paused");
  const LiveHead paused = LiveClient::head(watcher.frame());
  watcher.send(R"({"do": "step", "steps": 5})");
  LiveHead now = paused;
  while (now.steps == paused.steps) now = LiveClient::head(watcher.frame());
  CHECK(now.steps == paused.steps + 5);
  CHECK(now.time == Approx(1e-3 * now.steps));

  watcher.send(R"({"do": "target", "servo": 2, "value": 0.25})");
  nlohmann::json status = watcher.text("status");
  while (status["targets"][2] != 0.25) status = watcher.text("status");
  watcher.send(R"({"do": "speed", "factor": 4})");
  CHECK(watcher.status("speed", 4)["state"] == "paused");

  watcher.send(R"({"do": "reset"})");
  watcher.status("targets", first["targets"]);
  do now = LiveClient::head(watcher.frame());
  while (now.episode == paused.episode);
  CHECK(now.episode == paused.episode + 1);
  CHECK(now.steps == 0);
}

TEST_CASE("a pull draws a body towards its place, until it is released or its page has gone") {
  if (!shows_pages()) return;
  const LiveProgram program("chain:3 --gravity 0,0,0");
  LiveClient watcher(program);
  watcher.status("state", "running");
  // the last of three bodies, whose place is at numbers 4 to 6 of its seven
  const auto place = [&](const std::string& frame) { return std::array{LiveClient::number(frame, 18), LiveClient::number(frame, 19), LiveClient::number(frame, 20)}; };
  const auto begin = place(watcher.frame());
  {
    LiveClient other(program);
    other.send(fmt::format(R"({{"do": "pull", "body": 2, "point": [0, 0, 0], "to": [{}, {}, {}]}})", begin[0] - 0.1, begin[1], begin[2] + 0.1));
    std::string frame = other.frame();
    while (place(frame)[2] < begin[2] + 0.03F) frame = other.frame();
    CHECK(LiveClient::head(frame).pulls == 1);
  }
  while (LiveClient::head(watcher.frame()).pulls != 0) {}
}

TEST_CASE("commands that are none are refused in one sentence, and the connection stays") {
  if (!shows_pages()) return;
  const LiveProgram program("chain:3");
  LiveClient watcher(program);
  const auto refused = [&](const std::string& text, const std::string& expected) {
    INFO(text);
    REQUIRE(watcher.send(text));
    CHECK_THAT(watcher.text("error").value("message", ""), Contains(expected));
  };
  refused("nonsense", "no JSON");
  refused("[1, 2]", "no object");
  refused(std::string(2000, '['), "no JSON");
  refused("{\"do\": \"<script>alert(1)</script>\"}", "is not known");
  refused(R"({"do": "step"})", "without steps");
  refused(R"({"do": "step", "steps": 1e99})", "a whole number from 1 to 100000");
  refused(R"({"do": "step", "steps": -1})", "a whole number");
  refused(R"({"do": "step", "steps": 18446744073709551615})", "a whole number");
  refused(R"({"do": "run", "fast": true})", "nothing else");
  refused(R"({"do": "speed", "factor": 0})", "from 0.001 to 1000");
  refused(R"({"do": "target", "servo": 0, "value": 1})", "there is one");
  refused(R"({"do": "pull", "body": 3, "point": [0, 0, 0], "to": [0, 0, 0]})", "from 0 to 2");
  refused(R"({"do": "pull", "body": 0, "point": [0, 0], "to": [0, 0, 0]})", "three numbers");
  refused(R"({"do": "pull", "body": 0, "point": [0, 0, null], "to": [0, 0, 1e300]})", "three numbers");
  REQUIRE(watcher.send("{\"do\": \"pause\"}", 2));
  CHECK_THAT(watcher.text("error").value("message", ""), Contains("expected text"));
  // what is too long ends the connection
  watcher.send(std::string(5000, 'a'));
  CHECK(watcher.text("error").empty());
}

TEST_CASE("a watcher who never reads keeps neither the simulation nor another watcher waiting") {
  if (!shows_pages()) return;
  LiveProgram program("chain:300");
  LiveClient deaf(program, 4096);
  LiveClient watcher(program);
  watcher.status("state", "running");
  // far more than what lies between the program and the deaf one can hold
  std::size_t bytes = 0;
  LiveHead head{};
  int frames = 0;
  while (bytes < (5U << 19)) {
    const std::string frame = watcher.frame();
    const LiveHead now = LiveClient::head(frame);
    CHECK(now.steps > head.steps);
    head = now;
    bytes += frame.size();
    ++frames;
  }
  CHECK(frames > 50);
  // what the deaf one finds in the end are frames of long ago and then those of now: the others were left out
  LiveHead heard = LiveClient::head(deaf.frame());
  int read = 1;
  while (heard.steps < head.steps) {
    heard = LiveClient::head(deaf.frame());
    ++read;
  }
  CHECK(read < frames);
  // and one who says much and hears nothing of the refusals is let go
  LiveClient rude(program, 4096);
  while (rude.send("nonsense")) {}
  CHECK(program.interrupt() == 0);
}

TEST_CASE("more pages than may watch are refused, and there is room again when one has gone") {
  if (!shows_pages()) return;
  const LiveProgram program("chain:2");
  std::vector<std::unique_ptr<LiveClient>> watchers;
  for (int k = 0; k < 32; ++k) watchers.push_back(std::make_unique<LiveClient>(program));
  CHECK_THAT(asked(program, "/stream", kUpgrade), StartsWith("HTTP/1.1 503") && Contains("32 pages watch already"));
  watchers.pop_back();
  bool room = false;
  while (!room) {
    Client client(program.port());
    client.send("GET /stream HTTP/1.1\r\nHost: localhost\r\n" + kUpgrade + "\r\n");
    room = client.read_header().starts_with("HTTP/1.1 101");
  }
}

TEST_CASE("a live simulation that fails says why, and a reset begins again") {
  if (!shows_pages()) return;
  LiveProgram program("chain:10 --dt 0.5 --seed 3 --spread 40");
  LiveClient watcher(program);
  const nlohmann::json failed = watcher.status("state", "failed");
  CHECK_THAT(failed.value("message", ""), Contains("a step of 0.5 s is too large"));
  watcher.send(R"({"do": "reset"})");
  CHECK(watcher.status("state", "paused")["message"] == "");
  CHECK_THAT(program.errors(), Contains("the simulation has failed: "));
}

TEST_CASE("a live view ends at once by any signal, whoever watches") {
  if (!shows_pages()) return;
  for (const int signal : {SIGINT, SIGTERM}) {
    LiveProgram program("'" + kDrop + "'");
    LiveClient deaf(program, 4096);
    LiveClient watcher(program);
    watcher.frame();
    CHECK(program.interrupt(signal) == 0);
    CHECK(program.errors() == "");
    while (watcher.read().kind != 8) {}
  }
  LiveProgram unseen("chain:2");
  CHECK(unseen.interrupt() == 0);
}

TEST_CASE("a live view that makes no sense is refused") {
  if (!shows_pages()) return;
  const LiveProgram program("chain:2");
  const Shell shell;
  check_refused(shell, fmt::format("view chain:2 --live --port {}", program.port()), "has it in use already");
  check_refused(shell, "view chain:2 --live --port 70000", "--port 70000: expected a whole number from 0 to 65535");
  check_refused(shell, "view chain:2 --live --port x", "--port");
  check_refused(shell, "view chain:2 --live --bind example.org", "--bind example.org: expected an address of this machine");
  check_refused(shell, "view chain:2 --live --bind 192.0.2.1", "--bind 192.0.2.1: this machine has no such address");
  check_refused(shell, "view chain:2 --port 8470", "give --live too");
  check_refused(shell, "view motion.npz --model chain:2 --live", "motion.npz is a recording");
  for (const std::string with : {"--view a.html", "--gltf a.glb", "--duration 3", "--size 640x480"}) {
    check_refused(shell, "view chain:2 --live " + with, with.substr(0, with.find(' ')) + ": --live shows the simulation until Ctrl-C");
  }
  check_refused(shell, "view nowhere.urdf --live --port 0", "nowhere.urdf");
}

}  // namespace
}  // namespace linden::live_view_test
