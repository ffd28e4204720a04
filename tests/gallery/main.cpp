// tests/gallery/main.cpp
// The program `linden_gallery`: runs the hard cases and says which promises were kept.
//
//   exit codes  0 every promise kept, 1 one broken, 2 bad input
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iterator>

#include "engine/files/output_file.hpp"
#include "engine/program/progress.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "tests/gallery/table.hpp"

namespace linden {
namespace {

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const auto family : {chain_cases, mass_cases, scale_cases, step_cases, orientation_cases, published_cases, stiff_cases,
                            long_cases, rotor_cases, loop_cases, contact_cases, batch_cases, random_cases, refusal_cases}) {
    std::ranges::move(family(), std::back_inserter(cases));
  }
  return cases;
}

Shown shown(const Case& one, Form form, bool peers) {
  const auto begin = Progress::Clock::now();
  Shown result{&one, Report(form, peers), 0};
  try {
    one.measure(result.report);
  } catch (const std::exception& error) {
    result.report.at_most("exceptions", 1, 0, error.what());
  }
  result.seconds = seconds(Progress::Clock::now() - begin);
  return result;
}

int run_gallery(int argc, char** argv) {
  CLI::App program("Runs cases that are hard for engines of rigid bodies, and holds linden to what it promises.",
                   "linden_gallery");
  bool full = false, quick = false, list = false, alone = false;
  std::vector<std::string> names;
  std::string csv, markdown;
  program.add_flag("--full", full, "Long runs and large sizes: five to ten minutes, instead of half a minute");
  program.add_flag("--quick", quick, "Shorter still: for builds with sanitizers");
  program.add_flag("--list", list, "Name the cases");
  program.add_flag("--alone", alone, "No other engine, even where one is installed");
  program.add_option("--case", names, "Run these alone; a name or its beginning");
  program.add_option("--csv", csv, "Write a table with a row for each promise");
  program.add_option("--markdown", markdown, "Write the table of the documentation");
  try {
    program.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    fmt::print("{}", program.help());
    return 0;
  } catch (const CLI::ParseError& error) {
    throw InputError(fmt::format("{}; linden_gallery --help says more", error.what()));
  }
  if (full && quick) throw InputError("--full and --quick: expected one of them");
  const Outputs writable{{"--csv", csv, {}}, {"--markdown", markdown, {}}};

  const std::vector<Case> cases = all_cases();
  // a whole name stands for itself, another for all that begin so
  const auto named = [&](const Case& one, const std::string& name) {
    return std::ranges::find(cases, name, &Case::name) != cases.end() ? one.name == name : one.name.starts_with(name);
  };
  for (const std::string& name : names) {
    if (std::ranges::none_of(cases, [&](const Case& one) { return named(one, name); })) {
      throw InputError(fmt::format("--case \"{}\": no case begins so; linden_gallery --list names them", name));
    }
  }
  const auto chosen = [&](const Case& one) {
    return names.empty() || std::ranges::any_of(names, [&](const std::string& name) { return named(one, name); });
  };
  const Form form = full ? Form::full : quick ? Form::quick : Form::brief;
  std::vector<Shown> gallery;
  double total = 0;
  for (const Case& one : cases) {
    if (!chosen(one)) continue;
    if (list) {
      fmt::print("{:<24} {}\n", one.name, one.hard);
      continue;
    }
    gallery.push_back(shown(one, form, !alone));
    total += gallery.back().seconds;
    fmt::print("{}", text_of(gallery.back()));
    std::fflush(stdout);
  }
  if (list) return 0;
  if (!csv.empty()) write_file(csv, csv_of(gallery));
  if (!markdown.empty()) write_file(markdown, markdown_of(gallery));
  const auto broken = std::ranges::count_if(gallery, [](const Shown& one) { return !one.report.kept(); });
  fmt::print("{} in {:.0f} s, {} broken\n", counted(static_cast<std::int64_t>(gallery.size()), "case"), total, broken);
  return broken == 0 ? 0 : 1;
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  try {
    return linden::run_gallery(argc, argv);
  } catch (const linden::InputError& error) {
    fmt::print(stderr, "linden_gallery: {}\n", linden::printable(error.what()));
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "linden_gallery: {}\n", linden::printable(error.what()));
    return 1;
  }
}
