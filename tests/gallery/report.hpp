// tests/gallery/report.hpp
// What a case of the gallery has to show: numbers, each held to a bound for which there is a reason.
//
//   void long_chain(Report& report) {
//     const RunRecord record = run(scenario);
//     report.at_most("energy error [J]", record.energy_error, record.second_order, "what second order leaves at this step");
//     report.note("iterations 1.2");
//   }
//
// A number that is not finite is within no bound. What is only told and held to nothing is a note.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace linden {

/// How much of a case is run: under sanitizers, in CI, by whoever wants to know.
enum class Form : std::uint8_t { quick, brief, full };

struct Promise {
  std::string what;  // with its unit
  double measured, bound;
  bool at_least;
  std::string reason;  // for the bound

  bool kept() const { return at_least ? measured >= bound : measured <= bound; }
};

/// What another engine made of the same scenario.
struct Besides {
  std::string engine;
  std::string found;
};

class Report {
 public:
  explicit Report(Form form, bool peers = false) : form_(form), peers_(peers) {}

  Form form() const { return form_; }
  bool peers() const { return peers_; }
  template <class T>
  T pick(T quick, T brief, T full) const {
    return form_ == Form::quick ? quick : form_ == Form::brief ? brief : full;
  }

  void at_most(std::string what, double measured, double bound, std::string reason) {
    promises_.push_back({std::move(what), measured, bound, false, std::move(reason)});
  }
  void at_least(std::string what, double measured, double bound, std::string reason) {
    promises_.push_back({std::move(what), measured, bound, true, std::move(reason)});
  }
  void note(std::string text) { notes_.push_back(std::move(text)); }
  void beside(std::string engine, std::string found) { besides_.push_back({std::move(engine), std::move(found)}); }

  bool kept() const;
  const std::vector<Promise>& promises() const { return promises_; }
  const std::vector<std::string>& notes() const { return notes_; }
  const std::vector<Besides>& besides() const { return besides_; }

 private:
  Form form_;
  bool peers_;
  std::vector<Promise> promises_;
  std::vector<std::string> notes_;
  std::vector<Besides> besides_;
};

struct Case {
  std::string name;
  std::string hard;  // what is hard, in the words of those whom it troubles
  std::function<void(Report&)> measure;
  std::string story;  // what was wrong when it first failed and what made it right, or where nature sets the limit; empty: it
                      // never failed
};

/// The families, each in a file of its own.
std::vector<Case> chain_cases();
std::vector<Case> mass_cases();
std::vector<Case> scale_cases();
std::vector<Case> step_cases();
std::vector<Case> orientation_cases();
std::vector<Case> published_cases();
std::vector<Case> stiff_cases();
std::vector<Case> long_cases();
std::vector<Case> rotor_cases();
std::vector<Case> loop_cases();
std::vector<Case> contact_cases();
std::vector<Case> batch_cases();
std::vector<Case> random_cases();
std::vector<Case> refusal_cases();

}  // namespace linden
