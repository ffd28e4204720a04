#include "layout/couplings.hpp"

#include <algorithm>
#include <array>

namespace linden {
namespace {

constexpr GapRow along_x{GapKind::shift, 0}, along_y{GapKind::shift, 1}, along_z{GapKind::shift, 2};
constexpr GapRow across_x{GapKind::product, 0, 2}, across_y{GapKind::product, 1, 2}, twist{GapKind::product, 0, 1};

constexpr std::array kBall{along_x, along_y, along_z};
constexpr std::array kHinge{along_x, along_y, along_z, across_x, across_y};
constexpr std::array kUniversal{along_x, along_y, along_z, twist};
constexpr std::array kCylindrical{along_x, along_y, across_x, across_y};
constexpr std::array kSlider{along_x, along_y, across_x, across_y, twist};
constexpr std::array kWeld{along_x, along_y, along_z, across_x, across_y, twist};
constexpr std::array kPointOnLine{along_x, along_y};
constexpr std::array kPointOnPlane{along_z};
constexpr std::array kRod{GapRow{GapKind::length}};
constexpr std::array kGear{GapRow{GapKind::sum}};
constexpr std::array kCable{GapRow{GapKind::length}};
constexpr GapRow about_x{GapKind::turn, 0}, about_y{GapKind::turn, 1}, about_z{GapKind::turn, 2};
constexpr std::array kRoundContact{along_x, along_y, GapRow{GapKind::length}};
constexpr std::array kTurningFaceContact{along_x, along_y, along_z, about_x, about_y, about_z};
constexpr std::array kTurningRoundContact{along_x, along_y, GapRow{GapKind::length}, about_x, about_y, about_z};
constexpr std::array kBushing{GapRow{GapKind::halfway, 0}, GapRow{GapKind::halfway, 1}, GapRow{GapKind::halfway, 2},
                              GapRow{GapKind::angle, 0},   GapRow{GapKind::angle, 1},   GapRow{GapKind::angle, 2}};

/// Those rows of a bushing whose bit is set, for all 64 choices.
struct SomeRows {
  std::array<GapRow, kBushing.size()> rows{};
  std::size_t count = 0;
};
constexpr std::array kSomeOfBushing = [] {
  std::array<SomeRows, 1 << kBushing.size()> all{};
  for (std::size_t chosen = 0; chosen < all.size(); ++chosen) {
    for (std::size_t row = 0; row < kBushing.size(); ++row) {
      if ((chosen >> row & 1) != 0) all[chosen].rows[all[chosen].count++] = kBushing[row];
    }
  }
  return all;
}();

std::size_t axis_of(const GapRow& row) {
  switch (row.kind) {
    case GapKind::shift:
    case GapKind::halfway:
    case GapKind::turn:
    case GapKind::angle: return static_cast<std::size_t>(row.a);
    case GapKind::product: return static_cast<std::size_t>(3 - row.a - row.b);  // about which both turn away from their right angle
    case GapKind::length:
    case GapKind::sum: break;
  }
  return 0;
}

}  // namespace

const char* name_of(CouplingKind kind) {
  constexpr std::array names{"ball",          "hinge",          "universal", "cylindrical", "slider", "weld",
                             "point_on_line", "point_on_plane", "rod",       "gear",        "cable",  "bushing"};
  static_assert(names.size() == kCouplingKinds);
  return names[static_cast<std::size_t>(kind)];
}

std::span<const GapRow> rows_of(CouplingKind kind) {
  switch (kind) {
    case CouplingKind::ball: return kBall;
    case CouplingKind::hinge: return kHinge;
    case CouplingKind::universal: return kUniversal;
    case CouplingKind::cylindrical: return kCylindrical;
    case CouplingKind::slider: return kSlider;
    case CouplingKind::weld: return kWeld;
    case CouplingKind::point_on_line: return kPointOnLine;
    case CouplingKind::point_on_plane: return kPointOnPlane;
    case CouplingKind::rod: return kRod;
    case CouplingKind::gear: return kGear;
    case CouplingKind::cable: return kCable;
    case CouplingKind::face_contact: return kBall;
    case CouplingKind::round_contact: return kRoundContact;
    case CouplingKind::bushing: return kBushing;
  }
  return {};
}

std::span<const GapRow> rows_of(const Coupling& coupling) {
  if (is_contact(coupling.kind) && coupling.length > 0) {
    return coupling.kind == CouplingKind::face_contact ? std::span<const GapRow>(kTurningFaceContact) : std::span<const GapRow>(kTurningRoundContact);
  }
  if (coupling.kind != CouplingKind::bushing) return rows_of(coupling.kind);
  std::size_t chosen = 0;
  for (std::size_t row = 0; row < kBushing.size(); ++row) {
    if (compliance_of(coupling, kBushing[row]).gives_way()) chosen |= std::size_t{1} << row;
  }
  return std::span(kSomeOfBushing[chosen].rows).first(kSomeOfBushing[chosen].count);
}

const Compliance& compliance_of(const Coupling& coupling, const GapRow& row) {
  const bool shifts = row.kind == GapKind::shift || row.kind == GapKind::halfway || row.kind == GapKind::length;
  return (shifts ? coupling.shift : coupling.turn)[axis_of(row)];
}

bool any_gives_way(const Compliances& compliances) { return std::ranges::any_of(compliances, &Compliance::gives_way); }

bool gives_way(const Coupling& coupling) {
  return std::ranges::any_of(rows_of(coupling), [&](const GapRow& row) { return compliance_of(coupling, row).gives_way(); });
}

bool damps(const Coupling& coupling) {
  return std::ranges::any_of(rows_of(coupling), [&](const GapRow& row) { return compliance_of(coupling, row).damping != 0; });
}

std::string kind_text(const Coupling& coupling) {
  if (!gives_way(coupling) || coupling.kind == CouplingKind::bushing) return name_of(coupling.kind);
  if (coupling.kind == CouplingKind::rod) return "spring";
  return std::string("soft ") + name_of(coupling.kind);
}

Index rigid_row_count(std::span<const Coupling> couplings) {
  std::ptrdiff_t rows = 0;
  for (const Coupling& coupling : couplings) {
    rows += std::ranges::count_if(rows_of(coupling), [&](const GapRow& row) { return !compliance_of(coupling, row).gives_way(); });
  }
  return static_cast<Index>(rows);
}

Index row_count(std::span<const Coupling> couplings) {
  std::size_t rows = 0;
  for (const Coupling& coupling : couplings) rows += rows_of(coupling).size();
  return static_cast<Index>(rows);
}

}  // namespace linden
