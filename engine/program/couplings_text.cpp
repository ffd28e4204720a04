#include "engine/program/couplings_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

}  // namespace linden
