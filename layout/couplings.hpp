// layout/couplings.hpp
// Ties between two bodies that the tree does not know of: what closes a loop, holds a body to the world, or makes coordinates turn each other.
//
// A coupling has a frame on each of its bodies, and is made of *rows*: one number each, its gap, that is to stay zero. With A and B the two
// frames in the world, a_x a_y a_z and b_x b_y b_z their axes, d = A^T (x_B - x_A) how far apart they are, seen from A:
//
//   ball            d = 0                                                       3
//   hinge           d = 0, a_x.b_z = a_y.b_z = 0            turns about z       5
//   universal       d = 0, a_x.b_y = 0          turns about x of A, y of B      4
//   cylindrical     d_x = d_y = 0, a_x.b_z = a_y.b_z = 0  and shifts along z    4
//   slider          the same, a_x.b_y = 0                   shifts along z      5
//   weld            d = 0, a_x.b_z = a_y.b_z = a_x.b_y = 0                      6
//   point_on_line   d_x = d_y = 0                  x_B on the z axis of A       2
//   point_on_plane  d_z = 0                        x_B in the xy plane of A     1
//   rod             |x_B - x_A| = length                                        1
//   bushing         springs along the axes of a frame half-way from A to B, and about roll, pitch and yaw of B in A: up to 6
//   gear            sum of ratio q + offset = 0, of coordinates of screws       1
//   cable           sum of |x_k+1 - x_k| = q, through points of two bodies      1
//                   or more; q: of a joint of its own, which is its length
//
//
// Two shapes that touch are coupled for a step, by rows with the law of kernels/couplings/contact_solve.hpp. A and B lie where they touch, z along
// the normal from a to b; `rounding` tells how far the middle of each lies behind, so that what rolls is met at its lowest place:
//
//   face_contact    d_x, d_y; of the middles d_z - roundings           3   a has the face, z is fixed in it
//   round_contact   d_x, d_y; of the middles |d| - roundings           3
//
// One that resists turning has three more rows, of how far B has turned against A since the beginning of the step, 2 sin(half the turn) along x, y and z
// of A, times an arm, its `length`.
//
// What of b is an ellipsoid or a circle rolls on the face likewise, by its `oval` Q, the sum of the squares of its semi-axes as dyads: its place that
// lies lowest along n, as b sees it, is Q n / sqrt(n.Q n) before its centre, at q^k and at q^k+1. A point that turned on with the body would rise.
//
// Rows may give way: springs and dampers along their gaps instead of multipliers (kernels/couplings/compliance.hpp). A rod that does is a
// spring between two points. A bushing has nothing but such rows, those that have a stiffness or damping.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "layout/field.hpp"
#include "layout/pose.hpp"

namespace linden {

enum class CouplingKind : std::uint8_t {
  ball, hinge, universal, cylindrical, slider, weld, point_on_line, point_on_plane, rod, gear, cable, bushing, face_contact, round_contact
};
/// That people name: all but contacts.
inline constexpr int kCouplingKinds = 12;
constexpr bool is_contact(CouplingKind kind) { return kind == CouplingKind::face_contact || kind == CouplingKind::round_contact; }

/// What a row asks for.
enum class GapKind : std::uint8_t {
  shift,    // d along axis a of A
  product,  // cosine of the angle between axis a of A and axis b of B
  length,   // distance beyond the length; of a cable beyond its coordinate
  sum,      // of coordinates
  halfway,  // d along axis a of A turned half-way to B, about the axis that turns it into B; after half a turn there are two such
  turn,     // 2 sin(half the turn of B against A) along axis a of A, times the length
  angle,    // 0 roll, 1 pitch, 2 yaw of B in A: A^T B = R_z(yaw) R_y(pitch) R_x(roll); where the pitch is 90 degrees there are no two others
};

struct GapRow {
  GapKind kind;
  int a = 0, b = 0;  // axes: 0, 1, 2
};

/// A coordinate of a gear, or of a cable its length.
struct GearTerm {
  Index q_row, v_row;
  double ratio;
};

/// That a cable goes through.
struct CablePoint {
  Index slot;                  // 0: the world
  std::array<double, 3> at;    // [m], in the frame of the body
};

/// Of a row that gives way: force = -stiffness gap - damping d gap / dt. Both zero: it does not.
struct Compliance {
  double stiffness = 0, damping = 0;
  bool gives_way() const { return stiffness != 0 || damping != 0; }
  friend bool operator==(const Compliance&, const Compliance&) = default;
};
/// Of rows along, or about, the three axes of A; of rows without an axis the first.
using Compliances = std::array<Compliance, 3>;

struct Coupling {
  std::string name;
  CouplingKind kind = CouplingKind::ball;
  Index slot_a = 0, slot_b = 0;  // 0: the world; of gears and cables both
  Pose frame_a{}, frame_b{};     // in the frames of the bodies
  double length = 0;             // [m], of a rod; of a cable that in the zero configuration; of a contact that resists turning the arm of its turns
  std::vector<GearTerm> terms{}; // of a gear; of a cable one, its length
  double offset = 0;             // of a gear
  std::vector<CablePoint> points{};  // of a cable, from end to end
  std::array<double, 2> rounding{};  // [m], of a contact
  std::array<double, 6> oval{};      // of a contact: xx xy xz yy yz zz in B [m^2]; all 0: none
  Compliances shift{}, turn{};   // of rows in m [N/m, N s/m]; of angles, products, which near zero are angles, and gears [N m, N m s]
};

/// Name of a kind in scenes and messages.
const char* name_of(CouplingKind kind);
/// Rows that a coupling of this kind can have.
std::span<const GapRow> rows_of(CouplingKind kind);
/// Rows that this one is made of: of a bushing those that give way, of all others all.
std::span<const GapRow> rows_of(const Coupling& coupling);
/// Of a row of this coupling.
const Compliance& compliance_of(const Coupling& coupling, const GapRow& row);
/// Whether some row of it does.
bool gives_way(const Coupling& coupling);
/// Whether a row along or about any axis does.
bool any_gives_way(const Compliances& compliances);
/// Whether some row of it takes energy.
bool damps(const Coupling& coupling);
/// What it is: the name of its kind, of a rod that gives way a spring, of others "soft hinge".
std::string kind_text(const Coupling& coupling);
/// Rows of all of them; of these, those that do not give way.
Index row_count(std::span<const Coupling> couplings);
Index rigid_row_count(std::span<const Coupling> couplings);

}  // namespace linden
