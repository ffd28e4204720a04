// kernels/effects/terrain.hpp
// What of a height field a shape can touch: the faces, edges and corners that are the nearest to it of their neighbourhood.
//
//   sphere   faces that its centre lies over, edges and corners that it lies beyond the faces of
//   corner   (a sphere of radius 0) faces alone; of two faces that meet in a ridge that which it is less deep in
//   circle   faces that its lowest point lies over, ridges that pierce its plane
//   block    ridges that cross its edges or its axis, peaks under its faces or its axis
//
// Two triangles a cell: (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0). Beyond the edge of the map its last row and column go on: cells there have
// the heights of the nearest point of the map, and faces, edges and normals are those of these cells.
//
// A face ends at its edges. Where the surface turns down an edge takes over, and a gap passes from one to the other without a jump; where it
// turns up the next face holds the shape before the first lets go of it. Only corners and circles, which may lie deep in a groove beyond both of
// its faces, are held by a face's plane as long as that lies within the ground.
//
// Faces that are nearly one plane hold a shape only once: of features sorted by their gaps each later one counts with the product of `apart`
// over those before it, zero for the same normal.
//
// All in the frame of the plane that the heights stand on: x and y along it, z up.
// cost    some 200 operations a cell within reach of the shape
#pragma once

#include <array>

#include "kernels/effects/contact_geometry.hpp"
#include "kernels/effects/ground_plan.hpp"
#include "kernels/values/spatial.hpp"

namespace linden {

struct TerrainShape {
  Vec3<double> center;
  double radius;        // of a sphere [m]
  Vec3<double> axis;    // of a circle
  double rim_radius;    // of it; 0: a sphere [m]
};

struct TerrainBlock {
  Vec3<double> center;
  std::array<Vec3<double>, 3> axes;
  std::array<double, 3> half;
  double radius;
};

/// The last three are a block's, in the order of BlockContact.
enum class FeatureKind { face = 0, line = 1, pierced = 2, crossing = 3, corner_on_line = 4, corner_on_face = 5 };

struct TerrainFeature {
  FeatureKind kind;
  Vec3<double> normal;  // of the ground, unit length
  Vec3<double> line;    // direction of an edge; zero for faces and corners
  Vec3<double> foot;    // from a point of the feature to the shape's centre [m]
  double gap;           // [m]
  double weight;        // share of the ground's stiffness
  Vec3<double> middle;  // of a face
  Vec3<double> along;   // of a block: direction of its line, normal of its face into it
  Vec3<double> from;    // of a block: from its centre to a point of that line or face
};

/// Turn between two normals from which on both count in full [rad].
inline constexpr double kApart = 0.15;

/// Edges of a terrain that turn down by less are none [rad].
inline constexpr double kOnePlane = 2e-3;

/// Higher over all of a terrain than this a shape touches nothing of it within a step [m].
inline constexpr double kFarAbove = 1.0;

/// Lines that lie within the plane of a circle to less than this are not seen to pierce it, and count in full from the second on: cosine to
/// its axis.
inline constexpr double kPierces = 0.3, kPiercesClearly = 0.6;

/// The features near a shape, up to kTerrainRanks of them; in frames of the plane.
class TerrainFeatures {
 public:
  TerrainFeatures(const HeightField& field, const TerrainShape& shape);

  int count() const { return chosen_; }
  const TerrainFeature& operator[](int rank) const { return found_[static_cast<std::size_t>(rank)]; }

 private:
  static constexpr int kMost = 12;

  Vec3<double> vertex(Index i, Index j) const;
  double rounding() const;
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

/// Cosine to the axis of the angle at which a line that crosses another is let go, and from which it counts in full: nearly along it the ends
/// bear what lies on it.
inline constexpr double kCrosses = 0.1, kCrossesClearly = 0.5;

/// The features under a block, up to kBlockRanks of them.
class BlockFeatures {
 public:
  BlockFeatures(const HeightField& field, const TerrainBlock& block);

  int count() const { return count_; }
  const TerrainFeature& operator[](int rank) const { return found_[static_cast<std::size_t>(rank)]; }

 private:
  void ridge(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& left, const Vec3<double>& right);
  void cross(const Vec3<double>& from, std::size_t axis, const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& left,
             const Vec3<double>& right);
  void peak(Index i, Index j);
  void add(const TerrainFeature& feature);

  const HeightField& field_;
  const TerrainBlock block_;
  double deepest_;  // that is taken to be from above [m]
  std::array<TerrainFeature, kBlockRanks> found_;
  int count_ = 0;
};

}  // namespace linden
