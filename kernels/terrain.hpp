// kernels/terrain.hpp
// What of a height field a shape can touch: the faces, edges and corners that are the nearest to it of their neighbourhood.
//
//   sphere   faces that its centre lies over, edges and corners that it lies beyond the faces of
//   corner   (a sphere of radius 0) faces alone; of two faces that meet in a ridge that which it is less deep in
//   circle   faces that its lowest point lies over, ridges that pierce its plane
//
// Two triangles a cell: (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0). Beyond the edge of the map its last row and column go on: cells there have
// the heights of the nearest point of the map, and faces, edges and normals are those of these cells.
//
// A face goes on across its neighbours as long as its plane lies within the ground: what is deep in a groove lies beyond its faces. It ends
// where the surface turns down: there the edge takes over, and a gap passes from one to the other without a jump. Faces that are nearly one plane hold a shape only once:
// of features sorted by their gaps each later one counts with the product of `apart` over those before it, zero for the same normal. Between
// faces that turns over from 0 to 1 within kOnePlane, for a body that passes from one to the other within a step gains what their gaps then
// differ by. Normals of edges and corners turn with the body that lies on them, and `apart` goes over as slowly as kApart says.
//
// All in the frame of the plane that the heights stand on: x and y along it, z up.
// cost    some 200 operations a cell within reach of the shape
#pragma once

#include <array>

#include "kernels/contact_geometry.hpp"
#include "kernels/effects/ground_plan.hpp"
#include "kernels/spatial.hpp"

namespace linden {

struct TerrainShape {
  Vec3<double> center;
  double radius;        // of a sphere [m]
  Vec3<double> axis;    // of a circle
  double rim_radius;    // of it; 0: a sphere [m]
};

enum class FeatureKind { face = 0, line = 1, pierced = 2 };

struct TerrainFeature {
  FeatureKind kind;
  Vec3<double> normal;  // of the ground, unit length
  Vec3<double> line;    // direction of an edge; zero for faces and corners
  Vec3<double> foot;    // from a point of the feature to the shape's centre [m]
  double gap;           // [m]
  double weight;        // share of the ground's stiffness
  Vec3<double> middle;  // of a face
};

/// Turn between two normals from which on both count in full: of an edge or corner, of two faces [rad].
inline constexpr double kApart = 0.3, kOnePlane = 2e-3;

/// Higher over all of a terrain than this a shape touches nothing of it within a step [m].
inline constexpr double kFarAbove = 1.0;

/// Lines that lie within the plane of a circle to less than this are not seen to pierce it: cosine to its axis.
inline constexpr double kPierces = 0.3;

/// The features near a shape, up to kTerrainRanks of them; in frames of the plane.
class TerrainFeatures {
 public:
  TerrainFeatures(const HeightField& field, const TerrainShape& shape);

  int count() const { return chosen_; }
  const TerrainFeature& operator[](int rank) const { return found_[static_cast<std::size_t>(rank)]; }

 private:
  static constexpr int kMost = 12;

  Vec3<double> vertex(Index i, Index j) const;
  double height_below(double x, double y) const;
  double rounding() const { return 1e-12 * (field_.spacing_x + field_.spacing_y); }
  bool is_corner() const { return shape_.radius == 0 && shape_.rim_radius == 0; }
  void cell(Index i, Index j);
  void face(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& c, double sense);
  void edge(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& left, const Vec3<double>& right);
  void corner(Index i, Index j, const Vec3<double>& v);
  void add(const TerrainFeature& feature);
  bool is_under_ridge(const TerrainFeature& a, const TerrainFeature& b) const;
  void settle();

  const HeightField& field_;
  const TerrainShape shape_;
  const Vec3<double> c_;
  std::array<TerrainFeature, kMost> found_;
  int found_count_ = 0, chosen_ = 0;
  bool is_inside_ = false;  // of the ground, as corners and places of circles may be
};

}  // namespace linden
