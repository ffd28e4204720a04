// engine/view/solid_meshes.hpp
// Spheres, boxes and cylinders of size one, about the origin: a part's scale makes them any other (engine/view/drawing.hpp).
#pragma once

#include "engine/view/drawing.hpp"

namespace linden {

/// Of radius 1, poles along z. `around` triangles meet at each pole, with `rings` rows of faces from one to the other.
TriangleMesh unit_sphere(int around, int rings);

/// Of edges 1.
TriangleMesh unit_box();

/// Of radius 1 and length 1 along z.
TriangleMesh unit_cylinder(int around);

/// Of edges 1 in z = 0, seen from above.
TriangleMesh unit_square();

}  // namespace linden
