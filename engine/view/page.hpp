// engine/view/page.hpp
// An animation as one HTML file that any browser opens from disk, without a network: engine/view/page/ with three.js, bundled when linden
// is built, and the data in it.
//
// Data is two elements of the page, read by engine/view/page/src/data.js:
//
//   <script type="application/json" id="linden-header">   what follows as JSON, with every < written as \u003c
//   <script type="application/octet-stream;base64" id="linden-data">   one zlib stream (RFC 1950) of all sections, little endian
//
//   header         {
//     "format"     1
//     "title"      text
//     "instances"  I
//     "frames"     F
//     "bodies"     [names], "joints" [names], "parents" [body or -1]                              of B bodies
//     "parts"      P, "meshes" [{"points": n, "triangles": m}, ...]                               of M meshes
//     "links"      [name of each part's link]
//     "lines"      [{"name", "points": [[slot, x, y, z], ...]}, ...]   cables, springs and rods: 0, the world, or b + 1, and a place in its frame [m]
//     "curves"     [{"group", "name", "unit", "body" (-1: none), "instance", "least", "most"}, ...]   of C curves
//     "grid"       [x, y, z, step]                          place = (x, y, z) + step k [m]
//     "error"      {"place": e, "angle": a}             most that a pose may be off through rounding [m], [rad]
//     "notes"      [sentences]: what is not shown, and why
//   }
//   section        type     shape, in this order without gaps but those that align each to 4 bytes
//     times        float32  [F]             since the first frame [s]
//     part_slots   int32    [P]             0: world, b + 1: body b
//     part_meshes  uint32   [P]
//     part_layers  uint32   [P]             0 visual, 1 collision, 2 inertia, 3 ground
//     part_places  float32  [P][16]         mesh -> body with the part's scale, column by column as three.js has its matrices
//     part_colours float32  [P][4]          sRGB, opacity
//     mesh m = 0 ... M - 1:  positions float32 [n][3], normals float32 [n][3], indices uint32 [m][3]
//     bounds       float32  [I][6]          least place and extent along x, y, z of each instance's bodies over all frames
//     places_low   uint16   [3][F][I][B]    k modulo 2^16, along x, y and z
//     places_high  uint16   [3][F][I][B]    k / 2^16
//     rotations    uint16   [3][F][I][B]    a, b, c of the quaternion: see below
//     largest      uint8    [F][I][B]       component of the quaternion that was left out: 0 x, 1 y, 2 z, 3 w
//     curves       uint16   [C][F]          1 + (value - least) / (most - least) * 65534; 0: no number
//     force_counts uint32   [F]             forces of each frame
//     forces       float32  [sum][8]        instance, body, place, force
//
// A quaternion of unit length is its three smaller components (x to w in this order), the largest taken positive: each is
// (2 k / 65535 - 1) / sqrt 2. Places (k modulo 2^32), rotations and curves are differences along F, modulo 2^16, the first frame whole: what
// moves evenly repeats and packs well. `largest` is as it is.
//
// The page of a running simulation has the start as its only frame, and "live" in the header (engine/view/live.hpp says what follows).
#pragma once

#include <string>

#include "engine/view/animation.hpp"

namespace linden {

/// Most that page_of may turn a body by rounding: half a step of 1 / 65535 in three components, twice that as an angle where the largest
/// component is least, 1/2.
inline constexpr double kAngleError = 7.5e-5;  // [rad]

/// The whole file. Throws std::runtime_error where there is no frame, and where this build has no page (LINDEN_VIEW=OFF).
std::string page_of(const Animation& animation);

}  // namespace linden
