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

}  // namespace

const char* name_of(CouplingKind kind) {
  constexpr std::array names{"ball", "hinge", "universal", "cylindrical", "slider", "weld", "point_on_line", "point_on_plane", "rod", "gear", "cable"};
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
  }
  return {};
}

const Compliance& compliance_of(const Coupling& coupling, const GapRow& row) {
  return row.kind == GapKind::shift || row.kind == GapKind::length ? coupling.shift : coupling.turn;
}

bool gives_way(const Coupling& coupling) {
  return std::ranges::any_of(rows_of(coupling.kind), [&](const GapRow& row) { return compliance_of(coupling, row).gives_way(); });
}

std::string kind_text(const Coupling& coupling) {
  if (!gives_way(coupling)) return name_of(coupling.kind);
  if (coupling.kind == CouplingKind::rod) return "spring";
  if (coupling.kind == CouplingKind::weld) return "bushing";
  return std::string("soft ") + name_of(coupling.kind);
}

Index rigid_row_count(std::span<const Coupling> couplings) {
  std::ptrdiff_t rows = 0;
  for (const Coupling& coupling : couplings) {
    rows += std::ranges::count_if(rows_of(coupling.kind), [&](const GapRow& row) { return !compliance_of(coupling, row).gives_way(); });
  }
  return static_cast<Index>(rows);
}

Index row_count(std::span<const Coupling> couplings) {
  std::size_t rows = 0;
  for (const Coupling& coupling : couplings) rows += rows_of(coupling.kind).size();
  return static_cast<Index>(rows);
}

}  // namespace linden
