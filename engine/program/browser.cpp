#include "engine/program/browser.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "engine/view/base64.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(fmt::format("the browser that draws pictures {}", what)); }

/// A path as the address of a file.
std::string address_of(const std::string& path) {
  std::string address = "file://";
  for (const char c : fs::absolute(path).string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/' || c == '-' || c == '_' || c == '.';
    address += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return address;
}

std::vector<std::string> words_of(const std::string& program, const std::string& profile, int width, int height) {
  std::vector<std::string> words{program,
                                 "--headless=new",
                                 "--remote-debugging-pipe",
                                 "--user-data-dir=" + profile,
                                 fmt::format("--window-size={},{}", width, height),
                                 "--hide-scrollbars",
                                 "--mute-audio",
                                 "--no-first-run",
                                 "--no-default-browser-check",
                                 "--disable-background-networking",
                                 "--disable-component-update",
                                 "--disable-sync",
                                 "--disable-quic",
                                 "--disable-dev-shm-usage",
                                 "--use-angle=swiftshader",
                                 "--enable-unsafe-swiftshader",  // WebGL in software, for a page that linden wrote itself
                                 "about:blank"};
  if (geteuid() == 0) words.insert(words.begin() + 1, "--no-sandbox");  // which root cannot have
  return words;
}

}  // namespace

std::string find_browser(const std::string& option) {
  if (const char* const named = std::getenv("LINDEN_BROWSER"); named && *named) {
    if (access(named, X_OK) == 0) return named;
    throw InputError(fmt::format("{}: LINDEN_BROWSER names {}, which cannot be run; expected the path of Chromium", option, named));
  }
  for (const char* const name : {"chromium", "chromium-browser", "google-chrome", "google-chrome-stable"}) {
    if (const std::string found = find_program(name); !found.empty()) return found;
  }
  throw InputError(fmt::format("{}: no Chromium to draw with was found; install it (apt-get install chromium), or let LINDEN_BROWSER name it",
                               option));
}

Browser::Browser(const std::string& page, const std::string& profile, int width, int height, const std::string& look) {
  const std::string program = find_browser("picture");
  process_.emplace(words_of(program, fs::absolute(profile).string(), width, height),
                   std::vector<std::pair<int, int>>{{commands_.read_end(), 3}, {answers_.write_end(), 4}});
  commands_.close_read();
  answers_.close_write();

  const auto target = call("Target.createTarget", {{"url", "about:blank"}});
  session_ = call("Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}}).at("sessionId").get<std::string>();
  call("Emulation.setDeviceMetricsOverride", {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
  call("Page.navigate", {{"url", address_of(page) + "#" + look}});  // is answered when the page has taken the place of the one before
  // what is wrong with the page it says in a sentence
  evaluate("new Promise((yes) => { const wait = () => window.linden ? yes(window.linden.ready) : setTimeout(wait, 10); wait(); })"
           ".then((fault) => { if (fault) throw new Error(fault); })");
}

void Browser::show(double seconds) { evaluate(fmt::format("window.linden.show({:.9g})", seconds)); }

std::string Browser::picture() {
  return from_base64(call("Page.captureScreenshot", {{"format", "png"}}).at("data").get<std::string>());
}

void Browser::evaluate(const std::string& expression) {
  const auto result = call("Runtime.evaluate", {{"expression", fmt::format("Promise.resolve({}).then(() => null)", expression)}, {"awaitPromise", true}});
  if (!result.contains("exceptionDetails")) return;
  const auto& details = result.at("exceptionDetails");
  fail(fmt::format("could not show the page: {}",
                   details.contains("exception") ? details.at("exception").value("description", "unknown") : details.value("text", "unknown")));
}

nlohmann::json Browser::call(const std::string& method, const nlohmann::json& parameters) {
  nlohmann::json message{{"id", ++calls_}, {"method", method}, {"params", parameters}};
  if (!session_.empty()) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  if (!commands_.write_all(text.data(), text.size())) fail("has ended by itself");
  return answer(calls_);
}

nlohmann::json Browser::answer(int id) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + std::chrono::seconds(60);
  while (true) {
    for (std::size_t stop; (stop = read_.find('\0')) != read_.npos;) {
      const nlohmann::json message = nlohmann::json::parse(read_.substr(0, stop));
      read_.erase(0, stop + 1);
      if (message.value("id", 0) != id) continue;  // an event
      if (message.contains("error")) fail(fmt::format("refused: {}", message.at("error").value("message", "unknown")));
      return message.at("result");
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd wait{answers_.read_end(), POLLIN, 0};
    if (left <= 0 || (poll(&wait, 1, static_cast<int>(left)) == 0)) fail("did not answer in a minute");
    std::array<char, 1 << 16> bytes;
    const ssize_t count = read(answers_.read_end(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) fail("has ended by itself");
    read_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace linden
