#include "engine/program/couplings_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "engine/files/report_files.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"

namespace linden {
namespace {

/// "rocker and shank", "+1 crank -2 wheel", "world - boom - load"
std::string between(const Model& model, const Coupling& coupling) {
  if (coupling.kind == CouplingKind::gear) {
    std::vector<std::string> joints;
    for (const GearTerm& term : coupling.terms) {
      joints.push_back(fmt::format("{:+g} {}", term.ratio, printable(model.names.velocity[static_cast<std::size_t>(term.v_row)])));
    }
    return fmt::format("{}", fmt::join(joints, " "));
  }
  const auto body = [&](Index slot) { return printable(model.names.body[static_cast<std::size_t>(slot)]); };
  if (coupling.kind == CouplingKind::cable) {
    std::vector<std::string> bodies;
    for (const CablePoint& point : coupling.points) bodies.push_back(body(point.slot));
    return fmt::format("{}", fmt::join(bodies, " - "));
  }
  return body(coupling.slot_a) + " and " + body(coupling.slot_b);
}

/// Rows that other rows hold already, counted from 1: "2, 4".
std::string held_already(const CouplingState& state) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < state.redundant.size(); ++row) {
    if (state.redundant[row]) rows.push_back(row + 1);
  }
  return rows.empty() ? "-" : fmt::format("{}", fmt::join(rows, ", "));
}

double largest_gap(const CouplingState& state) {
  double largest = 0;
  for (const double gap : state.gaps) largest = std::max(largest, std::abs(gap));
  return largest;
}

/// Times what the tree takes itself, that are worth another look at where loops are cut.
constexpr double kDear = 4;

/// "pin", "rung0 and 39 more"
std::string names_of(const Model& model, const ClosureWork& closure) {
  const std::string first = printable(model.couplings[static_cast<std::size_t>(closure.couplings.front())].name);
  const auto others = std::ssize(closure.couplings) - 1;
  return others == 0 ? first : fmt::format("{} and {} more", first, grouped(others));
}

}  // namespace

void say_couplings(const Model& model, const Mobility& mobility, std::size_t count) {
  using Align = Table::Align;
  Table table({{"name", Align::left},
               {"kind", Align::left},
               {"between", Align::left},
               {"rows", Align::right},
               {"held already", Align::left},
               {"gap", Align::right}});
  for (std::size_t k = 0; k < count; ++k) {
    const CouplingState& state = mobility.couplings[k];
    table.add({printable(state.name), kind_text(model.couplings[k]), between(model, model.couplings[k]), fmt::format("{}", state.gaps.size()),
               held_already(state), fmt::format("{:.1e}", largest_gap(state))});
  }
  say_text(table.text("  "));
  if (count < model.couplings.size()) {
    say("  ... and {} more; --all prints them\n", grouped(static_cast<std::int64_t>(model.couplings.size() - count)));
  }
  if (mobility.held_already > 0) {
    say("  held already: {} of {} follow from the others here, axes being taken for parallel within 3e-5; nothing pushes along\n"
        "  them, and the forces of the others are those that hold the motion without them\n",
        counted(mobility.held_already, "row"), grouped(mobility.rows));
  }
  if (mobility.freedom <= 0) say("  nothing can move: couplings hold every degree of freedom here\n");
  if (!mobility.openness.closed) {
    say("  {} is open by {:.3g}: give positions that close it, or write assemble: true in a scene\n", printable(mobility.openness.coupling),
        mobility.openness.gap);
  }
}

nlohmann::ordered_json couplings_json(const Model& model, const Mobility& mobility) {
  nlohmann::ordered_json couplings = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < model.couplings.size(); ++k) {
    const CouplingState& state = mobility.couplings[k];
    couplings.push_back({{"name", state.name},
                         {"kind", name_of(model.couplings[k].kind)},
                         {"between", between(model, model.couplings[k])},
                         {"gives_way", gives_way(model.couplings[k])},
                         {"gaps", state.gaps},
                         {"held_already", state.redundant}});
  }
  return couplings;
}


void say_closures(const Model& model, const std::vector<ClosureWork>& closures, std::size_t count) {
  using Align = Table::Align;
  const double tree = kTreeFactorOperations * model.tree.bodies();
  Table table({{"closes at", Align::left},
               {"couplings", Align::left},
               {"rows", Align::right},
               {"velocities", Align::right},
               {"operations", Align::right},
               {"of the tree's", Align::right}});
  for (const ClosureWork& one : std::span(closures).first(count)) {
    table.add({printable(model.names.body[static_cast<std::size_t>(one.slot)]), names_of(model, one), grouped(one.rows), grouped(one.velocities),
               fmt::format("{:.1e}", one.operations), fmt::format("{:.2g}", one.operations / tree)});
  }
  say_text(table.text("  "));
  if (count < closures.size()) say("  ... and {} more; --all prints them\n", grouped(static_cast<std::int64_t>(closures.size() - count)));
  double sum = 0;
  for (const ClosureWork& one : closures) sum += one.operations;
  say("  a factor takes {:.1e} operations for all of them, {:.2g} of the tree's own; velocities: of all joints on their paths\n", sum, sum / tree);
  const ClosureWork& dearest = closures.front();
  if (dearest.couplings.size() == 1 || dearest.operations < kDear * tree) return;
  say("  dear: {} that close at {} take {:.2g} times what the tree itself does, since their loops share joints\n"
      "  and are solved for together; cut at other joints, so that each loop closes near its own links, they may take less\n",
      counted(std::ssize(dearest.couplings), "coupling"), printable(model.names.body[static_cast<std::size_t>(dearest.slot)]),
      dearest.operations / tree);
}

nlohmann::ordered_json closures_json(const Model& model, const std::vector<ClosureWork>& closures) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const ClosureWork& one : closures) {
    nlohmann::ordered_json names = nlohmann::ordered_json::array();
    for (const Index k : one.couplings) names.push_back(model.couplings[static_cast<std::size_t>(k)].name);
    all.push_back({{"closes_at", model.names.body[static_cast<std::size_t>(one.slot)]},
                   {"couplings", names},
                   {"rows", one.rows},
                   {"velocities", one.velocities},
                   {"operations", one.operations}});
  }
  return all;
}

}  // namespace linden
