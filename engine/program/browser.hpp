// engine/program/browser.hpp
// Pictures of a page without a display: Chromium, headless, told what to do over a pipe (the Chrome DevTools Protocol). It draws in software
// where there is no graphics card, comes from Debian's packages, and what it shows is the page that people open themselves: a second
// renderer would be a second look.
//
//   Browser browser(page, profile, 1280, 720, "theme=dark");
//   browser.show(0.5);                     simulated time [s]
//   const std::string png = browser.picture();
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "engine/program/child_process.hpp"

namespace linden {

class Browser {
 public:
  /// The program that find_browser found, which opens the page (an HTML file) in a window of so many pixels. `profile`: a folder that it makes
  /// and keeps its own files in, which must outlive it. `look`: what is behind the # of the address. Throws std::runtime_error where it does not start, where the page complains, and where it does not answer in a minute.
  Browser(const std::string& page, const std::string& profile, int width, int height, const std::string& look);
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void show(double seconds);
  /// PNG.
  std::string picture();

 private:
  nlohmann::json call(const std::string& method, const nlohmann::json& parameters);
  nlohmann::json answer(int id);
  void evaluate(const std::string& expression);

  Pipe commands_, answers_;
  std::optional<ChildProcess> process_;
  int calls_ = 0;
  std::string session_, read_;
};

/// Path of Chromium: what LINDEN_BROWSER names, else chromium, chromium-browser, google-chrome of PATH. Throws InputError that begins with
/// `option` where there is none.
std::string find_browser(const std::string& option);

}  // namespace linden
